#include "rays.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class SecondChance : public testing::Test
{
};

/// Rays that hit a strongly bent facet, from where the hit on the flat facet
/// leads Newton's method astray
template <class F>
Rays<F> rays_led_astray(const Surface& master)
{
  // In the plane only oblique rays are led astray
  const double oblique = F::gdim == 2 ? 1.0 : 0.6;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  Rays<F> rays;
  for (int trial = 0; trial < 20000; ++trial)
  {
    const Index f = trial % master.num_facets();
    const auto nodes = master.nodes<F>(master.x, f);
    const auto edge = on_edge<F>(trial / 7 % F::Ref::edges, unit(random));
    const typename F::RefPoint eta =
        edge + unit(random) * (F::RefPoint::Constant(0.3) - edge);
    const auto frame = frame_at<F>(nodes, eta);
    const typename F::Point n =
        (-frame.n + random_vector<F::gdim>(random, oblique)).normalized();
    const typename F::Point x = frame.x - 0.3 * (2 * unit(random) - 1) * n;
    const auto first = intersect<F>(x, n, nodes, flat_guess<F>(x, n, nodes));
    if (first.status != RayStatus::hit or
        first.outside.amount > tolerance::ray_outside)
      if (n.dot(frame.n) < -0.1)
        rays.add(x, n, f);
  }
  return rays;
}
} // namespace

using CurvedFacets = testing::Types<Interval2, Triangle2, Quad2>;
TYPED_TEST_SUITE(SecondChance, CurvedFacets, );

TYPED_TEST(SecondChance, FindsEveryHitThatTheFlatGuessMisses)
{
  using F = TypeParam;
  const Surface master = make_surface(
      {F::shape, F::degree, F::node_degree, 1, false}, raised(1, 2, 0));
  const Rays<F> rays = rays_led_astray<F>(master);
  EXPECT_GT(rays.slave.num_facets(), 100);
  const Hits hits = cast_rays(rays.slave, master, rays.points, {3, 30});
  const auto found =
      std::count(hits.status.begin(), hits.status.end(), RayStatus::hit);
  EXPECT_EQ(found, rays.slave.num_facets());
}
