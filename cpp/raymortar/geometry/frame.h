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

/// @brief The matrix of b -> a x b.
[[nodiscard]] inline Mat<3, 3> cross_matrix(const Vec<3>& a)
{
  Mat<3, 3> m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
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

/// @brief Shape functions of positions at a point: several states of a facet
/// have frames there.
template <class F>
struct NodeShapes
{
  Vec<F::nodes> N;
  Mat<F::nodes, F::tdim> dN; ///< their gradients

  explicit NodeShapes(const typename F::RefPoint& xi)
      : N(F::Node::values(xi)), dN(F::Node::gradients(xi))
  {
  }

  /// @brief The displacement's at the same point; these, if it is of their
  /// degree.
  [[nodiscard]] Vec<F::dofs> displacement(const typename F::RefPoint& xi) const
  {
    if constexpr (F::degree == F::node_degree)
      return N;
    else
      return F::Disp::values(xi);
  }
};

/// @brief Tangents of the facet with the given nodes.
template <class F>
inline void set_tangents(Mat<F::gdim, F::tdim>& t,
                         const typename F::NodeMatrix& nodes,
                         const Mat<F::nodes, F::tdim>& dN)
{
  if constexpr (F::affine)
    // One by one: a load across two fresh stores would wait for both
    for (int j = 0; j < F::tdim; ++j)
      for (int i = 0; i < F::gdim; ++i)
        t(i, j) = nodes(i, j + 1) - nodes(i, 0);
  else
    t.noalias() = nodes * dN;
}

/// @brief Set normal and area of a frame from its tangents.
template <int D>
inline void set_normal(Frame<D>& f)
{
  const Vec<D> m = normal_of(f.t);
  f.jacobian = length<D>(m);
  f.n = m / f.jacobian;
}

/// @brief Frame of the facet with the given nodes.
/// @param[in] nodes Node positions as columns, (gdim, nodes)
template <class F>
[[nodiscard]] inline Frame<F::gdim>
frame_at(const typename F::NodeMatrix& nodes, const NodeShapes<F>& at)
{
  Frame<F::gdim> f;
  f.x.noalias() = nodes * at.N;
  set_tangents<F>(f.t, nodes, at.dN);
  set_normal(f);
  return f;
}

/// @brief The same where shape functions are used once: kept, they would be
/// stored one by one and loaded in pairs, which waits for the stores.
/// @param[in] xi Reference coordinates
template <class F>
[[nodiscard]] inline Frame<F::gdim>
frame_at(const typename F::NodeMatrix& nodes, const typename F::RefPoint& xi)
{
  Frame<F::gdim> f;
  f.x.noalias() = nodes * F::Node::values(xi);
  set_tangents<F>(f.t, nodes, F::Node::gradients(xi));
  set_normal(f);
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

/// @brief The same where the normal is known: nothing is inverted.
template <int D>
[[nodiscard]] inline Mat<D, D - 1> dual_tangents(const Frame<D>& f)
{
  Mat<D, D - 1> dual;
  if constexpr (D == 2)
    dual = f.t / (f.jacobian * f.jacobian);
  else
  {
    const double scale = 1.0 / f.jacobian;
    dual.col(0) = scale * f.t.col(1).cross(f.n);
    dual.col(1) = scale * f.n.cross(f.t.col(0));
  }
  return dual;
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
