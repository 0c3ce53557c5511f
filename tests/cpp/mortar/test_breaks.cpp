#include "facet_types.h"
#include "raymortar/mortar/breaks.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Distance of a point from the ray of a slave point
template <class F>
double miss(const typename F::NodeMatrix& slave, const typename F::RefPoint& xi,
            const typename F::Point& x)
{
  const auto f = frame_at<F>(slave, xi);
  const typename F::Point d = x - f.x;
  return (d - d.dot(f.n) * f.n).norm();
}

/// Edge between two points on the rim of the reference facet
template <class F>
ReferenceEdge<F::tdim> rim_edge(int e)
{
  const auto& cycle = F::Ref::cycle;
  const auto corner = [&](int k)
  {
    const auto node = static_cast<std::size_t>(
        cycle[static_cast<std::size_t>(k % F::Ref::corners)]);
    return typename F::RefPoint(F::Node::points[node].data());
  };
  return {corner(e), corner(e + 1) - corner(e)};
}
} // namespace

template <class F>
class BreaksTest : public testing::Test
{
};
TYPED_TEST_SUITE(BreaksTest, AllFacets, );

TYPED_TEST(BreaksTest, RayFromTheFoundPointPassesThroughTheNode)
{
  using F = TypeParam;
  std::mt19937 random(1);
  for (const double offset : {0.0, 1e3})
    for (int trial = 0; trial < 200; ++trial)
    {
      auto nodes = random_nodes<F>(random, 0.05);
      nodes.array() += offset;
      const auto exact = random_inside<F>(random);
      const auto f = frame_at<F>(nodes, exact);
      for (const double g : {-0.3, 0.0, 0.2})
      {
        typename F::RefPoint xi = exact + random_vector<F::tdim>(random, 0.05);
        ASSERT_TRUE(ray_through<F>(nodes, f.x + g * f.n, xi));
        ASSERT_LT((xi - exact).norm(), 1e-14 * (10 + offset));
      }
    }
}

TYPED_TEST(BreaksTest, PointsFarFromTheFacetLeaveTheGuess)
{
  using F = TypeParam;
  std::mt19937 random(2);
  const auto nodes = random_nodes<F>(random, 0.02);
  typename F::Point far = nodes.col(0);
  const typename F::RefPoint start = random_inside<F>(random);
  for (const double x : {-0.3, 3.0, 1e6, double(NAN)})
  {
    far[0] = x;
    typename F::RefPoint xi = start;
    EXPECT_FALSE(ray_through<F>(nodes, far, xi));
    EXPECT_EQ(xi, start);
  }
}

template <class F>
class CrossingsTest : public testing::Test
{
};
using Polygons = testing::Types<Triangle1, Triangle2, Quad1, Quad2>;
TYPED_TEST_SUITE(CrossingsTest, Polygons, );

TYPED_TEST(CrossingsTest, RayFromTheSlaveEdgeMeetsTheMasterEdge)
{
  using F = TypeParam;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.1, 0.9), move(-0.04, 0.04);
  int found = 0;
  for (int trial = 0; trial < 300; ++trial)
  {
    const auto slave = random_nodes<F>(random, 0.04);
    const auto edge_s = rim_edge<F>(trial % F::Ref::edges);
    const auto edge_m = rim_edge<F>(trial % 2);
    // A master whose edge crosses the slave's at s, t over a gap
    const double s = unit(random), t = unit(random);
    const Mat<3, 3> turn =
        Eigen::AngleAxisd(0.5 + 0.02 * trial, Vec<3>::UnitZ())
            .toRotationMatrix();
    typename F::NodeMatrix master = turn * random_nodes<F>(random, 0.04);
    const auto f = frame_at<F>(slave, edge_s.at(s));
    const Vec<3> there = master * F::Node::values(edge_m.at(t));
    master.colwise() += f.x + 0.1 * f.n - there;
    double at_s = s + move(random), at_t = t + move(random);
    const double start_s = at_s, start_t = at_t;
    if (not cross_edges<F, F>(slave, edge_s, master, edge_m, at_s, at_t))
    {
      // Edges that nearly run along each other
      EXPECT_EQ(at_s, start_s);
      EXPECT_EQ(at_t, start_t);
      continue;
    }
    ++found;
    ASSERT_NEAR(at_s, s, 1e-12);
    ASSERT_NEAR(at_t, t, 1e-12);
    ASSERT_LT(miss<F>(slave, edge_s.at(at_s),
                      master * F::Node::values(edge_m.at(at_t))),
              1e-14);
    // The neighbour across the master's edge has it the other way round
    double back_s = start_s, back_t = 1 - start_t;
    ASSERT_TRUE((cross_edges<F, F>(slave, edge_s, master,
                                   {edge_m.begin + edge_m.along, -edge_m.along},
                                   back_s, back_t)));
    ASSERT_NEAR(back_s, s, 1e-12);
    ASSERT_NEAR(back_t, 1 - t, 1e-12);
  }
  EXPECT_GT(found, 250);
}

TYPED_TEST(CrossingsTest, EdgesThatRunAlongEachOtherHaveNoCrossing)
{
  using F = TypeParam;
  const auto edge = rim_edge<F>(0);
  std::mt19937 random(4);
  const auto nodes = random_nodes<F>(random, 0);
  for (const double gap : {0.0, 0.1})
  {
    typename F::NodeMatrix master = nodes;
    master.row(2).array() += gap;
    double s = 0.3, t = 0.3;
    EXPECT_FALSE((cross_edges<F, F>(nodes, edge, master, edge, s, t)));
  }
}
