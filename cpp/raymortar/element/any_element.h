// Residual and tangent of one element of facets of any kind: laws give their
// derivatives by Taylor coefficients, and these become rows over the unknowns.
#pragma once

#include "raymortar/element/any_blocks.h"
#include "raymortar/element/germ_point.h"
#include "raymortar/law/nodal.h"

namespace raymortar
{
/// @brief Accumulates the blocks of one element, as Element does.
template <int D, class Law>
class AnyElement : public AnyBlocks<D>
{
public:
  using F = Germ<D>;
  static constexpr int T = D - 1;
  static constexpr int M = Law::template multiplier_size<D>;
  static constexpr int L = M > 0 ? 1 : 0;
  /// Whether points have a condition of their own
  static constexpr bool has_condition = M > 0 and not holds_at_nodes<Law>;
  using Shapes = PointShapes<D>;
  using Data = ElementData<F, L, Law>;
  using Slave = SlavePoint<F, L, Law>;
  template <bool Slopes>
  using Hit = HitPoint<F, L, Law, Slopes>;
  using HitTangent = HitSlopes<F, L, Law>;
  using Columns = GermColumns<F, L, Law>;

  /// @brief Residual of a point with a hit.
  void add_hit(const Hit<false>& p, const Shapes& at)
  {
    this->add_force(p.weight * p.response.t, at);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        this->add_turn(p.weight * p.g * dual_tangents<D>(p.slave).transpose() *
                           p.turning(p.response.t),
                       p.slave.n, at);
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
      this->template add_condition_rows<M>(p.weight / p.gamma, p.response.C_lam,
                                           rows, at.size(), at);
    }
  }

  /// @brief Tangent of a point without a hit.
  void add_miss_tangent(const Data& e, const Slave& p, const Shapes& at)
  {
    if constexpr (has_condition)
    {
      GermRows<M, D> dC;
      dC.slave.fill(Mat<M, D>::Zero());
      add_area<M>(e, p, dual_tangents<D>(p.slave),
                  Law::template without_hit<D>(p.lam), dC);
      UnknownRows<M, D> rows;
      expand<M, D>(at, dC, TargetPart::none, rows);
      this->template add_condition_rows<M>(
          p.weight / p.gamma, -Mat<M, M>::Identity(), rows, at.alone(), at);
    }
  }

protected:
  /// What derivatives by the target are not zero
  [[nodiscard]] static TargetPart target_part(const Hit<true>& p)
  {
    return is_frictional<Law> or p.of_target ? TargetPart::all
                                             : TargetPart::value;
  }

  /// Add that the area varies with the slave, by which f is multiplied
  template <int R>
  static void add_area(const Data& e, const Slave& p, const Mat<D, T>& dual,
                       const Vec<R>& f, GermRows<R, D>& rows)
  {
    if (not moves(e.measure))
      return;
    for (int j = 0; j < T; ++j)
      rows.slave[static_cast<std::size_t>(1 + j)] +=
          f * dual.col(j).transpose();
    if constexpr (D == 2)
      if (revolves(e.measure))
        rows.slave[0].col(0) += f / p.slave.x[0];
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
      if constexpr (is_frictional<Law>)
        if (p.has_couple())
          add_couple_tangent(e, p, by, columns, dt, at);
    }
    else
    {
      GermRows<D, D> dt;
      dt.slave[0].setZero();
      for (int j = 0; j < T; ++j)
      {
        const Vec<D> turned = p.response.t_n * by.dual.col(j);
        dt.slave[static_cast<std::size_t>(1 + j)] =
            -turned * p.slave.n.transpose();
      }
      add_work_tangent(e, p, by, dt, TargetPart::none, at);
    }
  }

  /// The same where t is the multiplier
  void add_vector_tangent(const Data& e, const Hit<true>& p,
                          const HitTangent& by, const Columns& columns,
                          const Shapes& at)
  {
    this->add_multiplier(p.weight, at);
    if (not moves(e.measure) and not p.has_couple())
      return;
    GermRows<D, D> dt;
    dt.slave.fill(Mat<D, D>::Zero());
    dt.target.fill(Mat<D, D>::Zero());
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        add_couple_tangent(e, p, by, columns, dt, at);
    if (not moves(e.measure))
      return;
    add_area<D>(e, p, by.dual, p.response.t, dt);
    UnknownRows<D, D> rows;
    expand<D, D>(at, dt, TargetPart::none, rows);
    this->add_work_rows(p.weight, rows, at.side(), at);
  }

  /// - dt . (v_s - v_m)
  void add_work_tangent(const Data& e, const Hit<true>& p, const HitTangent& by,
                        GermRows<D, D> dt, TargetPart part, const Shapes& at)
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
    const Mat<T, D> rho = by.vary.dual.template topRows<T>();
    const Mat<T, T> turn = p.g * rho * by.dual;
    GermRows<T, D> eta;
    eta.slave[0] = rho;
    eta.target[0] = -rho;
    for (int j = 0; j < T; ++j)
      eta.slave[static_cast<std::size_t>(1 + j)] =
          -turn.col(j) * p.slave.n.transpose();
    this->add_slide(p.weight * p.response.t, eta, at);
  }

  /// Derivative of - t . g dn  [theory (4.21)]
  /// @param[in] dt That of t at fixed area
  void add_couple_tangent(const Data& e, const Hit<true>& p,
                          const HitTangent& by, const Columns& columns,
                          const GermRows<D, D>& dt, const Shapes& at)
  {
    GermRows<T, D> couple =
        p.of_target ? vary_couple(e, p, by, columns,
                                  chain<D>(across_slopes(p), p, by, columns))
                    : vary_couple(e, p, by, columns, dt);
    const Vec<D> t = p.turning(p.response.t);
    add_turned(by, p.slave.n, p.g * t, couple);
    UnknownRows<T, D> rows;
    expand<T, D>(at, couple, TargetPart::all, rows);
    if constexpr (M > 0)
      set_multiplier(p, by, at, rows);
    this->add_turn_rows(p.weight, p.slave.n, rows,
                        -p.g * by.dual.transpose() * t, by.dual, at);
  }

  /// Derivative of g t along the slave's dual tangents, by all that varies but
  /// these tangents
  /// @param[in] dt That of the traction that makes a couple
  [[nodiscard]] static GermRows<T, D>
  vary_couple(const Data& e, const Hit<true>& p, const HitTangent& by,
              const Columns& columns, const GermRows<D, D>& dt)
  {
    const Mat<1, D> by_ends = by.vary.dual.row(D - 1);
    GermRows<1, D> dg = columns.template ray<1>(-p.g * by_ends, by_ends);
    add_area<1>(e, p, by.dual, Vec<1>(p.g), dg);
    const Mat<T, D> across = by.dual.transpose();
    const Mat<T, D> across_g = p.g * across;
    const Vec<T> along = across * p.turning(p.response.t);
    GermRows<T, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = along * dg.slave[k] + across_g * dt.slave[k];
      rows.target[k] = along * dg.target[k] + across_g * dt.target[k];
    }
    return rows;
  }

  /// Add the second variation of - f . n with f = g t, see add_turning_tangent
  static void add_turned(const HitTangent& by, const Vec<D>& n, const Vec<D>& f,
                         GermRows<T, D>& rows)
  {
    const Mat<T, T> metric = by.dual.transpose() * by.dual;
    const Vec<T> along = by.dual.transpose() * f;
    for (int j = 0; j < T; ++j)
      rows.slave[static_cast<std::size_t>(1 + j)] +=
          f.dot(n) * metric.col(j) * n.transpose() -
          along[j] * by.dual.transpose();
  }

  /// Columns of the multiplier in the rows of the couple
  static void set_multiplier(const Hit<true>& p, const HitTangent& by,
                             const Shapes& at, UnknownRows<T, D>& rows)
  {
    for (int j = 0; j < T; ++j)
    {
      const Vec<D> by_lam = p.g * p.turning(by.dual.col(j));
      for (int k = 0; k < at.multipliers; ++k)
        for (int i = 0; i < D; ++i)
          rows[static_cast<std::size_t>(j)]
              [static_cast<std::size_t>(at.side() + k * D + i)] =
                  at.multiplier_value(k) * by_lam[i];
    }
  }
};
} // namespace raymortar
