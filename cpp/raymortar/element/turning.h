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
/// @param[in,out] A Tangent; the slave's dofs come first
template <int D, class Gradients, class Matrix>
void add_turning_tangent(const Gradients& G, const Vec<D>& n, const Vec<D>& f,
                         Matrix& A)
{
  constexpr int nodes = Gradients::ColsAtCompileTime;
  constexpr int side = nodes == Eigen::Dynamic ? nodes : D * nodes;
  using Rows = Eigen::Matrix<double, D, side, Eigen::RowMajor>;
  const double f_n = f.dot(n);
  const Eigen::Index size = D * G.cols();
  Rows turn(D, size), held(D, size); // - dn; what G_a . f varies with
  for (Eigen::Index b = 0; b < G.cols(); ++b)
  {
    const Vec<D> G_b = G.col(b);
    const Mat<D, D> turn_b = G_b * n.transpose();
    turn.template middleCols<D>(b * D) = turn_b;
    held.template middleCols<D>(b * D) =
        f_n * turn_b - f.dot(G_b) * Mat<D, D>::Identity();
  }
  for (Eigen::Index a = 0; a < G.cols(); ++a)
  {
    const Vec<D> G_a = G.col(a);
    const double f_a = f.dot(G_a);
    Eigen::Matrix<double, 1, side> row = G_a[0] * held.row(0);
    for (int i = 1; i < D; ++i)
      row += G_a[i] * held.row(i);
    for (int i = 0; i < D; ++i)
      A.row(a * D + i).segment(0, size) += n[i] * row - f_a * turn.row(i);
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
        f.dot(n) * metric.col(j) * n.transpose() - along[j] * dual.transpose();
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
      rates.col(k) +=
          turned[static_cast<std::size_t>(j)] * taylor.col(D + j + k);
  return rates;
}
} // namespace raymortar
