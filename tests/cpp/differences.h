// Derivatives against central differences, by the slope of their error.
#pragma once

#include "raymortar/core/types.h"
#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>
#include <random>

namespace raymortar::test
{
using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// Central differences of f at x, one column per component
template <class Function>
Matrix central(const Function& f, const Vector& x, double h)
{
  Matrix J(f(x).size(), x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j)
  {
    const Vector e = h * Vector::Unit(x.size(), j);
    J.col(j) = (f(x + e) - f(x - e)) / (2.0 * h);
  }
  return J;
}

/// J is f': the error of central differences falls with h^2, or is rounding
template <class Function>
void expect_derivative(const Function& f, const Vector& x, const Matrix& J)
{
  ASSERT_TRUE(J.allFinite());
  const double scale = std::max(1.0, J.cwiseAbs().maxCoeff());
  const double coarse = (central(f, x, 1e-3) - J).cwiseAbs().maxCoeff();
  const double fine = (central(f, x, 1e-4) - J).cwiseAbs().maxCoeff();
  EXPECT_LE(fine, 1e-5 * scale);
  if (coarse > 1e-8 * scale)
  {
    EXPECT_NEAR(std::log10(coarse / fine), 2.0, 0.1);
  }
}

/// J is the one-sided derivative of f at x along d: first order in h
template <class Function>
void expect_one_sided(const Function& f, const Vector& x, const Vector& d,
                      const Matrix& J)
{
  const double h = 1e-6;
  const Vector change = (f(x + h * d) - f(x)) / h;
  EXPECT_LE((change - J * d).cwiseAbs().maxCoeff(), 1e-4);
}

/// Seeded random vectors and rotations
class Random
{
public:
  explicit Random(unsigned seed) : _engine(seed) {}

  template <int D>
  Vec<D> vector()
  {
    Vec<D> v;
    for (int i = 0; i < D; ++i)
      v[i] = _normal(_engine);
    return v;
  }

  template <int D>
  Vec<D> unit()
  {
    return vector<D>().normalized();
  }

  template <int D>
  Mat<D, D> rotation()
  {
    Mat<D, D> A;
    for (int i = 0; i < D; ++i)
      A.col(i) = vector<D>();
    Mat<D, D> Q = Eigen::HouseholderQR<Mat<D, D>>(A).householderQ();
    Q.col(0) *= Q.determinant();
    return Q;
  }

private:
  std::mt19937 _engine;
  std::normal_distribution<double> _normal;
};
} // namespace raymortar::test
