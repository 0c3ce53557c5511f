#include "facet_types.h"
#include "rays.h"
#include "rules.h"
#include "surfaces.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
IntegrationPoints points_of(const Surface& slave, const Segmentation& segments,
                            bool complement)
{
  return make_points(slave, segments, segment_rules(slave.shape, 5),
                     rule_on(slave.shape, 5), complement);
}

struct Scene
{
  Surface slave;
  Surface master;
  IntegrationPoints points;
  Hits hits;

  Scene(Surface s, Surface m, const SearchDistances& range,
        bool complement = false)
      : slave(std::move(s)), master(std::move(m)),
        points(points_of(slave, segments_of(slave, master, {range, false}),
                         complement)),
        hits(cast_rays(slave, master, points, range))
  {
  }

  [[nodiscard]] std::size_t count(RayStatus status) const
  {
    return static_cast<std::size_t>(
        std::count(hits.status.begin(), hits.status.end(), status));
  }
};

template <class F>
typename F::Point position(const Surface& s, Index facet, const Vec<2>& at)
{
  return frame_at<F>(s.nodes<F>(s.x, facet), at.head<F::tdim>()).x;
}

/// Distance from the end of each ray to the point that was hit
template <class F>
double worst_residual(const Scene& scene)
{
  double worst = 0;
  for (std::size_t q = 0; q < scene.points.size(); ++q)
  {
    if (scene.hits.status[q] != RayStatus::hit)
      continue;
    const auto nodes =
        scene.slave.nodes<F>(scene.slave.x, scene.points.slave[q]);
    const auto frame =
        frame_at<F>(nodes, scene.points.xi[q].template head<F::tdim>());
    const typename F::Point gap =
        frame.x + scene.hits.gap[q] * frame.n -
        position<F>(scene.master, scene.hits.master[q], scene.hits.eta[q]);
    worst = std::max(worst, gap.norm());
    EXPECT_LE(
        violation<F::shape>(scene.hits.eta[q].template head<F::tdim>()).amount,
        tolerance::ray_outside);
  }
  return worst;
}

template <class F>
class RaysTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(RaysTest, AllFacets, );

TEST(Points, WeightsAreNotNegativeAndAddUpToTheSlave)
{
  std::mt19937 random(1);
  for (const Shape shape : all_shapes)
    for (int trial = 0; trial < 200; ++trial)
    {
      Surface slave = make_surface({shape, 1, 1, 4, true}, plate(1, 0));
      jitter(slave, random, 0.1);
      const Surface master = make_surface({shape, 1, 1, 3, false}, plate(1, 0));
      const auto p =
          points_of(slave, segments_of(slave, master, {1, 1, false}), true);
      // But for the rounding of triangles between three vertices on a line
      for (const double weight : p.weight)
        ASSERT_GT(weight, -1e-15);
      EXPECT_NEAR(total(p.area), shape == Shape::interval ? 2 : 4, 1e-13);
      for (std::size_t f = 0; f < p.whole.size(); ++f)
        EXPECT_NEAR(p.covered[f], p.whole[f], 1e-13);
    }
}

TEST(Points, WarpedQuadrilateralsKeepTheirMeasure)
{
  // G-11: no error of the segments, the square root of a Jacobian is left
  std::mt19937 random(2);
  Surface slave =
      make_surface({Shape::quadrilateral, 1, 1, 3, true}, plate(1, 0));
  jitter(slave, random, 0.2);
  for (std::size_t k = 2; k < slave.X.size(); k += 3)
    slave.X[k] = 0.1 * random_vector<1>(random, 1)[0];
  slave.x = slave.X;
  const Surface master =
      make_surface({Shape::quadrilateral, 1, 1, 4, false}, plate(2, 0.3));
  const auto segments = segments_of(slave, master, {1, 1, false});
  const auto p =
      make_points(slave, segments, segment_rules(Shape::quadrilateral, 14),
                  rule_on(Shape::quadrilateral, 20), true);
  for (std::size_t f = 0; f < p.whole.size(); ++f)
    EXPECT_NEAR(p.covered[f], p.whole[f], 1e-10);
}

TEST(Points, ComplementIsTheUncoveredPart)
{
  for (const Shape shape : all_shapes)
    for (const double part : {0.01, 0.4, 0.75, 0.99})
    {
      const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
      const double end = -1 + 2 * part;
      const Surface master =
          make_surface({shape, 1, 1, 4, false}, [&](double s, double t)
                       { return Vec<3>(-1 + 2 * part * s, 2 * t - 1, 0.1); });
      const auto p =
          points_of(slave, segments_of(slave, master, {1, 1, false}), true);
      // Area and first moments in x of what is left
      double area = 0, moment = 0;
      for (std::size_t q = 0; q < p.size(); ++q)
        if (p.seed[q] == no_index)
          with_facet_type(slave,
                          [&]<class F>(F)
                          {
                            area += p.area[q];
                            moment += p.area[q] * position<F>(slave, p.slave[q],
                                                              p.xi[q])[0];
                          });
      const double width = shape == Shape::interval ? 1 : 2;
      EXPECT_NEAR(area, width * (1 - end), 1e-13);
      EXPECT_NEAR(moment, width * (1 - end * end) / 2, 1e-13);
      EXPECT_NEAR(total(p.covered) + area, total(p.whole), 1e-13);
    }
}

TEST(Points, OfRevolutionHaveTheAreaOfAFullTurn)
{
  // A cone from its tip on the axis to the radius 2, covered up to 1.5
  const Surface slave =
      make_surface({Shape::interval, 1, 1, 4, true},
                   [](double s, double) { return Vec<3>(2 * s, 0, 1.5 * s); });
  const Surface master =
      make_surface({Shape::interval, 1, 1, 3, false}, [](double s, double)
                   { return Vec<3>(1.5 * s, 0, 1.125 * s); });
  const auto p = make_points(slave, segments_of(slave, master, {1, 1, false}),
                             segment_rules(Shape::interval, 5),
                             rule_on(Shape::interval, 5), true, true);
  const double turn = std::numbers::pi * 1.25;
  EXPECT_NEAR(total(p.whole), turn * 4.0, 1e-12);
  EXPECT_NEAR(total(p.covered), turn * 1.5 * 1.5, 1e-12);
  EXPECT_NEAR(total(p.area), turn * 4.0, 1e-12);
  for (const double width : p.width)
    EXPECT_NEAR(width, 0.625, 1e-14);
}

TEST(Points, WithoutMultiplierNoComplementIsMade)
{
  for (const Shape shape : all_shapes)
  {
    const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
    Surface none = slave;
    none.facet_id.clear();
    const auto segments = segments_of(slave, none, {1, 1, false});
    EXPECT_EQ(points_of(slave, segments, false).size(), 0u);
    const auto p = points_of(slave, segments, true);
    EXPECT_NEAR(total(p.area), shape == Shape::interval ? 2 : 4, 1e-14);
    const auto hits = cast_rays(slave, none, p, {1, 1});
    for (std::size_t q = 0; q < p.size(); ++q)
    {
      EXPECT_EQ(hits.status[q], RayStatus::no_facet);
      EXPECT_EQ(hits.master[q], no_index);
    }
  }
}

TYPED_TEST(RaysTest, CurvedMastersHandRaysToTheirNeighbours)
{
  using F = TypeParam;
  for (const double gap : {1e-9, 1e-3, 0.1, -0.05})
    for (int n = 3; n < 6; ++n)
    {
      const Scene scene(
          make_surface({F::shape, F::degree, F::node_degree, 4, true},
                       raised(0.8, 0.3, 0)),
          make_surface({F::shape, F::degree, F::node_degree, n, false},
                       raised(1.2, 0.3, gap)),
          {0.6, 0.6});
      EXPECT_EQ(scene.count(RayStatus::hit), scene.points.size());
      EXPECT_LT(worst_residual<F>(scene), 4e-15);
      double handed = 0.0;
      for (std::size_t q = 0; q < scene.points.size(); ++q)
        if (scene.hits.master[q] != scene.points.seed[q])
          handed += std::abs(scene.points.area[q]);
      // Segments break where the ray's master changes, but for chords in place
      // of edges that curve within the slave
      const bool chords = F::tdim == 2 and not F::affine;
      EXPECT_LE(handed, (chords ? 0.01 : 0.0) * total(scene.points.area));
    }
}

/// Whether a ray that comes out of the master at g has entered it behind x too
template <class F>
bool is_outside(const Surface& master, const typename F::Point& x,
                const typename F::Point& n, double g)
{
  bool enters = false;
  for (Index f = 0; f < master.num_facets(); ++f)
  {
    const auto nodes = master.nodes<F>(master.x, f);
    const auto hit = intersect<F>(x, n, nodes, flat_guess<F>(x, n, nodes));
    enters = enters or (hit.status == RayStatus::hit and hit.g > g and
                        hit.g < 0.0 and hit.outside.amount < 0.0 and
                        n.dot(frame_at<F>(nodes, hit.eta).n) > 0.0);
  }
  return enters;
}

TYPED_TEST(RaysTest, NoRayIsLostAtInteriorEdges)
{
  // Through both sides of every edge, from 1e-17 to a tenth of the facet away
  // from it, on facets that turn by up to 50 degrees; G-15
  using F = TypeParam;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double gap : {1e-9, 1e-3, 0.1})
    for (const double offset : {0.0, 1e6})
    {
      Surface master = make_surface(
          {F::shape, F::degree, F::node_degree, 4, false}, raised(1, 1, 0));
      for (double& x : master.x)
        x += offset;
      Rays<F> rays;
      std::vector<double> gaps;
      for (int trial = 0; trial < 5000; ++trial)
      {
        const Index f = trial % master.num_facets();
        const int e = trial / 7 % F::Ref::edges;
        const Index next = neighbour<F>(master, f, e);
        const double along = unit(random);
        if (next == no_index)
          continue;
        const auto edge = on_edge<F>(e, along);
        const auto eta = edge + std::pow(10, -17 + 16 * unit(random)) *
                                    (F::RefPoint::Constant(0.3) - edge);
        const auto frame = frame_at<F>(master.nodes<F>(master.x, f), eta);
        const auto other =
            frame_at<F>(master.nodes<F>(master.x, next),
                        on_edge<F>(edge_to<F>(master, next, f), 1 - along));
        const typename F::Point n =
            (-frame.n + random_vector<F::gdim>(random, 0.4)).normalized();
        // At a ridge with one side turned away the ray may pass
        if (n.dot(other.n) > -0.1)
          continue;
        for (const Index seed : {f, next})
        {
          const double g = gap * (2 * unit(random) - 1);
          const typename F::Point x = frame.x - g * n;
          if (is_outside<F>(master, x, n, g))
            continue;
          gaps.push_back(g);
          rays.add(x, n, seed);
        }
      }
      // Oblique rays have a tenth of the depth
      const Hits hits = cast_rays(rays.slave, master, rays.points, {0.3, 3.0});
      int lost = 0;
      for (std::size_t q = 0; q < gaps.size(); ++q)
        lost += hits.status[q] != RayStatus::hit or
                std::abs(hits.gap[q] - gaps[q]) > 1e-8;
      EXPECT_EQ(lost, 0) << "of " << gaps.size() << ", gap " << gap
                         << ", offset " << offset;
    }
}

TYPED_TEST(RaysTest, StatusTellsWhyThereIsNoContact)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const Surface master = make_surface(
      {F::shape, F::degree, F::node_degree, 2, false}, plate(1, 0));
  Rays<F> rays;
  using Point = Vec<D>;
  const Point up = Point::Unit(D - 1), along = Point::Unit(0);
  const Point inside = Point::Constant(0.1) - 0.1 * up;
  rays.add(inside - 0.1 * up, up, 0);
  rays.add(inside - 0.5 * up, up, 0);
  rays.add(inside + 0.5 * up, up, 0);
  rays.add(inside + 0.1 * up, -up, 0);
  rays.add(inside - 0.1 * up + 3 * along, up, 0);
  rays.add(inside - 0.1 * up, along, 0);
  // G-20: grazing from the front is taken for no contact as well
  rays.add(inside - 1e-6 * along - 1e-12 * up, (along + 1e-6 * up).normalized(),
           0);
  const Hits hits = cast_rays(rays.slave, master, rays.points, {0.2, 0.2});
  const std::vector<RayStatus> expected = {
      RayStatus::hit,       RayStatus::too_far,  RayStatus::too_deep,
      RayStatus::back_face, RayStatus::no_facet, RayStatus::parallel,
      RayStatus::back_face};
  EXPECT_EQ(hits.status, expected);
  for (std::size_t q = 0; q < expected.size(); ++q)
    EXPECT_EQ(hits.master[q] == no_index, expected[q] != RayStatus::hit);
}

TYPED_TEST(RaysTest, DepthShrinksWithTheCosineOfIncidenceAndReachDoesNot)
{
  // A face beside a corner looks along the master that pokes over the corner
  using F = TypeParam;
  constexpr int D = F::gdim;
  const Surface master = make_surface(
      {F::shape, F::degree, F::node_degree, 2, false}, plate(1, 0));
  const Vec<D> up = Vec<D>::Unit(D - 1), along = Vec<D>::Unit(0);
  const Vec<D> target = Vec<D>::Constant(0.1) - 0.1 * up;
  Rays<F> rays;
  std::vector<RayStatus> expected;
  for (const double cosine : {1.0, 0.5, 0.1, 0.01})
  {
    const Vec<D> n = cosine * up + std::sqrt(1 - cosine * cosine) * along;
    for (const double g :
         {-1.01 * 0.2 * cosine, -0.99 * 0.2 * cosine, 0.199, 0.201})
    {
      rays.add(target - g * n, n, 0);
      expected.push_back(g < -0.2 * cosine ? RayStatus::too_deep
                         : g > 0.2         ? RayStatus::too_far
                                           : RayStatus::hit);
    }
  }
  const Hits hits = cast_rays(rays.slave, master, rays.points, {0.2, 0.2});
  EXPECT_EQ(hits.status, expected);
}

TYPED_TEST(RaysTest, RaysPastTheFreeEdgeMiss)
{
  // A bowed slave over the rim: its rays fan out, some pass the edge
  using F = TypeParam;
  const Scene scene(
      make_surface(
          {F::shape, F::degree, F::node_degree, 4, true},
          graph(1, [](double x, double y) { return -0.3 * (x * x + y * y); })),
      make_surface({F::shape, F::degree, F::node_degree, 3, false},
                   plate(1, 0.5)),
      {2, 1});
  EXPECT_GT(scene.count(RayStatus::hit), 0u);
  EXPECT_EQ(scene.count(RayStatus::hit) + scene.count(RayStatus::no_facet),
            scene.points.size());
  EXPECT_LT(worst_residual<F>(scene), 4e-15);
}

TYPED_TEST(RaysTest, ThinPlateIsHitOnItsNearSide)
{
  // G-17: both sides in the group, from 1e-3 to 1e-9 apart
  using F = TypeParam;
  const Grid down{F::shape, F::degree, F::node_degree, 3, false};
  const Grid up{F::shape, F::degree, F::node_degree, 5, true};
  for (const double thickness : {1e-3, 1e-6, 1e-9})
    for (const double gap : {0.05, 0.0, -0.05})
    {
      const Surface near = make_surface(down, plate(1, gap));
      const Scene scene(
          make_surface({F::shape, F::degree, F::node_degree, 4, true},
                       plate(0.9, 0)),
          joined(make_surface(up, plate(1, gap + thickness)), near),
          {0.2, 0.2});
      EXPECT_EQ(scene.count(RayStatus::hit), scene.points.size());
      EXPECT_NEAR(total(scene.points.covered), total(scene.points.whole),
                  1e-12);
      for (const double g : scene.hits.gap)
        ASSERT_NEAR(g, gap, 1e-14);
    }
}
