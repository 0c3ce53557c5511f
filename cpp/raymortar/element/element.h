// Residual and tangent of one contact element: a slave facet with the master
// facet its points hit, or with none.
#pragma once

#include "raymortar/element/rates.h"
#include "raymortar/element/turning.h"

namespace raymortar
{
/// @brief Accumulates residual and tangent of one element, point by point.
///
/// The unknown multiplier is ell = lam / lam_scale and its test function is
/// scaled likewise, so that both blocks of the residual are forces.
template <class F, int L, class Law>
class Element
{
public:
  using Layout = ElementLayout<F, L, Law>;
  using Data = ElementData<F, L, Law>;
  static constexpr int D = F::gdim;
  static constexpr int M = Layout::components;
  using Vector = Vec<Layout::size>;
  using Matrix =
      Eigen::Matrix<double, Layout::size, Layout::size, Eigen::RowMajor>;

  Vector b; ///< to be set to zero before the first point, as A
  Matrix A;

  /// @brief Residual of a point with a hit: contact work (3), condition (4).
  template <bool Slopes>
  void add_hit(const HitPoint<F, L, Law, Slopes>& p)
  {
    add_work(p, p.response.t);
    add_condition(p, p.response.C);
  }

  /// @brief Residual of a point without: the multiplier is driven to zero.
  void add_miss(const SlavePoint<F, L, Law>& p)
  {
    if constexpr (M > 0)
      add_condition(p, Law::template without_hit<D>(p.lam));
  }

  /// @brief Tangent of a point with a hit.
  void add_hit_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                       const HitSlopes<F, L, Law>& at)
  {
    add_traction_tangent(e, p, at);
    add_slide_tangent(at.geometry, p.response.t, at.vary.deta, p.weight);
    if constexpr (M > 0)
    {
      Rows<M, 2 * Layout::side> dC =
          chain<M>(condition_slopes(p), p, at, Columns(p, at));
      if (moves(e.measure))
        dC.template leftCols<Layout::side>() +=
            p.response.C * area_variation<F>(e.measure, at.geometry);
      add_condition_tangent(p, dC, p.response.C_lam);
    }
  }

  /// @brief Tangent of a point without a hit.
  void add_miss_tangent(const Data& e, const ElementPoint<F>& q,
                        const SlavePoint<F, L, Law>& p)
  {
    if constexpr (M > 0)
    {
      Rows<M, 2 * Layout::side> dC = Rows<M, 2 * Layout::side>::Zero();
      if (moves(e.measure))
        dC.template leftCols<Layout::side>() =
            Law::template without_hit<D>(p.lam) *
            area_variation<F>(
                e.measure,
                slave_geometry<F>(p.slave, p.N_s, F::Disp::gradients(q.xi)));
      add_condition_tangent(p, dC, -Mat<M, M>::Identity());
    }
  }

private:
  /// - int t . (v_s + g dn - v_m) dG
  template <bool Slopes>
  void add_work(const HitPoint<F, L, Law, Slopes>& p, const Vec<D>& t)
  {
    for (int a = 0; a < F::dofs; ++a)
    {
      b.template segment<D>(a * D) -= p.weight * p.N_s[a] * t;
      b.template segment<D>(Layout::master + a * D) += p.weight * p.N_m[a] * t;
    }
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
      {
        const Vec<F::dofs> turn =
            F::Disp::gradients(p.xi) *
            (dual_tangents<D>(p.slave).transpose() * t).eval();
        for (int a = 0; a < F::dofs; ++a)
          b.template segment<D>(a * D) +=
              (p.weight * p.g * turn[a]) * p.slave.n;
      }
  }

  /// (1/gamma) int C . mu dG
  void add_condition(const SlavePoint<F, L, Law>& p, const Vec<M>& C)
  {
    if constexpr (M > 0)
    {
      const double w = p.weight / p.gamma;
      for (int k = 0; k < Layout::multipliers; ++k)
        b.template segment<M>(Layout::side + k * M) += w * p.shape[k] * C;
    }
  }

  using Columns = DofColumns<F, L, Law>;
  template <int R, int C>
  using Rows = typename Columns::template Rows<R, C>;

  /// by_n dn, which has rank one per node  [theory (2.5)]
  template <int R>
  [[nodiscard]] static Rows<R, Layout::side> turn(const Mat<R, D>& by_n,
                                                  const PointGeometry<F>& p)
  {
    Rows<R, Layout::side> rows;
    for (int a = 0; a < F::dofs; ++a)
      rows.template middleCols<D>(a * D) =
          -(by_n * p.G_s.col(a)) * p.slave.n.transpose();
    return rows;
  }

  /// Derivative of t in - t . (v_s + g dn - v_m), and of g dn: by what they
  /// vary with, see PointResponse
  void add_traction_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                            const HitSlopes<F, L, Law>& at)
  {
    constexpr int side = Layout::side;
    const auto& r = p.response;
    const PointGeometry<F>& geometry = at.geometry;
    const double w = p.weight;
    if (moves(e.measure))
      add_work_tangent<side>(
          geometry, r.t * area_variation<F>(e.measure, geometry), 0, w);
    if constexpr (M == 0)
    {
      const Rows<D, 2 * side> dt =
          chain<D>(traction_slopes(p), p, at, Columns(p, at));
      add_work_tangent<2 * side>(geometry, dt, 0, w);
      if constexpr (is_frictional<Law>)
        if (p.has_couple())
          add_couple_tangent(e, p, at, dt);
    }
    else if constexpr (M == 1)
    {
      add_work_tangent<side>(geometry, turn<D>(r.t_n, geometry), 0, w);
      add_work_tangent<Layout::multipliers>(
          geometry, r.t_lam * p.shape.transpose(), side, w);
    }
    else
    {
      for (int k = 0; k < Layout::multipliers; ++k)
        for (int a = 0; a < F::dofs; ++a)
        {
          const int column = side + k * D, m = Layout::master + a * D;
          A.template block<D, D>(a * D, column).diagonal().array() -=
              w * p.N_s[a] * p.shape[k];
          A.template block<D, D>(m, column).diagonal().array() +=
              w * p.N_m[a] * p.shape[k];
        }
      if constexpr (is_frictional<Law>)
      {
        if (p.has_couple())
          add_couple_tangent(e, p, at, Rows<D, 0>());
      }
    }
  }

  /// Derivative of - t . g dn  [theory (4.21)]
  /// @param[in] dt That of t, over [slave | master]; empty where it is the
  /// multiplier
  template <int C>
  void add_couple_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                          const HitSlopes<F, L, Law>& at, const Rows<D, C>& dt)
  {
    constexpr int side = Layout::side;
    const PointGeometry<F>& geometry = at.geometry;
    const Vec<D>& n = p.slave.n;
    const Vec<D> t = p.weight * p.response.t;
    const double w = p.weight * p.g;
    const Mat<1, D> by_ends = at.vary.dual.row(D - 1);
    Rows<1, 2 * side> dg =
        Columns(p, at).template ray<1>(-p.g * by_ends, by_ends);
    if (moves(e.measure))
      dg.template head<side>() += p.g * area_variation<F>(e.measure, geometry);
    for (int a = 0; a < F::dofs; ++a)
    {
      const Vec<D> G = geometry.G_s.col(a);
      Rows<1, 2 * side> row = G.dot(t) * dg;
      if constexpr (C > 0)
        row += (w * G).transpose() * dt;
      for (int i = 0; i < D; ++i)
      {
        A.row(a * D + i).template head<side>() +=
            n[i] * row.template head<side>();
        A.row(a * D + i).template tail<side>() +=
            n[i] * row.template tail<side>();
      }
      if constexpr (M > 0)
        for (int k = 0; k < Layout::multipliers; ++k)
          A.template block<D, D>(a * D, side + k * D) +=
              (w * p.shape[k]) * n * G.transpose();
    }
    add_turning_tangent<D>(geometry.G_s, n, p.g * t, A);
  }

  /// - dt . (v_s - v_m) over the C columns of dt, the first of which is given
  template <int C>
  void add_work_tangent(const PointGeometry<F>& p, const Rows<D, C>& dt,
                        int column, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        A.row(a * D + i).template segment<C>(column) -=
            (w * p.N_s[a]) * dt.row(i);
        A.row(Layout::master + a * D + i).template segment<C>(column) +=
            (w * p.N_m[a]) * dt.row(i);
      }
  }

  /// v_m(eta) is taken at another point of the master
  void add_slide_tangent(const PointGeometry<F>& p, const Vec<D>& t,
                         const Rows<D - 1, 2 * Layout::side>& deta, double w)
  {
    constexpr int side = Layout::side;
    for (int a = 0; a < F::dofs; ++a)
    {
      // Two halves: a load across two fresh stores would wait for both
      const Vec<D - 1> by_eta = w * p.dN_m.row(a).transpose();
      const Rows<1, side> by_s =
          by_eta.transpose() * deta.template leftCols<side>();
      const Rows<1, side> by_m =
          by_eta.transpose() * deta.template rightCols<side>();
      for (int i = 0; i < D; ++i)
      {
        const int row = Layout::master + a * D + i;
        A.row(row).template head<side>() += t[i] * by_s;
        A.row(row).template tail<side>() += t[i] * by_m;
      }
    }
  }

  /// dC . mu / gamma; dC over [slave | master]
  void add_condition_tangent(const SlavePoint<F, L, Law>& p,
                             const Rows<M, 2 * Layout::side>& dC,
                             const Mat<M, M>& C_lam)
  {
    constexpr int side = Layout::side;
    const double w = p.weight / p.gamma;
    for (int k = 0; k < Layout::multipliers; ++k)
    {
      const double test = w * p.shape[k];
      for (int i = 0; i < M; ++i)
      {
        auto row = A.row(side + k * M + i);
        row.template head<side>() += test * dC.row(i).template head<side>();
        row.template tail<side>() += test * dC.row(i).template tail<side>();
        for (int j = 0; j < Layout::multipliers; ++j)
          row.template segment<M>(side + j * M) +=
              (test * p.shape[j]) * C_lam.row(i);
      }
    }
  }
};
} // namespace raymortar
