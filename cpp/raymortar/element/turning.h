// Work of forces at the end of an arm along the slave's normal, which turns.
#pragma once

#include "raymortar/core/types.h"

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
} // namespace raymortar
