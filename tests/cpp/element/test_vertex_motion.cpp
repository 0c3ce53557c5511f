#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/vertex_motion.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Nodes of both facets moved by u, [slave | master]
template <class F>
std::array<typename F::NodeMatrix, 2>
moved(const typename F::NodeMatrix& slave, const typename F::NodeMatrix& master,
      const Vector& u)
{
  using Nodes = Eigen::Map<const typename F::NodeMatrix>;
  return {slave + Nodes(u.data()), master + Nodes(u.data() + slave.size())};
}

/// A master over a random slave facet, turned about its normal
template <class F>
typename F::NodeMatrix random_master(std::mt19937& random)
{
  Mat<F::gdim, F::gdim> turn = Mat<F::gdim, F::gdim>::Identity();
  if constexpr (F::gdim == 3)
    turn = Eigen::AngleAxisd(0.6, Vec<3>::UnitZ()).toRotationMatrix();
  typename F::NodeMatrix master = turn * random_nodes<F>(random, 0.05);
  master.row(0).array() += 0.4;
  master.row(F::gdim - 1).array() += F::gdim == 2 ? -0.1 : 0.1;
  return master;
}
} // namespace

template <class F>
class VertexMotionTest : public testing::Test
{
};
TYPED_TEST_SUITE(VertexMotionTest, AllFacets, );

TYPED_TEST(VertexMotionTest, VertexUnderACornerMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(1);
  for (int trial = 0; trial < 5; ++trial)
  {
    const auto slave = random_nodes<F>(random, 0.05);
    const auto master = random_master<F>(random);
    typename F::RefPoint xi = master.col(0).template head<F::tdim>();
    ASSERT_TRUE(ray_through<F>(slave, master.col(0), xi));
    Break under;
    under.motion = Break::Motion::corner;
    const auto f = [&](const Vector& u) -> Vector
    {
      const auto [s, m] = moved<F>(slave, master, u);
      typename F::RefPoint at = xi;
      EXPECT_TRUE(ray_through<F>(s, m.col(0), at));
      return at;
    };
    expect_derivative(f, Vector::Zero(2 * slave.size()),
                      vertex_motion<F>(slave, master, xi, under));
  }
}

template <class F>
class CrossingMotionTest : public testing::Test
{
};
using Polygons = testing::Types<Triangle1, Triangle2, Quad1, Quad2>;
TYPED_TEST_SUITE(CrossingMotionTest, Polygons, );

TYPED_TEST(CrossingMotionTest, CrossingOfEdgesMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(2);
  for (int trial = 0; trial < 5; ++trial)
  {
    const auto slave = random_nodes<F>(random, 0.05);
    typename F::NodeMatrix master = random_master<F>(random);
    // The slave's edge along the first axis, the master's along the second
    const ReferenceEdge<F> edge_s{{0, 0}, {1, 0}}, edge_m{{0, 0}, {0, 1}};
    double s = 0.4, t = 0.3;
    // Put it where the edges cross, a little off the start
    const auto frame = frame_at<F>(slave, edge_s.at(s + 0.01));
    master.colwise() += (frame.x + 0.1 * frame.n -
                         master * F::Node::values(edge_m.at(t - 0.01)))
                            .eval();
    ASSERT_TRUE(cross_edges<F>(slave, edge_s, master, edge_m, s, t));
    EXPECT_NEAR(s, 0.41, 1e-9);
    EXPECT_NEAR(t, 0.29, 1e-9);
    const Break at{Break::Motion::crossing, edge_m.at(t), edge_s.along,
                   edge_m.along};
    const auto f = [&](const Vector& u) -> Vector
    {
      const auto [x, y] = moved<F>(slave, master, u);
      double s_u = s, t_u = t;
      EXPECT_TRUE(cross_edges<F>(x, edge_s, y, edge_m, s_u, t_u));
      return edge_s.at(s_u);
    };
    expect_derivative(f, Vector::Zero(2 * slave.size()),
                      vertex_motion<F>(slave, master, edge_s.at(s), at));
  }
}
