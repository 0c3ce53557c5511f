// Work of forces at the end of an arm along the slave's normal, which turns.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar
{
/// @brief Add the residual of - f . dn [theory (2.5)].
/// @param[in] G Surface gradients of the slave's shape functions, (gdim, dofs)
/// @param[in] n Slave's normal
/// @param[in] f Force times the length of its arm
/// @param[in,out] b Residual; the slave's dofs come first
template <int D, class Gradients, class Vector>
void add_turning(const Gradients& G, const Vec<D>& n, const Vec<D>& f,
                 Vector& b)
{
  for (Eigen::Index a = 0; a < G.cols(); ++a)
    b.template segment<D>(a * D) += G.col(a).dot(f) * n;
}

/// @brief Add its tangent with f held, the second variation of - f . n [theory
/// (4.19)].
/// @param[in,out] A Tangent, row-major; the slave's dofs come first
template <int D, class Gradients, class Matrix>
void add_turning_tangent(const Gradients& G, const Vec<D>& n, const Vec<D>& f,
                         Matrix& A)
{
  const double f_n = dot<D>(f, n);
  const int nodes = static_cast<int>(G.cols());
  const auto stride = static_cast<int>(A.cols());
  std::array<double, 9> by_f; // G_a . f
  for (int a = 0; a < nodes; ++a)
  {
    by_f[static_cast<std::size_t>(a)] = 0.0;
    for (int i = 0; i < D; ++i)
      by_f[static_cast<std::size_t>(a)] += G(i, a) * f[i];
  }
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < nodes; ++b)
    {
      const double f_a = by_f[static_cast<std::size_t>(a)];
      const double f_b = by_f[static_cast<std::size_t>(b)];
      double metric = 0.0;
      for (int i = 0; i < D; ++i)
        metric += G(i, a) * G(i, b);
      for (int i = 0; i < D; ++i)
      {
        double* const to = A.data() + (a * D + i) * stride + b * D;
        const double along = f_n * metric * n[i] - f_a * G(i, b);
        for (int j = 0; j < D; ++j)
          to[j] += along * n[j] - f_b * n[i] * G(j, a);
      }
    }
}

/// @brief Derivative of what multiplies the gradients of shape functions in - f
/// . dn, with f and n held, by each tangent  [theory (4.19)].
/// @param[in] dual Of the tangents
template <int D>
[[nodiscard]] std::array<Mat<D - 1, D>, static_cast<std::size_t>(D - 1)>
turned_by(const Mat<D, D - 1>& dual, const Vec<D>& n, const Vec<D>& f)
{
  const Mat<D - 1, D - 1> metric = dual.transpose() * dual;
  const Vec<D - 1> along = dual.transpose() * f;
  std::array<Mat<D - 1, D>, static_cast<std::size_t>(D - 1)> rows;
  for (int j = 0; j < D - 1; ++j)
    rows[static_cast<std::size_t>(j)] =
        dot<D>(f, n) * column(metric, j) * n.transpose() -
        along[j] * Mat<D - 1, D>(dual.transpose());
  return rows;
}

/// @brief How that changes along a facet.
/// @param[in] taylor Its Taylor coefficients
template <int D, class Taylor>
[[nodiscard]] Mat<D - 1, D - 1> along_facet(
    const std::array<Mat<D - 1, D>, static_cast<std::size_t>(D - 1)>& turned,
    const Taylor& taylor)
{
  Mat<D - 1, D - 1> rates = Mat<D - 1, D - 1>::Zero();
  for (int j = 0; j < D - 1; ++j)
    for (int k = 0; k < D - 1; ++k)
      set_column(rates, k,
                 column(rates, k) + turned[static_cast<std::size_t>(j)] *
                                        Vec<D>(taylor.col(D + j + k)));
  return rates;
}
} // namespace raymortar
