#include "fuzzed.h"
#include "raymortar/pairing/advancing_front.h"
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class AdvancingFrontTest : public FuzzedSurfaces<F>
{
};

std::set<std::pair<Index, Index>> pairs_of(const Segmentation& s)
{
  std::set<std::pair<Index, Index>> pairs;
  for (const Segment& one : s.segments)
    pairs.emplace(one.slave, one.master);
  return pairs;
}
} // namespace

TYPED_TEST_SUITE(AdvancingFrontTest, AllFacets, );

TYPED_TEST(AdvancingFrontTest, FindsWhatBruteForceFinds)
{
  EXPECT_GT(this->compare(Strategy::advancing_front, 11, 170), 10000u);
}

TYPED_TEST(AdvancingFrontTest, GivesTheSegmentsAndAreaOfTheTree)
{
  std::mt19937 random(12);
  for (int trial = 0; trial < 10; ++trial)
  {
    const auto [slave, master] = this->scene(random);
    const SegmentationOptions options{0.4, 0.4, false};
    const auto by = [&, &slave = slave, &master = master](Strategy strategy)
    {
      return make_segments(
          slave, master,
          find_candidates(slave, master, {0.4, 0.4, 0.05}, strategy), options);
    };
    const Segmentation front = by(Strategy::advancing_front);
    const Segmentation tree = by(Strategy::bvh);
    EXPECT_EQ(pairs_of(front), pairs_of(tree));
    EXPECT_NEAR(total(front.covered), total(tree.covered),
                1e-10 * (1 + total(tree.covered)));
  }
}

TYPED_TEST(AdvancingFrontTest, EmptySidesHaveNoPairs)
{
  const Surface full = this->grid(3, true, plate(1, 0));
  Surface none = full;
  none.facet_id.clear();
  none.neighbours.clear();
  const auto without_master =
      find_candidates(full, none, {1, 1, 0}, Strategy::advancing_front);
  EXPECT_TRUE(without_master.masters.empty());
  EXPECT_EQ(without_master.offsets.size(), full.facet_id.size() + 1);
  EXPECT_EQ(find_candidates(none, full, {1, 1, 0}, Strategy::advancing_front)
                .offsets.size(),
            1u);
}
