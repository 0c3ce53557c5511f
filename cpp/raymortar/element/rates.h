// The chain rule of a point: from what a law varies with to the displacements
// around it, and to the coordinates of the slave facet.
#pragma once

#include "raymortar/element/any_blocks.h"
#include "raymortar/element/contact_point.h"

namespace raymortar
{
/// @brief Derivatives of R numbers that a law gives by what it takes.
template <int R, int D, int M, bool Frictional>
struct LawSlopes
{
  const Mat<R, D>& by_n;
  const Vec<R>& by_g;
  const Mat<R, M>& by_lam;
};

/// Slopes of a law with friction
template <int R, int D, int M>
struct LawSlopes<R, D, M, true>
{
  const Mat<R, D>& by_n;
  const Vec<R>& by_g;
  const Mat<R, M>& by_lam;
  const Mat<R, D>& by_w;
  Mat<R, D> by_spring; ///< by what the springs hold, see ContactState
  const Vec<R>& by_coefficient;
  const Vec<R>& by_rate; ///< see FrictionResponse
};

/// @brief Those of the traction. Of a multiplier it is that, and friction has
/// no part in it.
template <int D, class Law>
[[nodiscard]] auto traction_slopes(const HitPoint<D, Law>& p)
{
  constexpr int M = HitPoint<D, Law>::M;
  const auto& r = p.response;
  if constexpr (is_frictional<Law> and M == 0)
    return LawSlopes<D, D, M, true>{
        r.t_n,           r.t_g,   r.t_lam, r.t_w, p.spring_scale() * r.t_spring,
        r.t_coefficient, r.t_rate};
  else
    return LawSlopes<D, D, M, false>{r.t_n, r.t_g, r.t_lam};
}

/// @brief Those of the multiplier's residual; its springs hold lengths.
template <int D, class Law>
[[nodiscard]] auto condition_slopes(const HitPoint<D, Law>& p)
{
  constexpr int M = HitPoint<D, Law>::M;
  const auto& r = p.response;
  if constexpr (is_frictional<Law>)
    return LawSlopes<M, D, M, true>{
        r.C_n,           r.C_g,   r.C_lam, r.C_w, p.gamma * r.C_spring,
        r.C_coefficient, r.C_rate};
  else
    return LawSlopes<M, D, M, false>{r.C_n, r.C_g, r.C_lam};
}

/// @brief Derivatives of R numbers along some columns, by the chain rule.
///
/// By the gap and by the master's point a law varies with what both ends of the
/// ray do, du_m - du_s - g dn  [theory (2.7), (2.8)]; slip and springs vary
/// with their own history besides  [theory (2.9), (4.9)]. What differs between
/// displacements and coordinates of the facet is what the columns say:
///   ray(by_turn, by_ends)    by_turn dn + by_ends (du_m - du_s)
///   add_frame(by_n, rows)    what the frame of what is hit does besides
///   add_slip(by_w, rows)     what the slip does where both ends stay
///   add_spring(by_s, rows)   what the springs do
///   add_fields(slopes, by_g, rows)  fields on the slave, and its multiplier
template <int R, class Slopes, int D, class Law, class Columns>
[[nodiscard]] auto chain(const Slopes& law, const HitPoint<D, Law>& p,
                         const HitSlopes<D, Law>& at, const Columns& columns)
{
  Vec<R> by_gap = law.by_g;
  if constexpr (requires { law.by_w; })
    by_gap += p.old.closing.by_now * (law.by_w * p.old.normal);
  Vec<R> by_g = by_gap; // by the length of the ray
  Mat<R, D> by_n = law.by_n, by_turn_of_arm = Mat<R, D>::Zero();
  if (at.frame.of_target)
  {
    const double along = dot<D>(p.slave.n, p.normal);
    by_g *= along;
    by_n += (p.g * by_gap) * p.slave.n.transpose();
    if constexpr (requires { law.by_w; }) // the arm
    {
      if (p.has_couple())
        by_g -= law.by_w * (at.slip.by_slide * p.old.slave.old.n);
      else
      {
        const Vec<R> by_normal = law.by_w * p.normal;
        by_g -= law.by_w * p.slave.n - along * by_normal;
        by_n += p.g * (by_normal * p.slave.n.transpose() + along * law.by_w);
        by_turn_of_arm = p.g * (by_normal * p.normal.transpose() - law.by_w);
      }
    }
  }
  const Mat<1, D> along_ray = at.ray.row(D - 1);
  Mat<R, D> by_ends = by_g * along_ray;
  if constexpr (requires { law.by_w; })
  {
    const Mat<D - 1, D> rho = at.ray.template topRows<D - 1>();
    by_ends -= (law.by_w * at.slip.by_eta) * rho;
  }
  if (at.frame.of_target)
    by_ends += by_n * at.frame.by_ends;
  Mat<R, D> by_turn = -p.g * by_ends;
  if (at.frame.of_target)
    by_turn += (p.g * by_gap) * p.normal.transpose() + by_turn_of_arm;
  else
    by_turn += by_n;
  if constexpr (requires { law.by_w; })
  {
    by_turn += law.by_w * at.slip.tilt.by_n;
    if constexpr (D == 3)
      by_turn += law.by_w * (at.slip.tilt.by_slide * at.slip.spin.by_n);
  }
  auto rows = columns.template ray<R>(by_turn, by_ends);
  if (at.frame.of_target)
    columns.template add_frame<R>(by_n, rows);
  if constexpr (requires { law.by_w; })
  {
    columns.template add_slip<R>(law.by_w, rows);
    if (not p.old.spring.is_zero())
      columns.template add_spring<R>(law.by_spring, rows);
  }
  columns.template add_fields<R>(law, by_gap, rows);
  return rows;
}

/// @brief Taylor coefficients of both displacements.
template <int D, class Law>
class TaylorColumns
{
public:
  static constexpr int T = D - 1;
  template <int R>
  using Rows = TaylorRows<R, D>;

  /// @param[in] target_moves Whether there are rows of the target
  TaylorColumns(const HitPoint<D, Law>& p, const HitSlopes<D, Law>& at,
                bool target_moves)
      : _p(p), _at(at), _target_moves(target_moves)
  {
  }

  /// The normal's variation has rank one  [theory (2.5)]
  template <int R>
  [[nodiscard]] Rows<R> ray(const Mat<R, D>& by_turn,
                            const Mat<R, D>& by_ends) const
  {
    Rows<R> rows;
    rows.slave[0] = -by_ends;
    rows.target[0] = by_ends;
    for (int j = 0; j < T; ++j)
    {
      const auto k = static_cast<std::size_t>(1 + j);
      const Vec<R> turned = by_turn * column(_at.dual, j);
      rows.slave[k] = -turned * _p.slave.n.transpose();
      rows.target[k].setZero();
    }
    return rows;
  }

  /// The target's normal turns with it as the slave's does  [theory (2.14)]
  template <int R>
  void add_frame(const Mat<R, D>& by_n, Rows<R>& rows) const
  {
    if (not _target_moves)
      return;
    for (int j = 0; j < T; ++j)
    {
      const Vec<R> turned = by_n * column(_at.frame.dual, j);
      rows.target[static_cast<std::size_t>(1 + j)] +=
          turned * _at.frame.n.transpose();
    }
  }

  /// The slide turns with the target, with half of the spin and with the tilt
  template <int R>
  void add_slip(const Mat<R, D>& by_w, Rows<R>& rows) const
  {
    const SpinSlopes<D>& spin = _at.slip.spin;
    const TiltSlopes<D>& tilt = _at.slip.tilt;
    const Mat<R, D> by_turned = by_w * tilt.by_slide;
    if (_target_moves)
    {
      add_to_target<R>(_p.old.slide, spin.before(by_turned), rows);
      add_to_target<R>(_p.old.tilt.carried, by_w * tilt.by_carried, rows);
    }
    if constexpr (D == 3)
      add_angle<R>(by_turned * spin.by_angle, rows);
  }

  template <int R>
  void add_spring(const Mat<R, D>& by_spring, Rows<R>& rows) const
  {
    add_turned<R, D>(_p.old.spring, by_spring, _p.slave, _at.dual, rows.slave);
  }

  /// Fields and multiplier do not depend on displacements
  template <int R, class Slopes>
  void add_fields(const Slopes&, const Vec<R>&, Rows<R>&) const
  {
  }

private:
  template <int R>
  void add_to_target(const ConvectedVector<D>& c, const Mat<R, D>& by_value,
                     Rows<R>& rows) const
  {
    add_convected<R, D>(c, by_value, _p.old.master.now.n, _at.slip.dual,
                        rows.target);
  }

  /// The slave's normal aside
  template <int R>
  void add_angle(const Vec<R>& by_angle, Rows<R>& rows) const
  {
    const Spin<3>& spin = _p.old.spin;
    const SpinSlopes<3>& by = _at.slip.spin;
    rows.slave[1] += by_angle * by.by_first_now.transpose();
    for (int j = 0; j < T; ++j)
      rows.slave[static_cast<std::size_t>(1 + j)] +=
          (spin.across[j] * by_angle) * by.by_second_now.transpose();
    if (not _target_moves)
      return;
    add_to_target<R>(spin.first, by_angle * by.by_first.transpose(), rows);
    add_to_target<R>(spin.second, by_angle * by.by_second.transpose(), rows);
  }

  const HitPoint<D, Law>& _p;
  const HitSlopes<D, Law>& _at;
  bool _target_moves;
};

/// @brief Coordinates xi of the slave facet: the slave varies by its own
/// tangents, the master not at all  [theory (3.11)].
template <int D, class Law>
class FacetColumns
{
public:
  static constexpr int T = D - 1;
  static constexpr int M = HitPoint<D, Law>::M;

  /// @param[in] bend Of the slave
  /// @param[in] log_gamma Derivative of the coefficient's logarithm
  /// @param[in] lam That of the multiplier
  FacetColumns(const TaylorData<D>& e, const ElementPoint& q,
               const HitPoint<D, Law>& p, const HitSlopes<D, Law>& at,
               const Curvature<D>& bend, const Mat<1, T>& log_gamma,
               const Mat<M, T>& lam)
      : _e(e), _q(q), _p(p), _at(at), _bend(bend), _log_gamma(log_gamma),
        _lam(lam), _offset(along<1>(e.offset.transpose()))
  {
  }

  /// Variation of the hit point
  [[nodiscard]] Mat<T, T> eta() const
  {
    const Mat<T, D> rho = _at.ray.template topRows<T>();
    return rho * (_p.slave.t + _q.g * _bend.n);
  }

  template <int R>
  [[nodiscard]] Mat<R, T> ray(const Mat<R, D>& by_turn,
                              const Mat<R, D>& by_ends) const
  {
    return by_turn * _bend.n - by_ends * _p.slave.t;
  }

  /// The master stays
  template <int R>
  void add_frame(const Mat<R, D>&, Mat<R, T>&) const
  {
  }

  /// The accepted step is another one at the next point
  template <int R>
  void add_slip(const Mat<R, D>& by_w, Mat<R, T>& rows) const
  {
    const OldPoint<D, true>& was = _p.old;
    Mat<D, T> w = -_at.slip.by_distance * was.slave.old.t +
                  was.closing.by_old * was.normal * _offset;
    // The slave's old normal, which tells slide and gap apart, turns as well
    if (_e.slave_bends)
    {
      const Curvature<D> bend = old_bend();
      if (not _at.frame.of_target)
        w += slip_by_turn<D>(was, _at.slip.carry, bend.n);
      else if (_p.has_couple())
        w -= _p.g * _at.slip.by_slide * bend.n;
      w += _at.slip.tilt.by_carried * (_at.slip.convected * bend.n);
      if constexpr (D == 3)
        w += _at.slip.tilt.by_slide * _at.slip.spin.by_angle *
             angle_along_facet(was.spin, _at.slip.spin, {was.slave.old, bend},
                               was.slave.old_dual, {_p.slave, _bend},
                               _at.slip.convected);
    }
    rows += by_w * w;
  }

  template <int R>
  void add_spring(const Mat<R, D>& by_spring, Mat<R, T>& rows) const
  {
    const OldPoint<D, true>& was = _p.old;
    Mat<D, T> spring = turned_with_facet<D>(
        was.spring, {was.slave.old, old_bend()}, was.slave.old_dual,
        {_p.slave, _bend}, was.accepted, along<D>(_e.history.traction_old));
    if (_p.springs_hold_lengths())
      spring += was.spring.value() * _log_gamma;
    rows += by_spring * spring;
  }

  /// A law takes gamma as a factor of gap and slip, so that a change of gamma
  /// counts as one of these, but for what a law of the slip rate or elastic
  /// slip takes without that factor
  template <int R, class Slopes>
  void add_fields(const Slopes& law, const Vec<R>& by_g, Mat<R, T>& rows) const
  {
    rows += by_g * _offset;
    Vec<R> by_log_gamma = _p.gap * law.by_g;
    if constexpr (requires { law.by_w; })
    {
      by_log_gamma += law.by_w * _p.old.w - law.by_rate;
      if (_e.history.has_coefficient)
        rows +=
            law.by_coefficient * along<1>(_e.history.coefficient.transpose());
      else
        for (int j = 0; j < T; ++j)
          set_column(rows, j,
                     column(rows, j) +
                         _q.bound.s_xi[static_cast<std::size_t>(j)] *
                             law.by_coefficient);
    }
    rows += by_log_gamma * _log_gamma;
    if constexpr (M > 0)
      rows += law.by_lam * _lam;
    if constexpr (M > 0 and requires { law.by_spring; })
      if (_e.history.has_kept)
        rows += law.by_spring / _p.gamma * along<D>(_e.history.kept);
  }

private:
  [[nodiscard]] Curvature<D> old_bend() const
  {
    const TwoFrames<D>& slave = _p.old.slave;
    return _e.slave_bends ? curvature_of<D>(_e.history.slave_old, slave.old,
                                            slave.old_dual)
                          : no_curvature<D>();
  }

  /// Derivative of a field along the facet
  template <int R>
  [[nodiscard]] static Mat<R, T> along(const Mat<R, D>& coefficients)
  {
    return coefficients.template rightCols<T>();
  }

  const TaylorData<D>& _e;
  const ElementPoint& _q;
  const HitPoint<D, Law>& _p;
  const HitSlopes<D, Law>& _at;
  const Curvature<D>& _bend;
  const Mat<1, T>& _log_gamma;
  const Mat<M, T>& _lam;
  Mat<1, T> _offset;
};
} // namespace raymortar
