#include "interface/held.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class HeldNodesTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(HeldNodesTest, HeldTypes, );

TYPED_TEST(HeldNodesTest, ComponentsAreUnfeltWhereBothSidesHoldThem)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const Held<F> first = [](const Vec<D>&) { return Vec<D>::Unit(0); };
  const auto expect_unfelt =
      [&](const Held<F>& slave, const Held<F>& master, const Vec<D>& expected)
  {
    const auto found = find<F>(s, Law::friction, slave, master).unfelt;
    ASSERT_EQ(found.size(), s.slave.facet_id.size() * D);
    for (std::size_t k = 0; k < found.size(); ++k)
      EXPECT_EQ(found[k], expected[static_cast<int>(k % D)]);
  };
  expect_unfelt(everything<F>, everything<F>, Vec<D>::Ones());
  expect_unfelt(everything<F>, first, Vec<D>::Unit(0));
  expect_unfelt(first, everything<F>, Vec<D>::Unit(0));
  expect_unfelt(everything<F>, nothing<F>, Vec<D>::Zero());
  expect_unfelt(nothing<F>, everything<F>, Vec<D>::Zero());
}

TYPED_TEST(HeldNodesTest, OneFreeNodeOfAFacetFeelsAComponent)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const double edge = first_edge<F>(s);
  const Held<F> inside = [&](const Vec<D>& x) -> Vec<D>
  { return Vec<D>::Constant(is_at(edge, x[0]) ? 0.0 : 1.0); };
  const auto found = find<F>(s, Law::friction, inside, everything<F>).unfelt;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const auto x = s.slave.nodes<F>(s.slave.X, f);
    const bool is_free = is_at(edge, x.row(0).minCoeff());
    EXPECT_EQ(found[static_cast<std::size_t>(f) * D], is_free ? 0 : 1);
  }
}

TYPED_TEST(HeldNodesTest, NodesCountThatBothSidesHoldAlongTheNormal)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const double edge = first_edge<F>(s);
  const Held<F> at_edge = [&](const Vec<D>& x) -> Vec<D>
  { return Vec<D>::Constant(is_at(edge, x[0]) ? 1.0 : 0.0); };
  const Held<F> normal = [](const Vec<D>&) { return Vec<D>::Unit(D - 1); };
  const Held<F> along = [](const Vec<D>&) -> Vec<D>
  { return Vec<D>::Ones() - Vec<D>::Unit(D - 1); };
  const auto count = [&](const Held<F>& slave, const Held<F>& master)
  {
    const auto found = find<F>(s, Law::friction, slave, master).nodes;
    EXPECT_EQ(found.size(), s.slave.facet_dofs.size());
    return std::count(found.begin(), found.end(), 1);
  };
  const auto all = static_cast<std::ptrdiff_t>(s.slave.facet_dofs.size());
  EXPECT_EQ(count(everything<F>, everything<F>), all);
  EXPECT_EQ(count(normal, normal), all);
  EXPECT_EQ(count(along, everything<F>), 0);
  EXPECT_EQ(count(everything<F>, along), 0);
  EXPECT_EQ(count(everything<F>, nothing<F>), 0);
  std::ptrdiff_t held = 0;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const auto x = s.slave.nodes<F>(s.slave.X, f);
    for (int a = 0; a < F::dofs; ++a)
      held += is_at(edge, x(0, a));
  }
  EXPECT_EQ(count(at_edge, everything<F>), held);
}
