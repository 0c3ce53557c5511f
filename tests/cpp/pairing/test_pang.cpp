#include "fuzzed.h"
#include "raymortar/search/pang.h"
#include <numeric>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class PangTest : public FuzzedSurfaces<F>
{
protected:
  static constexpr int D = F::gdim;

  static WalkedPairs walk(const Surface& slave, const Surface& master,
                          const SearchDistances& distances)
  {
    return pang<D>(slave, master, ray_boxes<D>(slave, distances),
                   facet_boxes<D>(master));
  }

  static Surface moved(Surface s, double dx, double dz)
  {
    transform<D>(s,
                 [&](Vec<D> x) -> Vec<D>
                 {
                   x[0] += dx;
                   x[D - 1] += dz;
                   return x;
                 });
    return s;
  }

  /// In any numbering of the facets
  static Surface renumbered(const Surface& s, std::mt19937& random)
  {
    std::vector<std::size_t> order(s.facet_id.size());
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), random);
    Surface result = s;
    for (std::size_t f = 0; f < order.size(); ++f)
    {
      std::copy_n(s.facet_nodes.begin() + order[f] * F::nodes, F::nodes,
                  result.facet_nodes.begin() + f * F::nodes);
      std::copy_n(s.facet_dofs.begin() + order[f] * F::dofs, F::dofs,
                  result.facet_dofs.begin() + f * F::dofs);
    }
    result.neighbours = find_neighbours(result);
    return result;
  }
};
} // namespace

TYPED_TEST_SUITE(PangTest, AllFacets, );

TYPED_TEST(PangTest, FindsWhatBruteForceFinds)
{
  EXPECT_GT(this->compare(walk_to_candidates, 21, 1000), 100000u);
}

TYPED_TEST(PangTest, WalksToNearlyAllPairs)
{
  std::mt19937 random(22);
  std::int64_t seeds = 0, pairs = 0;
  for (int trial = 0; trial < 100; ++trial)
  {
    const auto [slave, master] = this->scene(random);
    const WalkedPairs found =
        this->walk(slave, master, this->distances(random));
    seeds += found.seeds;
    pairs += found.candidates.offsets.back();
  }
  EXPECT_GT(seeds, 50);
  EXPECT_LT(static_cast<double>(seeds), 0.02 * static_cast<double>(pairs));
}

TYPED_TEST(PangTest, StartsOnceForEachConnectedPart)
{
  std::mt19937 random(23);
  const Surface slave = this->grid(9, false, plate(1, 0));
  const Surface master = this->grid(7, true, plate(1, -0.01));
  const SearchDistances distances{0.1, 0.1, 0.02};
  const auto seeds = [&](const Surface& s, const Surface& m)
  {
    return this
        ->walk(this->renumbered(s, random), this->renumbered(m, random),
               distances)
        .seeds;
  };
  EXPECT_EQ(seeds(slave, master), 1);
  // Beyond the reach
  EXPECT_EQ(seeds(slave, this->moved(master, 0, -5)), 0);
  // Two islands, and two layers that are not connected
  EXPECT_EQ(seeds(joined(slave, this->moved(slave, 3, 0)),
                  joined(master, this->moved(master, 3, 0))),
            2);
  EXPECT_EQ(seeds(slave, joined(master, this->moved(master, 0, -0.05))), 2);
}

TYPED_TEST(PangTest, FindsSheetsThatLeaveTheReachAndReturn)
{
  const auto wave = [](double x, double)
  { return -0.3 - 0.3 * std::cos(7 * x); };
  const Surface slave = this->grid(40, false, plate(1, 0));
  const Surface master = this->grid(40, true, graph(1, wave));
  const SearchDistances distances{0.1, 0.1, 0};
  const WalkedPairs pairs = this->walk(slave, master, distances);
  const auto all = compare_all_boxes(slave, master, distances);
  EXPECT_EQ(pairs.candidates.offsets, all.offsets);
  EXPECT_EQ(pairs.candidates.masters, all.masters);
  EXPECT_EQ(pairs.seeds, 2); // crests at x = +-0.45
}

TYPED_TEST(PangTest, GivesTheVeryPointsOfTheTree)
{
  std::mt19937 random(24);
  for (int trial = 0; trial < 10; ++trial)
  {
    const auto [slave, master] = this->scene(random);
    const SegmentationOptions options{0.4, 0.4, false};
    const auto by = [&, &slave = slave, &master = master](FindPairs find)
    {
      return make_segments(slave, master, find(slave, master, {0.4, 0.4, 0.05}),
                           options);
    };
    const Segmentation walked = by(walk_to_candidates),
                       tree = by(find_candidates);
    EXPECT_EQ(walked.vertices, tree.vertices);
    EXPECT_EQ(walked.covered, tree.covered);
  }
}

TYPED_TEST(PangTest, EmptySidesHaveNoPairs)
{
  const Surface full = this->grid(3, true, plate(1, 0));
  Surface none = full;
  none.facet_id.clear();
  none.neighbours.clear();
  const SearchDistances distances{1, 1, 0};
  const WalkedPairs without_master = this->walk(full, none, distances);
  EXPECT_TRUE(without_master.candidates.masters.empty());
  EXPECT_EQ(without_master.candidates.offsets.size(), full.facet_id.size() + 1);
  EXPECT_EQ(without_master.seeds, 0);
  EXPECT_EQ(this->walk(none, full, distances).candidates.offsets.size(), 1u);
}
