#include "facet_types.h"
#include "raymortar/geometry/frame.h"
#include "raymortar/search/pang.h"
#include "surfaces.h"
#include <algorithm>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class CandidatesTest : public testing::Test
{
protected:
  /// Wavy surface with nodes off by up to `noise`
  static Surface wavy(std::mt19937& random, int n, bool up, double noise)
  {
    Surface s = make_surface(
        {F::shape, F::degree, F::node_degree, n, up},
        graph(1, [](double x, double y)
              { return 0.3 * std::sin(3 * x) * std::cos(2 * y); }));
    transform<F::gdim>(s,
                       [&](const Vec<F::gdim>& x) -> Vec<F::gdim>
                       { return x + random_vector<F::gdim>(random, noise); });
    return s;
  }
};
} // namespace

TYPED_TEST_SUITE(CandidatesTest, AllFacets, );

TYPED_TEST(CandidatesTest, TreeFindsWhatBruteForceFinds)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial)
  {
    const Surface slave = this->wavy(random, 1 + trial % 7, true, 0.02);
    Surface master = this->wavy(random, 1 + trial % 5, false, 0.02);
    turn_and_shift(master, 0.1 * trial, 0.02 * trial);
    const SearchDistances distances{0.01 * trial, 0.1, 0.01 * (trial % 3)};
    const auto reference = compare_all_boxes(slave, master, distances);
    const auto tree = find_candidates(slave, master, distances);
    EXPECT_EQ(tree.offsets, reference.offsets);
    EXPECT_EQ(tree.masters, reference.masters);
  }
}

TYPED_TEST(CandidatesTest, EveryFacetLooksAsFarAsItsOwnDistances)
{
  std::mt19937 random(5);
  std::uniform_real_distribution<double> length(0, 0.3);
  for (int trial = 0; trial < 20; ++trial)
  {
    const Surface slave = this->wavy(random, 2 + trial % 5, true, 0.02);
    Surface master = this->wavy(random, 1 + trial % 4, false, 0.02);
    turn_and_shift(master, 0.1 * trial, 0.02 * trial);
    std::vector<SearchDistances> each(
        static_cast<std::size_t>(slave.num_facets()));
    for (SearchDistances& one : each)
      one = {length(random), length(random), length(random)};
    const FacetDistances local(each, true);
    const auto reference = compare_all_boxes(slave, master, local);
    for (const FindPairs find : {find_candidates, walk_to_candidates})
    {
      const auto found = find(slave, master, local);
      EXPECT_EQ(found.offsets, reference.offsets);
      EXPECT_EQ(found.masters, reference.masters);
    }
    for (Index f = 0; f < slave.num_facets(); ++f)
    {
      const auto alone =
          compare_all_boxes(slave, master, each[static_cast<std::size_t>(f)]);
      EXPECT_TRUE(
          std::ranges::equal(alone.masters_of(f), reference.masters_of(f)));
    }
  }
}

TYPED_TEST(CandidatesTest, SweptBoxesHoldEveryRay)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double reach : {0.0, 0.1, 1.0, 10.0})
    for (const double noise : {0.0, 0.02, 0.05})
    {
      const Surface s = this->wavy(random, 4, true, noise);
      const SearchDistances distances{reach, 0.5 * reach, 0};
      const auto boxes = ray_boxes<D>(s, distances);
      for (int trial = 0; trial < 5000; ++trial)
      {
        const Index f = trial % s.num_facets();
        const auto frame =
            frame_at<F>(s.nodes<F>(s.x, f), random_inside<F>(random));
        const double g = reach * (1.5 * unit(random) - 0.5);
        const Vec<D> x = frame.x + g * frame.n;
        ASSERT_TRUE(boxes[static_cast<std::size_t>(f)].overlaps({x, x}))
            << "reach " << reach << " noise " << noise;
      }
    }
}

TYPED_TEST(CandidatesTest, FacetBoxesHoldTheCurvedFacet)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  std::mt19937 random(3);
  const Surface s = this->wavy(random, 4, true, 0.05);
  const auto boxes = facet_boxes<D>(s);
  for (int trial = 0; trial < 5000; ++trial)
  {
    const Index f = trial % s.num_facets();
    const Vec<D> x =
        frame_at<F>(s.nodes<F>(s.x, f), random_inside<F>(random)).x;
    ASSERT_TRUE(boxes[static_cast<std::size_t>(f)].overlaps({x, x}));
  }
}

TYPED_TEST(CandidatesTest, SkinKeepsCandidatesWhileSidesMoveByHalfOfIt)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  std::mt19937 random(4);
  const double skin = 0.1, half = 0.5 * skin;
  const Surface slave = this->wavy(random, 4, true, 0.0);
  const Surface master = this->wavy(random, 5, false, 0.0);
  const auto kept = find_candidates(slave, master, {0.2, 0.1, skin});
  Surface moved_slave = slave, moved_master = master;
  const Vec<D> shift = Vec<D>::Constant(half / std::sqrt(D));
  transform<D>(moved_slave,
               [&](const Vec<D>& x) -> Vec<D> { return x + shift; });
  transform<D>(moved_master,
               [&](const Vec<D>& x) -> Vec<D> { return x - shift; });
  const auto fresh = find_candidates(moved_slave, moved_master, {0.2, 0.1, 0});
  for (Index f = 0; f < slave.num_facets(); ++f)
  {
    const auto old = kept.masters_of(f);
    for (const Index m : fresh.masters_of(f))
      EXPECT_TRUE(std::binary_search(old.begin(), old.end(), m));
  }
}

TYPED_TEST(CandidatesTest, EmptySidesHaveNoCandidates)
{
  std::mt19937 random(5);
  const Surface full = this->wavy(random, 3, true, 0);
  Surface none = full;
  none.facet_id.clear();
  for (const FindPairs find : {compare_all_boxes, find_candidates})
  {
    const auto without_master = find(full, none, {1, 1, 0});
    EXPECT_TRUE(without_master.masters.empty());
    EXPECT_EQ(without_master.offsets.size(), full.facet_id.size() + 1);
    EXPECT_EQ(find(none, full, {1, 1, 0}).offsets.size(), 1u);
  }
}
