#include "differences.h"
#include "facet_types.h"
#include "raymortar/geometry/curvature.h"

using namespace raymortar;
using namespace raymortar::test;

template <class F>
class CurvatureTest : public testing::Test
{
};
TYPED_TEST_SUITE(CurvatureTest, AllFacets, );

TYPED_TEST(CurvatureTest, IsTheDerivativeOfTheFrame)
{
  using F = TypeParam;
  std::mt19937 random(1);
  for (int trial = 0; trial < 5; ++trial)
  {
    const auto nodes = random_nodes<F>(random, 0.1);
    const auto xi = random_inside<F>(random);
    const auto c = curvature_at<F>(nodes, xi, frame_at<F>(nodes, xi));
    for (int i = 0; i < F::tdim; ++i)
    {
      Eigen::MatrixXd by_xi(F::gdim, F::tdim);
      for (int j = 0; j < F::tdim; ++j)
        by_xi.col(j) = c.t[static_cast<std::size_t>(j)].col(i);
      expect_derivative([&](const Eigen::VectorXd& at) -> Eigen::VectorXd
                        { return frame_at<F>(nodes, at).t.col(i); },
                        xi, by_xi);
    }
    expect_derivative([&](const Eigen::VectorXd& at) -> Eigen::VectorXd
                      { return frame_at<F>(nodes, at).n; },
                      xi, c.n);
    expect_derivative(
        [&](const Eigen::VectorXd& at) -> Eigen::VectorXd
        { return Vec<1>(std::log(frame_at<F>(nodes, at).jacobian)); },
        xi, c.log_jacobian.transpose());
  }
}
