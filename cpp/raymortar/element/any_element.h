// Residual and tangent of one element of facets of any kind: laws give their
// derivatives by Taylor coefficients, and these become rows over the unknowns.
#pragma once

#include "raymortar/element/any_blocks.h"
#include "raymortar/element/rates.h"
#include "raymortar/element/turning.h"

namespace raymortar
{
/// @brief Accumulates residual and tangent of one element, point by point.
///
/// The unknown multiplier is ell = lam / lam_scale and its test function is
/// scaled likewise, so that both blocks of the residual are forces.
template <int D, class Law>
class AnyElement : public AnyBlocks<D>
{
public:
  static constexpr int T = D - 1;
  static constexpr int M = Law::template multiplier_size<D>;
  /// Whether points have a condition of their own
  static constexpr bool has_condition = M > 0 and holds_at_points<Law>;
  using Shapes = PointShapes<D>;
  using Data = TaylorData<D>;
  using Slave = SlavePoint<D, Law>;
  template <bool Slopes>
  using Hit = HitPoint<D, Law, Slopes>;
  using HitTangent = HitSlopes<D, Law>;
  using Columns = TaylorColumns<D, Law>;

  /// @brief Residual of a point with a hit.
  void add_hit(const Data& e, const Hit<false>& p, const Shapes& at)
  {
    const double arm = p.weight * p.g;
    this->add_force(p.weight * p.response.t, at);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        this->add_turn(Side::slave,
                       arm * (dual_tangents<D>(p.slave).transpose() *
                              p.turning(p.response.t)),
                       p.slave.n, at);
    if (p.has_foot() and at.has_target())
    {
      const Frame<D>& target = e.master_frames.now;
      this->add_turn(Side::target,
                     arm * p.pressure() *
                         (dual_tangents<D>(target).transpose() * p.slave.n),
                     target.n, at);
    }
    if constexpr (has_condition)
      this->template add_condition<M>(p.weight / p.gamma * p.response.C, at);
  }

  /// @brief Residual of a point without.
  void add_miss(const Slave& p, const Shapes& at)
  {
    if constexpr (has_condition)
      this->template add_condition<M>(
          p.weight / p.gamma * Law::template without_hit<D>(p.lam), at);
  }

  /// @brief Tangent of a point with a hit.
  void add_hit_tangent(const Data& e, const Hit<true>& p, const HitTangent& by,
                       const Shapes& at)
  {
    const Columns columns(p, by, at.has_target());
    add_traction_tangent(e, p, by, columns, at);
    if (at.has_target())
      add_slide_tangent(p, by, at);
    if constexpr (has_condition)
    {
      auto dC = chain<M>(condition_slopes(p), p, by, columns);
      add_area<M>(e, p, by.dual, p.response.C, dC);
      UnknownRows<M, D> rows;
      expand<M, D>(at, dC, target_part(p), rows);
      this->template set_multiplier_columns<M>(p.response.C_lam, rows, at);
      if constexpr (is_frictional<Law>)
        if (e.history.has_kept)
          this->template leave_out_unfelt<M>(p.response.C_spring, e.unfelt,
                                             rows, at);
      this->template add_condition_rows<M>(p.weight / p.gamma, rows, at.size(),
                                           at);
    }
  }

  /// @brief Tangent of a point without a hit.
  void add_miss_tangent(const Data& e, const Slave& p, const Shapes& at)
  {
    if constexpr (has_condition)
    {
      TaylorRows<M, D> dC;
      dC.slave.fill(Mat<M, D>::Zero());
      add_area<M>(e, p, dual_tangents<D>(p.slave),
                  Law::template without_hit<D>(p.lam), dC);
      UnknownRows<M, D> rows;
      expand<M, D>(at, dC, TargetPart::none, rows);
      this->template set_multiplier_columns<M>(-Mat<M, M>::Identity(), rows,
                                               at);
      this->template add_condition_rows<M>(p.weight / p.gamma, rows, at.alone(),
                                           at);
    }
  }

protected:
  /// Tell which derivatives by the target are not zero
  [[nodiscard]] static TargetPart target_part(const Hit<true>& p)
  {
    return is_frictional<Law> or p.of_target ? TargetPart::all
                                             : TargetPart::value;
  }

  /// Add that the area varies with the slave, by which f is multiplied
  template <int R>
  static void add_area(const Data& e, const Slave& p, const Mat<D, T>& dual,
                       const Vec<R>& f, TaylorRows<R, D>& rows)
  {
    raymortar::add_area<R, D>(e.measure, p.slave, dual, f, rows.slave);
  }

  /// Variation of the hit point along the target  [theory (2.8)]
  [[nodiscard]] static TaylorRows<T, D> vary_eta(const Hit<true>& p,
                                                 const HitTangent& by)
  {
    const Mat<T, D> rho = by.ray.template topRows<T>();
    const Mat<T, T> turn = p.g * rho * by.dual;
    TaylorRows<T, D> eta;
    eta.slave[0] = rho;
    eta.target[0] = -rho;
    for (std::size_t j = 1; j < D; ++j)
    {
      eta.slave[j] =
          -column(turn, static_cast<int>(j) - 1) * p.slave.n.transpose();
      eta.target[j].setZero();
    }
    return eta;
  }

private:
  /// Derivative of t in - t . (v_s + g dn - v_m), and of g dn
  void add_traction_tangent(const Data& e, const Hit<true>& p,
                            const HitTangent& by, const Columns& columns,
                            const Shapes& at)
  {
    if constexpr (M == D)
      add_vector_tangent(e, p, by, columns, at);
    else if (M == 0 or p.of_target)
    {
      const auto dt = chain<D>(traction_slopes(p), p, by, columns);
      add_work_tangent(e, p, by, dt, target_part(p), at);
      add_arm_tangents(e, p, by, columns, dt, at);
    }
    else
    {
      TaylorRows<D, D> dt;
      dt.slave[0].setZero();
      for (int j = 0; j < T; ++j)
      {
        const Vec<D> turned = p.response.t_n * column(by.dual, j);
        dt.slave[static_cast<std::size_t>(1 + j)] =
            -turned * p.slave.n.transpose();
      }
      add_work_tangent(e, p, by, dt, TargetPart::none, at);
    }
  }

  /// Add the tangent of the displacement rows where t is the multiplier
  void add_vector_tangent(const Data& e, const Hit<true>& p,
                          const HitTangent& by, const Columns& columns,
                          const Shapes& at)
  {
    this->add_multiplier(p.weight, at);
    TaylorRows<D, D> dt;
    dt.slave.fill(Mat<D, D>::Zero());
    dt.target.fill(Mat<D, D>::Zero());
    add_arm_tangents(e, p, by, columns, dt, at);
    if (not moves(e.measure))
      return;
    add_area<D>(e, p, by.dual, p.response.t, dt);
    UnknownRows<D, D> rows;
    expand<D, D>(at, dt, TargetPart::none, rows);
    this->add_work_rows(p.weight, rows, at.side(), at);
  }

  /// - dt . (v_s - v_m)
  void add_work_tangent(const Data& e, const Hit<true>& p, const HitTangent& by,
                        TaylorRows<D, D> dt, TargetPart part, const Shapes& at)
  {
    add_area<D>(e, p, by.dual, p.response.t, dt);
    UnknownRows<D, D> rows;
    expand<D, D>(at, dt, part, rows);
    if constexpr (M == 1)
      for (int k = 0; k < at.multipliers; ++k)
        for (int i = 0; i < D; ++i)
          rows[static_cast<std::size_t>(i)]
              [static_cast<std::size_t>(at.side() + k)] =
                  at.multiplier_value(k) * p.response.t_lam(i, 0);
    this->add_work_rows(p.weight, rows,
                        part == TargetPart::none ? at.alone() : at.size(), at);
  }

  /// v_m(eta) is taken at another point of the target
  void add_slide_tangent(const Hit<true>& p, const HitTangent& by,
                         const Shapes& at)
  {
    this->add_slide(p.weight * p.response.t, vary_eta(p, by), at);
  }

  /// Derivatives of what tractions do at the ends of arms
  /// @param[in] dt Derivative of t by the displacements, at fixed area
  void add_arm_tangents(const Data& e, const Hit<true>& p, const HitTangent& by,
                        const Columns& columns, const TaylorRows<D, D>& dt,
                        const Shapes& at)
  {
    if (not p.of_target)
    {
      if constexpr (is_frictional<Law>)
        if (p.has_couple())
          add_couple_tangent(e, p, by, columns, dt, at);
      return;
    }
    const bool has_foot = p.has_foot() and at.has_target();
    if (not p.has_couple() and not has_foot)
      return;
    const TaylorRows<D, D> dnu = vary_normal(p, by, columns);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        add_couple_tangent(e, p, by, columns, across_rows(p, dt, dnu), at);
    if (has_foot)
      add_foot_tangent(e, p, by, columns, pressure_rows(p, dt, dnu), at);
  }

  /// Derivative of - t . g dn  [theory (4.21)]
  /// @param[in] dt That of the traction that makes a couple, at fixed area
  void add_couple_tangent(const Data& e, const Hit<true>& p,
                          const HitTangent& by, const Columns& columns,
                          const TaylorRows<D, D>& dt, const Shapes& at)
  {
    TaylorRows<T, D> couple = vary_couple(e, p, by, columns, dt);
    const Vec<D> t = p.turning(p.response.t);
    add_turned(turned_by<D>(by.dual, p.slave.n, p.g * t), couple.slave);
    UnknownRows<T, D> rows;
    expand<T, D>(at, couple, TargetPart::all, rows);
    if constexpr (M > 0)
      for (int j = 0; j < T; ++j)
        set_multiplier_row(rows, j, p.g * p.turning(column(by.dual, j)), at);
    this->add_turn_rows(Side::slave, p.weight, p.slave.n, rows,
                        -p.g * (by.dual.transpose() * t), by.dual, at);
  }

  /// Derivative of p g n . d(nu), of the pressure p at the foot [theory (4.22)]
  /// @param[in] dp That of p, at fixed area
  void add_foot_tangent(const Data& e, const Hit<true>& p, const HitTangent& by,
                        const Columns& columns, const TaylorRows<1, D>& dp,
                        const Shapes& at)
  {
    const Vec<D>&n = p.slave.n, &n_m = by.frame.n;
    const Mat<D, T>& dual = by.frame.dual;
    const double pressure = p.pressure(), arm = p.g * pressure;
    const Vec<T> share = dual.transpose() * n;
    TaylorRows<1, D> dg = vary_gap(e, p, by, columns);
    TaylorRows<T, D> foot;
    for (std::size_t k = 0; k < D; ++k)
    {
      foot.slave[k] = share * (p.g * dp.slave[k] + pressure * dg.slave[k]);
      foot.target[k] = share * (p.g * dp.target[k] + pressure * dg.target[k]);
    }
    for (int j = 0; j < T; ++j)
      foot.slave[static_cast<std::size_t>(1 + j)] -=
          arm * (dual.transpose() * column(by.dual, j)) * n.transpose();
    const auto turned = turned_by<D>(dual, n_m, arm * n);
    add_turned(turned, foot.target);
    const TaylorRows<T, D> eta = vary_eta(p, by);
    if (e.master_bends)
    {
      const Mat<T, T> by_eta = along_facet<D>(turned, e.master);
      for (std::size_t k = 0; k < D; ++k)
      {
        foot.slave[k] += by_eta * eta.slave[k];
        foot.target[k] += by_eta * eta.target[k];
      }
    }
    UnknownRows<T, D> rows;
    expand<T, D>(at, foot, TargetPart::all, rows);
    if constexpr (M > 0)
      for (int j = 0; j < T; ++j)
        set_multiplier_row(rows, j, (p.g * share[j]) * by_multiplier(p), at);
    const Vec<T> held = arm * share;
    this->add_turn_rows(Side::target, p.weight, n_m, rows, -held, dual, at);
    if (e.master_bends)
      this->add_turn_slide(p.weight, held, n_m, by.frame.bend,
                           this->slide_rows(eta, at), at);
  }

  /// Derivative of g t along the slave's dual tangents, by all that varies but
  /// these tangents
  /// @param[in] dt That of the traction that makes a couple
  [[nodiscard]] static TaylorRows<T, D>
  vary_couple(const Data& e, const Hit<true>& p, const HitTangent& by,
              const Columns& columns, const TaylorRows<D, D>& dt)
  {
    const TaylorRows<1, D> dg = vary_gap(e, p, by, columns);
    const Mat<T, D> across = by.dual.transpose();
    const Mat<T, D> across_g = p.g * across;
    const Vec<T> along = across * p.turning(p.response.t);
    TaylorRows<T, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = along * dg.slave[k] + across_g * dt.slave[k];
      rows.target[k] = along * dg.target[k] + across_g * dt.target[k];
    }
    return rows;
  }

protected:
  /// Derivative of the ray's length times the area, per area
  [[nodiscard]] static TaylorRows<1, D> vary_gap(const Data& e,
                                                 const Hit<true>& p,
                                                 const HitTangent& by,
                                                 const Columns& columns)
  {
    const Mat<1, D> by_ends = by.ray.row(D - 1);
    TaylorRows<1, D> dg = columns.template ray<1>(-p.g * by_ends, by_ends);
    add_area<1>(e, p, by.dual, Vec<1>(p.g), dg);
    return dg;
  }

  /// Derivative of the frame's normal, which is the target's
  [[nodiscard]] static TaylorRows<D, D>
  vary_normal(const Hit<true>& p, const HitTangent& by, const Columns& columns)
  {
    auto rows =
        columns.template ray<D>(-p.g * by.frame.by_ends, by.frame.by_ends);
    columns.template add_frame<D>(Mat<D, D>::Identity(), rows);
    return rows;
  }

  /// Derivatives of the traction's parts across the normal and along it
  [[nodiscard]] static TaylorRows<D, D> across_rows(const Hit<true>& p,
                                                    const TaylorRows<D, D>& dt,
                                                    const TaylorRows<D, D>& dnu)
  {
    TaylorRows<D, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = p.across_change(dt.slave[k], dnu.slave[k]);
      rows.target[k] = p.across_change(dt.target[k], dnu.target[k]);
    }
    return rows;
  }
  [[nodiscard]] static TaylorRows<1, D>
  pressure_rows(const Hit<true>& p, const TaylorRows<D, D>& dt,
                const TaylorRows<D, D>& dnu)
  {
    TaylorRows<1, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = p.pressure_change(dt.slave[k], dnu.slave[k]);
      rows.target[k] = p.pressure_change(dt.target[k], dnu.target[k]);
    }
    return rows;
  }

private:
  /// Derivative of the pressure by the components of the multiplier
  [[nodiscard]] static Vec<M> by_multiplier(const Hit<true>& p)
  {
    if constexpr (M == 1)
      return Vec<1>(p.normal.dot(p.response.t_lam.col(0)));
    else
      return p.normal;
  }

  /// Add the second variation of - f . n, see turned_by
  static void add_turned(const std::array<Mat<T, D>, T>& turned,
                         std::array<Mat<T, D>, D>& rows)
  {
    for (std::size_t j = 0; j < T; ++j)
      rows[1 + j] += turned[j];
  }

  /// Columns of the multiplier in a row
  static void set_multiplier_row(UnknownRows<T, D>& rows, int row,
                                 const Vec<M>& by_lam, const Shapes& at)
  {
    for (int k = 0; k < at.multipliers; ++k)
      for (int i = 0; i < M; ++i)
        rows[static_cast<std::size_t>(row)]
            [static_cast<std::size_t>(at.side() + k * M + i)] =
                at.multiplier_value(k) * by_lam[i];
  }
};
} // namespace raymortar
