#include "differences.h"
#include "facet_types.h"
#include "raymortar/geometry/frame.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class FrameTest : public testing::Test
{
};

/// Nodes of a facet as one vector, and back
template <class F>
Eigen::VectorXd flat(const typename F::NodeMatrix& nodes)
{
  return Eigen::Map<const Eigen::VectorXd>(nodes.data(), nodes.size());
}
template <class F>
typename F::NodeMatrix unflat(const Eigen::VectorXd& x)
{
  return Eigen::Map<const typename F::NodeMatrix>(x.data());
}
} // namespace

TYPED_TEST_SUITE(FrameTest, AllFacets, );

TYPED_TEST(FrameTest, NormalPointsOutOfTheBodyBelow)
{
  // In 2D the tangent is turned clockwise, in 3D corners go counter-clockwise
  using F = TypeParam;
  std::mt19937 random(1);
  const auto nodes = random_nodes<F>(random, 0);
  for (int trial = 0; trial < 20; ++trial)
  {
    const auto frame = frame_at<F>(nodes, random_inside<F>(random));
    const double side = F::gdim == 2 ? -1 : 1;
    EXPECT_NEAR(frame.n[F::gdim - 1], side, 1e-15);
    EXPECT_NEAR(frame.jacobian, 1, 3e-15);
  }
}

TYPED_TEST(FrameTest, NormalIsOrthogonalToTheTangentsAndDualToNone)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial)
  {
    const auto nodes = random_nodes<F>(random, 0.1);
    const auto frame = frame_at<F>(nodes, random_inside<F>(random));
    EXPECT_NEAR(frame.n.norm(), 1, 4e-16);
    EXPECT_LT((frame.t.transpose() * frame.n).cwiseAbs().maxCoeff(), 1e-15);
    const Mat<D, D - 1> dual = dual_tangents<D>(frame.t);
    EXPECT_LE((dual_tangents<D>(frame) - dual).norm(), 1e-13 * dual.norm());
    EXPECT_LT((dual.transpose() * frame.n).cwiseAbs().maxCoeff(), 2e-15);
    const Mat<D - 1, D - 1> one = dual.transpose() * frame.t;
    EXPECT_LT((one - Mat<D - 1, D - 1>::Identity()).cwiseAbs().maxCoeff(),
              4e-15);
  }
}

TYPED_TEST(FrameTest, TangentsAreTheDerivativesOfThePosition)
{
  using F = TypeParam;
  std::mt19937 random(3);
  const auto nodes = random_nodes<F>(random, 0.1);
  const auto xi = random_inside<F>(random);
  expect_derivative([&](const Eigen::VectorXd& at) -> Eigen::VectorXd
                    { return frame_at<F>(nodes, at).x; },
                    xi, frame_at<F>(nodes, xi).t);
}

TYPED_TEST(FrameTest, NormalAndAreaVaryByTheSurfaceGradients)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  std::mt19937 random(4);
  for (int trial = 0; trial < 10; ++trial)
  {
    const auto nodes = random_nodes<F>(random, 0.1);
    const auto xi = random_inside<F>(random);
    const auto frame = frame_at<F>(nodes, xi);
    const Mat<D, F::nodes> G =
        dual_tangents<D>(frame.t) * F::Node::gradients(xi).transpose();
    Eigen::MatrixXd dn(D, D * F::nodes), darea(1, D * F::nodes);
    for (int a = 0; a < F::nodes; ++a)
    {
      dn.middleCols(D * a, D) = -G.col(a) * frame.n.transpose();
      darea.middleCols(D * a, D) = frame.jacobian * G.col(a).transpose();
    }
    expect_derivative([&](const Eigen::VectorXd& x) -> Eigen::VectorXd
                      { return frame_at<F>(unflat<F>(x), xi).n; },
                      flat<F>(nodes), dn);
    expect_derivative(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd
        { return Vec<1>(frame_at<F>(unflat<F>(x), xi).jacobian); },
        flat<F>(nodes), darea);
  }
}

TYPED_TEST(FrameTest, DiameterSpansTheCornersAtAnyScale)
{
  using F = TypeParam;
  std::mt19937 random(5);
  const auto nodes = random_nodes<F>(random, 0);
  const double expected = F::gdim == 2 ? 1 : std::sqrt(2);
  for (const double scale : {1e-9, 1.0, 1e6})
    EXPECT_NEAR(diameter<F>(scale * nodes), scale * expected, 1e-15 * scale);
}

TYPED_TEST(FrameTest, TurningTheFacetTurnsTheNormal)
{
  using F = TypeParam;
  std::mt19937 random(6);
  for (int trial = 0; trial < 50; ++trial)
  {
    Mat<F::gdim, F::gdim> turn;
    if constexpr (F::gdim == 2)
      turn = Eigen::Rotation2Dd(0.1 * trial).toRotationMatrix();
    else
      turn = Eigen::AngleAxisd(0.1 * trial,
                               random_vector<3>(random, 1).normalized())
                 .toRotationMatrix();
    const auto nodes = random_nodes<F>(random, 0.1);
    const auto xi = random_inside<F>(random);
    const auto moved = frame_at<F>(turn * nodes, xi);
    const auto frame = frame_at<F>(nodes, xi);
    EXPECT_LT((moved.n - turn * frame.n).norm(), 3e-15);
    EXPECT_NEAR(moved.jacobian, frame.jacobian, 3e-15);
  }
}
