// How the vertices of a segment move on the slave with the bodies.
#pragma once

#include "raymortar/element/kinematics.h"
#include "raymortar/mortar/breaks.h"

namespace raymortar
{
/// @brief dxi of a vertex as rows over the displacement dofs
/// [slave | master of the segment]: (3.5) or (3.6) differentiated. Zero where
/// two edges run along each other: their crossing may be anywhere on them.
/// @param[in] slave, master Deformed nodes, (gdim, nodes). Length
/// @param[in] hangs_on Not Motion::fixed
/// [theory (3.9), (3.10)]
template <class F>
[[nodiscard]] Mat<F::tdim, 2 * Variations<F>::side>
vertex_motion(const typename F::NodeMatrix& slave,
              const typename F::NodeMatrix& master,
              const typename F::RefPoint& xi, const Break& hangs_on)
{
  constexpr int D = F::gdim;
  constexpr int T = F::tdim;
  constexpr int side = Variations<F>::side;
  const typename F::RefPoint eta = hangs_on.eta.template head<T>();
  PointGeometry<F> p = slave_geometry<F>(slave, xi);
  add_master_geometry<F>(p, master, F::Disp::values(eta), eta);
  const double g = p.slave.n.dot(master * F::Node::values(eta) - p.slave.x);
  const Mat<D, T> along =
      p.slave.t + g * curvature_at<F>(slave, xi, p.slave, p.dual).n;
  Mat<D, D> A;
  Mat<T, D> by_z; // dxi of the unknowns
  by_z.setZero();
  A.col(D - 1) = p.slave.n;
  if (hangs_on.motion == Break::Motion::corner)
  {
    A.template leftCols<T>() = along;
    by_z.template leftCols<T>().setIdentity();
  }
  else
  {
    by_z.col(0) = hangs_on.along_s.template head<T>();
    A.col(0) = along * by_z.col(0);
    A.col(1) = -p.T * hangs_on.along_m.template head<T>();
  }
  if (not(std::abs(A.determinant()) >
          tolerance::along * A.colwise().norm().prod()))
    return Mat<T, 2 * side>::Zero();
  // Applied to du_m - du_s - g dn, with dn = - sum_a G_a (n . du_a)
  const Mat<T, D> by_u = by_z * A.inverse();
  Mat<T, 2 * side> dxi;
  for (int a = 0; a < F::dofs; ++a)
  {
    dxi.template middleCols<D>(a * D) =
        g * (by_u * p.G_s.col(a)) * p.slave.n.transpose() - p.N_s[a] * by_u;
    dxi.template middleCols<D>(side + a * D) = p.N_m[a] * by_u;
  }
  return dxi;
}
} // namespace raymortar
