// Variations of gap, normal and master point with respect to element dofs.
#pragma once

#include "raymortar/geometry/frame.h"

namespace raymortar
{
/// @brief First variations of gap and master point, as rows over the
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
  Eigen::Matrix<double, 1, 2 * side, Eigen::RowMajor> dg;
  Eigen::Matrix<double, D - 1, 2 * side, Eigen::RowMajor> deta;
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

template <class F>
[[nodiscard]] Variations<F> vary_hit(const PointGeometry<F>& p, double g)
{
  constexpr int D = F::gdim;
  constexpr int side = Variations<F>::side;
  Mat<D, D> A;
  A.template leftCols<D - 1>() = p.T;
  A.col(D - 1) = p.slave.n;
  // Rows rho (dual of T, orthogonal to n) and b (dual of n, orthogonal to T)
  const Mat<D, D> dual = A.inverse();
  const Mat<D, F::dofs> turn = g * dual * p.G_s;
  // du_s - du_m + g dn, applied to rho and -b
  Eigen::Matrix<double, D, 2 * side, Eigen::RowMajor> z;
  for (int j = 0; j < D; ++j)
  {
    auto row = z.row(j);
    for (int a = 0; a < F::dofs; ++a)
    {
      row.template segment<D>(a * D) =
          p.N_s[a] * dual.row(j) - turn(j, a) * p.slave.n.transpose();
      row.template segment<D>(side + a * D) = -p.N_m[a] * dual.row(j);
    }
  }
  return {-z.row(D - 1), z.template topRows<D - 1>()};
}
} // namespace raymortar
