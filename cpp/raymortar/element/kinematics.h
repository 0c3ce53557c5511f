// Variations of gap, normal and master point with respect to element dofs.
#pragma once

#include "raymortar/geometry/frame.h"

namespace raymortar
{
/// @brief First variations at one integration point, as rows over the
/// element's displacement dofs [slave | master], node-major.
///
/// With G_a the surface gradient of the slave shape function N_a, and
/// [T, n]^-1 giving rho and b   [theory (2.5)-(2.8)]:
///   dn   = - sum_a G_a (n . du_a)
///   dg   = b . (du_m - du_s - g dn)
///   deta = rho (du_s - du_m + g dn)
template <class F>
struct Variations
{
  static constexpr int D = F::gdim;
  static constexpr int side = F::dofs * D;
  Mat<D, side> dn; ///< slave dofs only
  Mat<1, 2 * side> dg;
  Mat<D - 1, 2 * side> deta;
  Mat<1, side> dlog_area; ///< d|m| / |m|, slave dofs only
};

/// @brief What a point needs of shape functions and frames.
template <class F>
struct PointGeometry
{
  Frame<F::gdim> slave;
  Vec<F::dofs> N_s;           ///< slave shape functions at xi
  Mat<F::gdim, F::dofs> G_s;  ///< their surface gradients, 1/length
  Vec<F::dofs> N_m;           ///< master shape functions at eta
  Mat<F::dofs, F::tdim> dN_m; ///< their gradients in eta
  Mat<F::gdim, F::tdim> T;    ///< master tangents dx_m/deta
};

template <class F>
[[nodiscard]] PointGeometry<F>
slave_geometry(const typename F::NodeMatrix& slave,
               const typename F::RefPoint& xi)
{
  PointGeometry<F> p;
  p.slave = frame_at<F>(slave, xi);
  p.N_s = F::Disp::values(xi);
  p.G_s =
      dual_tangents<F::gdim>(p.slave.t) * F::Disp::gradients(xi).transpose();
  return p;
}

template <class F>
void add_master_geometry(PointGeometry<F>& p,
                         const typename F::NodeMatrix& master,
                         const typename F::RefPoint& eta)
{
  p.N_m = F::Disp::values(eta);
  p.dN_m = F::Disp::gradients(eta);
  p.T = master * F::Node::gradients(eta);
}

/// @brief Variations that need the slave alone: normal and area.
template <class F>
void vary_slave(const PointGeometry<F>& p, Variations<F>& v)
{
  constexpr int D = F::gdim;
  for (int a = 0; a < F::dofs; ++a)
  {
    v.dn.template middleCols<D>(a * D).noalias() =
        -p.G_s.col(a) * p.slave.n.transpose();
    v.dlog_area.template segment<D>(a * D) = p.G_s.col(a).transpose();
  }
}

/// @brief Variations of gap and master point; needs vary_slave before.
template <class F>
void vary_hit(const PointGeometry<F>& p, double g, Variations<F>& v)
{
  constexpr int D = F::gdim;
  constexpr int side = Variations<F>::side;
  Mat<D, D> A;
  A.template leftCols<D - 1>() = p.T;
  A.col(D - 1) = p.slave.n;
  // Rows rho (dual of T, orthogonal to n) and b (dual of n, orthogonal to T)
  const Mat<D, D> dual = A.inverse();
  // du_s - du_m + g dn, applied to rho and -b
  Mat<D, 2 * side> z;
  z.template leftCols<side>().noalias() = g * dual * v.dn;
  for (int a = 0; a < F::dofs; ++a)
  {
    z.template middleCols<D>(a * D) += p.N_s[a] * dual;
    z.template middleCols<D>(side + a * D) = -p.N_m[a] * dual;
  }
  v.deta = z.template topRows<D - 1>();
  v.dg = -z.row(D - 1);
}
} // namespace raymortar
