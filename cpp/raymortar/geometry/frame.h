// Position, tangents and normal of a facet at one point.
#pragma once

#include "raymortar/geometry/reference.h"
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace raymortar
{
/// @brief Un-normalised normal from the tangents (columns).
///
/// 3D: t_1 x t_2; 2D: the tangent turned by -90 degrees. Facets are oriented
/// so that it points out of the body. |m| is the surface Jacobian.
[[nodiscard]] inline Vec<2> normal_of(const Mat<2, 1>& t)
{
  return {t(1, 0), -t(0, 0)};
}
[[nodiscard]] inline Vec<3> normal_of(const Mat<3, 2>& t)
{
  return t.col(0).cross(t.col(1));
}

/// @brief Geometry of a facet at one point xi.
template <int D>
struct Frame
{
  Vec<D> x;        ///< position, length
  Mat<D, D - 1> t; ///< tangents dx/dxi as columns
  Vec<D> n;        ///< outward unit normal
  double jacobian; ///< |m|, area per reference area
};

/// @brief Frame at xi of the facet with the given nodes.
/// @param[in] nodes Node positions as columns, (gdim, nodes)
/// @param[in] xi Reference coordinates
template <class F>
[[nodiscard]] inline Frame<F::gdim>
frame_at(const typename F::NodeMatrix& nodes, const typename F::RefPoint& xi)
{
  Frame<F::gdim> f;
  f.x.noalias() = nodes * F::Node::values(xi);
  f.t.noalias() = nodes * F::Node::gradients(xi);
  const Vec<F::gdim> m = normal_of(f.t);
  f.jacobian = m.norm();
  f.n = m / f.jacobian;
  return f;
}

/// @brief Dual basis of the tangents within the tangent plane (columns).
///
/// With it the variation of the unit normal is rank one per node:
/// dn = - sum_a G_a (n . du_a), G_a = dual * dN_a/dxi  [theory (2.5)].
template <int D>
[[nodiscard]] inline Mat<D, D - 1> dual_tangents(const Mat<D, D - 1>& t)
{
  const Mat<D - 1, D - 1> metric = t.transpose() * t;
  return t * metric.inverse();
}

/// @brief Largest distance between two corner nodes of a facet. Length.
template <class F>
[[nodiscard]] inline double diameter(const typename F::NodeMatrix& nodes)
{
  double d2 = 0.0;
  for (int i = 0; i < F::Ref::corners; ++i)
    for (int j = 0; j < i; ++j)
      d2 = std::max(d2, (nodes.col(i) - nodes.col(j)).squaredNorm());
  return std::sqrt(d2);
}
} // namespace raymortar
