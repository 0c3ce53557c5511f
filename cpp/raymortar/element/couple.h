// Tangent of the couple that friction makes over the gap.
#pragma once

#include "raymortar/element/hit_slopes.h"

namespace raymortar
{
/// @brief Derivative of - t . g dn  [theory (4.19), (4.21)].
///
/// It hangs on the tangents of the slave, dn = - sum_j t^j (n . dt_j): there
/// are rows for them, of which nodes take their gradients' share.
template <class F>
class CoupleSlopes
{
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  static constexpr int side = Variations<F>::side;
  template <int R>
  using Rows = Eigen::Matrix<double, R, 2 * side, Eigen::RowMajor>;

public:
  /// @param[in] dt Derivative of the turning traction with that of the area,
  /// (gdim, 2 side) row-major; nullptr: none
  template <class Hit, class Slopes>
  CoupleSlopes(const Hit& p, const Slopes& at, const double* dt)
      : _geometry(at.geometry)
  {
    const PointGeometry<F>& geometry = at.geometry;
    const Vec<D>& n = geometry.slave.n;
    const Vec<D> b = at.vary.dual.row(D - 1);
    const Vec<D> force = p.weight * p.turning(p.response.t);
    Rows<1> dg;
    for (int c = 0; c < F::dofs; ++c)
    {
      const double turn = p.g * geometry.G_s.col(c).dot(b);
      for (int j = 0; j < D; ++j)
      {
        dg[c * D + j] = turn * n[j] - geometry.N_s[c] * b[j];
        dg[side + c * D + j] = geometry.N_m[c] * b[j];
      }
    }
    const double f_n = p.g * force.dot(n);
    for (int q = 0; q < T; ++q)
    {
      const Vec<D> dual = geometry.dual.col(q);
      const double t = force.dot(dual);
      Rows<1> by_n = t * dg;
      if (dt)
        for (int i = 0; i < D; ++i)
          add_rows<2 * side>(by_n.data(), ScaledRow{p.weight * p.g * dual[i],
                                                    dt + i * 2 * side});
      // The second variation of - f . n
      for (int c = 0; c < F::dofs; ++c)
      {
        const Vec<D> G = geometry.G_s.col(c);
        const double across = f_n * G.dot(dual), along = p.g * force.dot(G);
        for (int j = 0; j < D; ++j)
          by_n[c * D + j] += across * n[j] - along * dual[j];
      }
      for (int i = 0; i < D; ++i)
      {
        auto row = _rows.row(q * D + i);
        row = n[i] * by_n;
        for (int c = 0; c < F::dofs; ++c)
          row.template segment<D>(c * D) -=
              (p.g * t * geometry.G_s(i, c)) * n.transpose();
      }
    }
  }

  /// @brief Add C numbers of a node's row, from the one of dof `first` on, and
  /// other terms with them.
  template <int C, class... Terms>
  void add(int a, int i, int first, double* row, const Terms&... terms) const
  {
    const ScaledRow by_1{_geometry.dN_s(a, 0), &_rows(i, first)};
    if constexpr (T == 1)
      add_rows<C>(row, terms..., by_1);
    else
      add_rows<C>(row, terms..., by_1,
                  ScaledRow{_geometry.dN_s(a, 1), &_rows(D + i, first)});
  }

private:
  const PointGeometry<F>& _geometry;
  Rows<T * D> _rows;
};
} // namespace raymortar
