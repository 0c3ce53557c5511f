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
  const double f_n = f.dot(n);
  for (Eigen::Index a = 0; a < G.cols(); ++a)
  {
    const Vec<D> G_a = G.col(a);
    const double f_a = f.dot(G_a);
    for (Eigen::Index b = 0; b < G.cols(); ++b)
    {
      const Vec<D> G_b = G.col(b);
      const Vec<D> across = f_n * G_a.dot(G_b) * n - f.dot(G_b) * G_a;
      A.template block<D, D>(a * D, b * D) +=
          n * across.transpose() - f_a * G_b * n.transpose();
    }
  }
}
} // namespace raymortar
