#include "facet_types.h"
#include "raymortar/geometry/ray.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class RayTest : public testing::Test
{
};

/// A master facet, a point on it and a ray through the point, within 45
/// degrees of the facet's normal
template <class F>
struct Shot
{
  typename F::NodeMatrix master;
  typename F::RefPoint eta;
  typename F::Point n;
  double g;

  Shot(std::mt19937& random, double curvature)
      : master(random_nodes<F>(random, curvature)),
        eta(random_inside<F>(random)),
        n(-(frame_at<F>(master, eta).n + random_vector<F::gdim>(random, 0.4))
               .normalized()),
        g(random_vector<1>(random, 0.5)[0])
  {
  }

  [[nodiscard]] typename F::Point origin() const
  {
    return master * F::Node::values(eta) - g * n;
  }

  [[nodiscard]] RayHit<F>
  cast(const typename F::Point& offset = F::Point::Zero(),
       double scale = 1) const
  {
    const typename F::NodeMatrix nodes = (scale * master).colwise() + offset;
    const typename F::Point x = scale * origin() + offset;
    return intersect<F>(x, n, nodes, flat_guess<F>(x, n, nodes));
  }

  void expect_hit(const RayHit<F>& hit, double tolerance) const
  {
    ASSERT_EQ(hit.status, RayStatus::hit);
    EXPECT_LT((hit.eta - eta).norm(), tolerance);
    EXPECT_NEAR(hit.g, g, tolerance);
    EXPECT_LT(hit.outside.amount, tolerance);
  }
};
} // namespace

TYPED_TEST_SUITE(RayTest, AllFacets, );

TYPED_TEST(RayTest, FlatFacetsAreHitExactly)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 10000; ++trial)
  {
    const Shot<TypeParam> shot(random, 0);
    shot.expect_hit(shot.cast(), 1e-14);
  }
}

TYPED_TEST(RayTest, WarpedAndCurvedFacetsAreHitWithinRounding)
{
  std::mt19937 random(2);
  for (int trial = 0; trial < 10000; ++trial)
  {
    const Shot<TypeParam> shot(random, 0.03);
    shot.expect_hit(shot.cast(), 1e-13);
  }
}

TYPED_TEST(RayTest, StrongCurvatureConvergesToAHitOrReportsNone)
{
  // Up to folded facets: what is returned as a hit lies on ray and facet
  using F = TypeParam;
  std::mt19937 random(3);
  int hits = 0;
  for (int trial = 0; trial < 10000; ++trial)
  {
    const Shot<F> shot(random, 0.4);
    const RayHit<F> hit = shot.cast();
    if (hit.status != RayStatus::hit)
      continue;
    ++hits;
    const typename F::Point on_ray = shot.origin() + hit.g * shot.n;
    const typename F::Point on_facet = shot.master * F::Node::values(hit.eta);
    const double extent = 1 + on_facet.norm();
    ASSERT_LT((on_ray - on_facet).norm(), 1e-12 * extent);
  }
  EXPECT_GT(hits, 5000);
}

TYPED_TEST(RayTest, PenetrationIsANegativeGap)
{
  using F = TypeParam;
  std::mt19937 random(4);
  const auto master = random_nodes<F>(random, 0);
  const auto frame = frame_at<F>(master, F::RefPoint::Constant(0.3));
  for (const double g : {-2.0, -1e-9, 0.0, 1e-9, 3.0})
  {
    const typename F::Point n = -frame.n, x = frame.x - g * n;
    const auto hit = intersect<F>(x, n, master, flat_guess<F>(x, n, master));
    ASSERT_EQ(hit.status, RayStatus::hit);
    EXPECT_NEAR(hit.g, g, 1e-15);
  }
}

TYPED_TEST(RayTest, OutsideNamesTheEdgeThatIsCrossed)
{
  using F = TypeParam;
  std::mt19937 random(5);
  const auto master = random_nodes<F>(random, 0);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const typename F::RefPoint eta =
        random_inside<F>(random) + random_vector<F::tdim>(random, 1);
    const auto frame = frame_at<F>(master, eta);
    const typename F::Point n = -frame.n;
    const auto hit =
        intersect<F>(frame.x, n, master, flat_guess<F>(frame.x, n, master));
    ASSERT_EQ(hit.status, RayStatus::hit);
    ASSERT_NEAR(hit.outside.amount, violation<F::shape>(eta).amount, 1e-14);
    if (hit.outside.amount > 1e-12)
    {
      ASSERT_EQ(hit.outside.edge, violation<F::shape>(eta).edge);
    }
  }
}

TYPED_TEST(RayTest, RayThroughACornerOrEdgeIsOnTheFacetToRounding)
{
  using F = TypeParam;
  std::mt19937 random(6);
  for (int trial = 0; trial < 1000; ++trial)
  {
    Shot<F> shot(random, 0.03);
    const auto a = static_cast<std::size_t>(trial % F::nodes);
    shot.eta = typename F::RefPoint(F::Node::points[a].data());
    const auto hit = shot.cast();
    ASSERT_EQ(hit.status, RayStatus::hit);
    ASSERT_LT(hit.outside.amount, 0.001 * tolerance::ray_outside);
  }
}

TYPED_TEST(RayTest, RayAlongTheFacetIsParallel)
{
  using F = TypeParam;
  std::mt19937 random(7);
  const auto master = random_nodes<F>(random, 0);
  const auto frame = frame_at<F>(master, F::RefPoint::Constant(0.3));
  const typename F::Point along = frame.t.col(0).normalized();
  for (const double tilt : {0.0, 1e-16, 1e-12, -1e-12})
  {
    const typename F::Point n = along - tilt * frame.n;
    const typename F::Point x = frame.x + 0.1 * frame.n;
    const auto hit = intersect<F>(x, n, master, F::RefPoint::Constant(0.3));
    EXPECT_EQ(hit.status, RayStatus::parallel) << tilt;
  }
}

TYPED_TEST(RayTest, GrazingRayStaysFinite)
{
  using F = TypeParam;
  std::mt19937 random(8);
  const auto master = random_nodes<F>(random, 0);
  const auto frame = frame_at<F>(master, F::RefPoint::Constant(0.3));
  const typename F::Point along = frame.t.col(0).normalized();
  for (const double tilt : {1e-6, -1e-6, 1e-3})
  {
    const typename F::Point n = (along - tilt * frame.n).normalized();
    const typename F::Point x = frame.x - 0.1 * n;
    const auto hit = intersect<F>(x, n, master, F::RefPoint::Constant(0.5));
    ASSERT_EQ(hit.status, RayStatus::hit);
    EXPECT_NEAR(hit.g, 0.1, 1e-15 / std::abs(tilt));
  }
}

TYPED_TEST(RayTest, NotANumberIsNeverAHit)
{
  using F = TypeParam;
  std::mt19937 random(9);
  const Shot<F> shot(random, 0.03);
  for (int bad = 0; bad < F::nodes; ++bad)
  {
    Shot<F> broken = shot;
    broken.master(0, bad) = NAN;
    EXPECT_NE(broken.cast().status, RayStatus::hit);
  }
  EXPECT_NE(shot.cast(F::Point::Constant(NAN)).status, RayStatus::hit);
  EXPECT_NE(shot.cast(F::Point::Zero(), 0).status, RayStatus::hit);
}

TYPED_TEST(RayTest, LargeOffsetLosesOnlyTheOffsetsDigits)
{
  using F = TypeParam;
  std::mt19937 random(10);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const Shot<F> shot(random, 0.03);
    shot.expect_hit(shot.cast(F::Point::Constant(1e6)), 4e-9);
  }
}

TYPED_TEST(RayTest, ScaleChangesOnlyTheGap)
{
  using F = TypeParam;
  std::mt19937 random(11);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const Shot<F> shot(random, 0.03);
    for (const double scale : {1e-9, 1e-3, 1e6})
    {
      RayHit<F> hit = shot.cast(F::Point::Zero(), scale);
      hit.g /= scale;
      shot.expect_hit(hit, 1e-13);
    }
  }
}

TYPED_TEST(RayTest, FacetDrawnTogetherInALineIsNotHit)
{
  // All nodes but one in a point: tangents are parallel to rounding
  using F = TypeParam;
  if constexpr (F::gdim == 3)
  {
    std::mt19937 random(12);
    for (int trial = 0; trial < 1000; ++trial)
    {
      typename F::NodeMatrix master = F::NodeMatrix::Zero();
      master.col(trial % F::nodes) = random_vector<3>(random, 1);
      const Vec<3> x = random_vector<3>(random, 1);
      const Vec<3> n = random_vector<3>(random, 1).normalized();
      const auto hit = intersect<F>(x, n, master, random_inside<F>(random));
      ASSERT_NE(hit.status, RayStatus::hit);
    }
  }
}
