// Derivatives of tangents, normal and area of a facet along the facet.
#pragma once

#include "raymortar/geometry/frame.h"

namespace raymortar
{
/// @brief Second derivatives of the shape functions: column k belongs to
/// (xi_1, xi_1), (xi_1, xi_2), (xi_2, xi_2) in turn; intervals have the first.
template <Shape S, int K>
struct SecondGradients
{
  static constexpr int nodes = Lagrange<S, K>::nodes;
  [[nodiscard]] static Mat<nodes, 3> at(const Vec<2>&)
  {
    Mat<nodes, 3> d = Mat<nodes, 3>::Zero();
    if constexpr (K == 2)
      d << 4.0, 4.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 4.0, 0.0, 0.0,
          -4.0, -8.0, -8.0, -4.0, 0.0;
    return d;
  }
};

template <int K>
struct SecondGradients<Shape::interval, K>
{
  [[nodiscard]] static Mat<K + 1, 1> at(const Vec<1>&)
  {
    if constexpr (K == 2)
      return Mat<3, 1>(4.0, 4.0, -8.0);
    else
      return Mat<2, 1>::Zero();
  }
};

template <int K>
struct SecondGradients<Shape::quadrilateral, K>
{
  using Line = Lagrange<Shape::interval, K>;
  using Bend = SecondGradients<Shape::interval, K>;
  static constexpr int nodes = Lagrange<Shape::quadrilateral, K>::nodes;
  [[nodiscard]] static Mat<nodes, 3> at(const Vec<2>& xi)
  {
    const Vec<1> s(xi[0]), t(xi[1]);
    const Vec<K + 1> a = Line::values(s), b = Line::values(t);
    const Vec<K + 1> da = Line::gradients(s), db = Line::gradients(t);
    const Vec<K + 1> dda = Bend::at(s), ddb = Bend::at(t);
    Mat<nodes, 3> d;
    for (int i = 0; i < nodes; ++i)
    {
      const auto [p, q] = Lagrange<Shape::quadrilateral, K>::factors[i];
      d.row(i) << dda[p] * b[q], da[p] * db[q], a[p] * ddb[q];
    }
    return d;
  }
};

/// @brief Derivatives of a frame along its facet.
template <int D>
struct Curvature
{
  std::array<Mat<D, D - 1>, D - 1> t; ///< of the tangents, by xi_j: t[j]
  Mat<D, D - 1> n;                    ///< of the unit normal
  Vec<D - 1> log_jacobian;            ///< of log |m|
};

/// @brief Second derivatives of the shape functions of positions.
template <class F>
using NodeBends = Mat<F::nodes, F::tdim == 1 ? 1 : 3>;

template <class F>
[[nodiscard]] NodeBends<F> node_bends(const typename F::RefPoint& xi)
{
  if constexpr (F::affine)
    return NodeBends<F>::Zero();
  else
    return F::SecondOfNode::at(xi);
}

/// @brief Curvature of a facet with constant tangents.
template <int D>
[[nodiscard]] Curvature<D> no_curvature()
{
  Curvature<D> c;
  c.t.fill(Mat<D, D - 1>::Zero());
  c.n.setZero();
  c.log_jacobian.setZero();
  return c;
}

/// @brief Curvature of a facet at a point, where its frame and the dual basis
/// of its tangents are known.
///
/// With dt_i = x_,ij the normal's and the area's variations  [theory (2.4),
/// (2.5)] hold as they are: n_,j = - sum_i t^i (n . x_,ij).
/// @param[in] second Derivatives of the position, as in SecondGradients
template <int D>
[[nodiscard]] Curvature<D> curvature_from(const Mat<D, D == 2 ? 1 : 3>& second,
                                          const Frame<D>& frame,
                                          const Mat<D, D - 1>& dual)
{
  Curvature<D> c;
  for (int j = 0; j < D - 1; ++j)
  {
    Mat<D, D - 1>& dt = c.t[static_cast<std::size_t>(j)];
    for (int i = 0; i < D - 1; ++i)
      set_column(dt, i, column(second, i + j));
    set_column(c.n, j, dual * -(dt.transpose() * frame.n));
    c.log_jacobian[j] = dual.cwiseProduct(dt).sum();
  }
  return c;
}

template <class F>
[[nodiscard]] Curvature<F::gdim>
curvature_at(const typename F::NodeMatrix& nodes, const NodeBends<F>& bends,
             const Frame<F::gdim>& frame, const Mat<F::gdim, F::tdim>& dual)
{
  if constexpr (F::affine)
    return no_curvature<F::gdim>();
  else
    return curvature_from<F::gdim>(nodes * bends, frame, dual);
}

template <class F>
[[nodiscard]] Curvature<F::gdim>
curvature_at(const typename F::NodeMatrix& nodes,
             const typename F::RefPoint& xi, const Frame<F::gdim>& frame,
             const Mat<F::gdim, F::tdim>& dual)
{
  return curvature_at<F>(nodes, node_bends<F>(xi), frame, dual);
}

template <class F>
[[nodiscard]] Curvature<F::gdim>
curvature_at(const typename F::NodeMatrix& nodes,
             const typename F::RefPoint& xi, const Frame<F::gdim>& frame)
{
  return curvature_at<F>(nodes, xi, frame, dual_tangents<F::gdim>(frame));
}
} // namespace raymortar
