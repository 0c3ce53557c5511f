// Derivatives against central differences, by the slope of the error.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <gtest/gtest.h>

namespace raymortar::test
{
using Function = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// Largest deviation of J from the central difference of f with a step
inline double difference_error(const Function& f, const Eigen::VectorXd& x,
                               const Eigen::MatrixXd& J, double step)
{
  double worst = 0;
  for (Eigen::Index j = 0; j < x.size(); ++j)
  {
    Eigen::VectorXd ahead = x, behind = x;
    ahead[j] += step;
    behind[j] -= step;
    const Eigen::VectorXd slope = (f(ahead) - f(behind)) / (2 * step);
    worst = std::max(worst, (slope - J.col(j)).cwiseAbs().maxCoeff());
  }
  return worst;
}

/// The error must fall with the square of the step, down to rounding
inline void expect_derivative(const Function& f, const Eigen::VectorXd& x,
                              const Eigen::MatrixXd& J, double step = 1e-2)
{
  ASSERT_EQ(J.cols(), x.size());
  const double scale = std::max(1.0, J.cwiseAbs().maxCoeff());
  const double first = difference_error(f, x, J, step);
  const double second = difference_error(f, x, J, step / 10);
  EXPECT_LT(second, std::max(std::pow(10, -1.9) * first, 2e-11 * scale))
      << "from " << first;
}
} // namespace raymortar::test
