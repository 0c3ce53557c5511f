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
/// The variations of gap and normal stay in factored form: see chain in
/// rates.h.
template <class F>
struct Variations
{
  static constexpr int D = F::gdim;
  static constexpr int side = F::dofs * D;
  double g;
  Eigen::Matrix<double, D - 1, 2 * side, Eigen::RowMajor> deta;
  /// Rows rho (dual of T, orthogonal to n) and b (dual of n, orthogonal to T)
  Mat<D, D> dual;
};

/// @brief Derivatives of R numbers by the displacement dofs of one side, stored
/// as rows of an element's tangent are.
template <class F, int R>
using SideRows = Eigen::Matrix<double, R, Variations<F>::side, Eigen::RowMajor>;

/// @brief What a point needs of shape functions and frames.
template <class F>
struct PointGeometry
{
  Frame<F::gdim> slave;
  Vec<F::dofs> N_s;           ///< slave shape functions at xi
  Mat<F::dofs, F::tdim> dN_s; ///< their gradients in xi
  Mat<F::gdim, F::tdim> dual; ///< of the slave's tangents, see dual_tangents
  Mat<F::gdim, F::dofs> G_s;  ///< their surface gradients, 1/length
  Vec<F::dofs> N_m;           ///< master shape functions at eta
  Mat<F::dofs, F::tdim> dN_m; ///< their gradients in eta
  Mat<F::gdim, F::tdim> T;    ///< master tangents dx_m/deta
};

/// @brief The slave's part, where its frame and shape functions are known.
template <class F>
[[nodiscard]] PointGeometry<F> slave_geometry(const Frame<F::gdim>& frame,
                                              const Vec<F::dofs>& N_s,
                                              const Mat<F::dofs, F::tdim>& dN_s)
{
  PointGeometry<F> p;
  p.slave = frame;
  p.N_s = N_s;
  p.dN_s = dN_s;
  p.dual = dual_tangents<F::gdim>(frame);
  p.G_s = p.dual * p.dN_s.transpose();
  return p;
}

template <class F>
[[nodiscard]] PointGeometry<F>
slave_geometry(const typename F::NodeMatrix& slave,
               const typename F::RefPoint& xi)
{
  return slave_geometry<F>(frame_at<F>(slave, xi), F::Disp::values(xi),
                           F::Disp::gradients(xi));
}

template <class F>
void add_master_geometry(PointGeometry<F>& p,
                         const typename F::NodeMatrix& master,
                         const Vec<F::dofs>& N_m,
                         const typename F::RefPoint& eta)
{
  p.N_m = N_m;
  p.dN_m = F::Disp::gradients(eta);
  if constexpr (F::degree == F::node_degree)
    p.T = master * p.dN_m;
  else
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
  Variations<F> v;
  v.g = g;
  v.dual = A.inverse();
  const Mat<D - 1, D> rho = v.dual.template topRows<D - 1>();
  const Mat<D - 1, F::dofs> turn = (g * rho) * p.G_s;
  for (int j = 0; j < D - 1; ++j)
  {
    const Vec<D> along = row_of(rho, j);
    double* const row = v.deta.data() + j * 2 * side;
    for (int a = 0; a < F::dofs; ++a)
    {
      put<D>(p.N_s[a] * along - turn(j, a) * p.slave.n, row + a * D);
      put<D>(-p.N_m[a] * along, row + side + a * D);
    }
  }
  return v;
}
} // namespace raymortar
