// Residual and tangent of one contact element: a slave facet with the master
// facet its points hit, or with none.
#pragma once

#include "raymortar/element/couple.h"
#include "raymortar/element/rates.h"

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
  static constexpr int side = Layout::side;
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
    if constexpr (M > 0)
    {
      Rows<M, 2 * side> dC = rows_of<M>(condition_slopes(p), p, at);
      if (moves(e.measure))
        dC.template leftCols<side>() +=
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
      Rows<M, 2 * side> dC = Rows<M, 2 * side>::Zero();
      if (moves(e.measure))
        dC.template leftCols<side>() =
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
    const Vec<D> force = p.weight * t;
    const auto add_far = [&](int a)
    { b.template segment<D>(Layout::master + a * D) += p.N_m[a] * force; };
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
      {
        const Vec<D - 1> along = (p.weight * p.g) *
                                 dual_tangents<D>(p.slave).transpose() *
                                 p.turning(t);
        const Vec<F::dofs> turn = F::Disp::gradients(p.xi) * along;
        for (int a = 0; a < F::dofs; ++a)
        {
          b.template segment<D>(a * D) +=
              turn[a] * p.slave.n - p.N_s[a] * force;
          add_far(a);
        }
        return;
      }
    for (int a = 0; a < F::dofs; ++a)
    {
      b.template segment<D>(a * D) -= p.N_s[a] * force;
      add_far(a);
    }
  }

  /// (1/gamma) int C . mu dG
  void add_condition(const SlavePoint<F, L, Law>& p, const Vec<M>& C)
  {
    if constexpr (M > 0)
    {
      const double w = p.weight / p.gamma;
      for (int k = 0; k < Layout::multipliers; ++k)
        b.template segment<M>(side + k * M) += w * p.shape[k] * C;
    }
  }

  using Columns = DofColumns<F, L, Law>;
  using Couple = CoupleSlopes<F>;
  template <int R, int C>
  using Rows = typename Columns::template Rows<R, C>;

  /// What the chain rule gives, over the dofs [slave | master]
  template <int R, class Slopes>
  [[nodiscard]] static Rows<R, 2 * side> rows_of(const Slopes& slopes,
                                                 const HitPoint<F, L, Law>& p,
                                                 const HitSlopes<F, L, Law>& at)
  {
    const Columns columns(p, at);
    return columns.template rows<R>(chain<R>(slopes, p, at, columns));
  }

  /// by_n dn, which has rank one per node  [theory (2.5)]
  template <int R>
  [[nodiscard]] static Rows<R, side> turn(const Mat<R, D>& by_n,
                                          const PointGeometry<F>& p)
  {
    Rows<R, side> rows;
    for (int a = 0; a < F::dofs; ++a)
      rows.template middleCols<D>(a * D) =
          -(by_n * p.G_s.col(a)) * p.slave.n.transpose();
    return rows;
  }

  /// Derivative of - t . (v_s + g dn - v_m)
  void add_traction_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                            const HitSlopes<F, L, Law>& at)
  {
    const auto& r = p.response;
    const PointGeometry<F>& geometry = at.geometry;
    const double w = p.weight;
    if constexpr (M == 0)
    {
      Rows<D, 2 * side> dt = rows_of<D>(traction_slopes(p), p, at);
      if (moves(e.measure))
        dt.template leftCols<side>() +=
            r.t * area_variation<F>(e.measure, geometry);
      add_master_tangent(p, at, dt);
      add_slave_tangent(e, p, at, dt);
      return;
    }
    if (moves(e.measure))
      add_work_tangent<side>(
          geometry, r.t * area_variation<F>(e.measure, geometry), 0, w);
    add_slide_tangent(p, at);
    if constexpr (M == 1)
    {
      if (at.frame.of_target)
      {
        const Rows<D, 2 * side> dt = rows_of<D>(traction_slopes(p), p, at);
        add_work_tangent<side>(geometry, dt.template leftCols<side>(), 0, w);
        add_work_tangent<side>(geometry, dt.template rightCols<side>(),
                               Layout::master, w);
      }
      else
        add_work_tangent<side>(geometry, turn<D>(r.t_n, geometry), 0, w);
      add_work_tangent<Layout::multipliers>(
          geometry, r.t_lam * p.shape.transpose(), side, w);
    }
    else if constexpr (M == D)
    {
      for (int k = 0; k < Layout::multipliers; ++k)
        for (int a = 0; a < F::dofs; ++a)
          for (int i = 0; i < D; ++i)
          {
            const int column = side + k * D + i;
            A(a * D + i, column) -= w * p.N_s[a] * p.shape[k];
            A(Layout::master + a * D + i, column) += w * p.N_m[a] * p.shape[k];
          }
      if constexpr (is_frictional<Law>)
        if (p.has_couple())
          add_couple_tangent(e, p, at);
    }
  }

  /// Derivative of p.turning(t), which varies with the frame as well, and of
  /// the area with it
  [[nodiscard]] static Rows<D, 2 * side>
  turning_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                  const HitSlopes<F, L, Law>& at)
  {
    Rows<D, 2 * side> dt = rows_of<D>(across_slopes(p), p, at);
    if (moves(e.measure))
      dt.template leftCols<side>() +=
          p.turning(p.response.t) * area_variation<F>(e.measure, at.geometry);
    return dt;
  }

  /// - dt . v_s of a traction that is no multiplier, and the couple
  /// @param[in] dt Derivative with that of the area, over [slave | master]
  void add_slave_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                         const HitSlopes<F, L, Law>& at,
                         const Rows<D, 2 * side>& dt)
  {
    const bool couple =
        p.has_couple() and p.response.status != ContactStatus::open;
    if (not couple)
      for (int a = 0; a < F::dofs; ++a)
        for (int i = 0; i < D; ++i)
          add_rows<2 * side>(A.row(a * D + i).data(),
                             ScaledRow{-p.weight * p.N_s[a], dt.row(i).data()});
    else if (p.of_target)
      add_slave_tangent(p, at, dt, turning_tangent(e, p, at));
    else
      add_slave_tangent(p, at, dt, dt);
  }

  /// @param[in] dturning Of the traction's part that makes the couple
  void add_slave_tangent(const HitPoint<F, L, Law>& p,
                         const HitSlopes<F, L, Law>& at,
                         const Rows<D, 2 * side>& dt,
                         const Rows<D, 2 * side>& dturning)
  {
    const Couple couple(p, at, dturning.data());
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
        couple.template add<2 * side>(
            a, i, 0, A.row(a * D + i).data(),
            ScaledRow{-p.weight * p.N_s[a], dt.row(i).data()});
  }

  /// The couple of a multiplier
  void add_couple_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                          const HitSlopes<F, L, Law>& at)
  {
    if (p.g != 0.0)
      add_multiplier_couple(p, at);
    if (p.of_target)
      add_turning_tangent({p, at, turning_tangent(e, p, at).data()});
    else if (p.response.t.isZero(0.0))
      return;
    else if (moves(e.measure))
    {
      Rows<D, 2 * side> dt = Rows<D, 2 * side>::Zero();
      dt.template leftCols<side>() =
          p.response.t * area_variation<F>(e.measure, at.geometry);
      add_turning_tangent({p, at, dt.data()});
    }
    else
      add_turning_tangent({p, at, nullptr});
  }

  /// Its part with the multiplier held, or where it hangs on displacements
  void add_turning_tangent(const Couple& couple)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        double* row = A.row(a * D + i).data();
        couple.template add<side>(a, i, 0, row);
        couple.template add<side>(a, i, side, row + Layout::master);
      }
  }

  void add_multiplier_couple(const HitPoint<F, L, Law>& p,
                             const HitSlopes<F, L, Law>& at)
  {
    const Vec<D>& n = p.slave.n;
    for (int a = 0; a < F::dofs; ++a)
    {
      const Vec<D> G = p.turning(at.geometry.G_s.col(a));
      for (int i = 0; i < D; ++i)
      {
        double* row = A.row(a * D + i).data() + side;
        const double w = p.weight * p.g * n[i];
        for (int k = 0; k < Layout::multipliers; ++k)
          for (int j = 0; j < D; ++j)
            row[k * D + j] += w * p.shape[k] * G[j];
      }
    }
  }

  /// Of - dt . (v_s - v_m) the master's rows: v_m(eta) is taken at another
  /// point, too
  void add_master_tangent(const HitPoint<F, L, Law>& p,
                          const HitSlopes<F, L, Law>& at,
                          const Rows<D, 2 * side>& dt)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
        add_slide<2 * side>(p, at, a, i, 0,
                            A.row(Layout::master + a * D + i).data(),
                            ScaledRow{p.weight * p.N_m[a], dt.row(i).data()});
  }

  /// The same of a multiplier, which does not hang on displacements
  void add_slide_tangent(const HitPoint<F, L, Law>& p,
                         const HitSlopes<F, L, Law>& at)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        double* row = A.row(Layout::master + a * D + i).data();
        add_slide<side>(p, at, a, i, 0, row);
        add_slide<side>(p, at, a, i, side, row + Layout::master);
      }
  }

  /// How the shape function of a node of the master changes with eta
  /// @param[in] first First of the C dofs
  template <int C, class... Terms>
  static void add_slide(const HitPoint<F, L, Law>& p,
                        const HitSlopes<F, L, Law>& at, int a, int i, int first,
                        double* row, const Terms&... terms)
  {
    const double t = p.weight * p.response.t[i];
    const ScaledRow by_1{t * at.geometry.dN_m(a, 0), &at.vary.deta(0, first)};
    if constexpr (D == 2)
      add_rows<C>(row, terms..., by_1);
    else
      add_rows<C>(
          row, terms..., by_1,
          ScaledRow{t * at.geometry.dN_m(a, 1), &at.vary.deta(1, first)});
  }

  /// - dt . (v_s - v_m) over the C columns of dt, the first of which is given
  template <int C>
  void add_work_tangent(const PointGeometry<F>& p, const Rows<D, C>& dt,
                        int column, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        const double* row = dt.data() + i * C;
        add_rows<C>(A.row(a * D + i).data() + column,
                    ScaledRow{-w * p.N_s[a], row});
        add_rows<C>(A.row(Layout::master + a * D + i).data() + column,
                    ScaledRow{w * p.N_m[a], row});
      }
  }

  /// dC . mu / gamma; dC over [slave | master]
  void add_condition_tangent(const SlavePoint<F, L, Law>& p,
                             const Rows<M, 2 * side>& dC,
                             const Mat<M, M>& C_lam)
  {
    constexpr int size = Layout::multiplier_dofs;
    const double w = p.weight / p.gamma;
    Rows<M, size> by_multiplier;
    for (int i = 0; i < M; ++i)
      for (int k = 0; k < Layout::multipliers; ++k)
        for (int j = 0; j < M; ++j)
          by_multiplier(i, k * M + j) = p.shape[k] * C_lam(i, j);
    for (int k = 0; k < Layout::multipliers; ++k)
      for (int i = 0; i < M; ++i)
      {
        double* row = A.row(side + k * M + i).data();
        const double test = w * p.shape[k];
        const double* by_u = dC.row(i).data();
        add_rows<side>(row, ScaledRow{test, by_u});
        add_rows<size>(row + side,
                       ScaledRow{test, by_multiplier.row(i).data()});
        add_rows<side>(row + Layout::master, ScaledRow{test, by_u + side});
      }
  }
};
} // namespace raymortar
