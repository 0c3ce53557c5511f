// Derivatives against central differences, by the slope of their error. Defined
// in a file of its own: what Eigen needs for it takes each test seconds to
// compile.
#pragma once

#include "raymortar/core/types.h"
#include <functional>
#include <gtest/gtest.h>
#include <random>

namespace raymortar::test
{
using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

using Function = std::function<Vector(const Vector&)>;

/// J is f': the error of central differences falls with h^2, or is rounding
void expect_derivative(const Function& f, const Vector& x, const Matrix& J);

/// J is the one-sided derivative of f at x along d: first order in h
void expect_one_sided(const Function& f, const Vector& x, const Vector& d,
                      const Matrix& J);

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
  Mat<D, D> rotation();

private:
  std::mt19937 _engine;
  std::normal_distribution<double> _normal;
};

extern template Mat<2, 2> Random::rotation<2>();
extern template Mat<3, 3> Random::rotation<3>();
} // namespace raymortar::test
