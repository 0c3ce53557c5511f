// The chain rule of a point: from what a law varies with to the dofs of an
// element, and to the coordinates of the slave facet.
#pragma once

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
template <class F, int L, class Law>
[[nodiscard]] auto traction_slopes(const HitPoint<F, L, Law>& p)
{
  constexpr int D = F::gdim, M = ElementLayout<F, L, Law>::components;
  const auto& r = p.response;
  if constexpr (is_frictional<Law> and M == 0)
    return LawSlopes<D, D, M, true>{r.t_n,      r.t_g,           r.t_lam, r.t_w,
                                    r.t_spring, r.t_coefficient, r.t_rate};
  else
    return LawSlopes<D, D, M, false>{r.t_n, r.t_g, r.t_lam};
}

/// @brief Those of the multiplier's residual; its springs hold lengths.
template <class F, int L, class Law>
[[nodiscard]] auto condition_slopes(const HitPoint<F, L, Law>& p)
{
  constexpr int D = F::gdim, M = ElementLayout<F, L, Law>::components;
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
/// dofs and coordinates of the facet is what the columns say:
///   ray(by_turn, by_ends)    by_turn dn + by_ends (du_m - du_s)
///   add_frame(by_n, rows)    what the frame of what is hit does besides
///   add_slip(by_w, rows)     what the slip does where both ends stay
///   add_spring(by_s, rows)   what the springs do
///   add_fields(slopes, by_g, rows)  fields on the slave, and its multiplier
template <int R, class Slopes, class F, int L, class Law, class Columns>
[[nodiscard]] auto chain(const Slopes& law, const HitPoint<F, L, Law>& p,
                         const HitSlopes<F, L, Law>& at, const Columns& columns)
{
  constexpr int D = F::gdim;
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
        by_g -= law.by_w * (at.slip.by_slide * p.old.frame.n);
      else
      {
        const Vec<R> by_normal = law.by_w * p.normal;
        by_g -= law.by_w * p.slave.n - along * by_normal;
        by_n += p.g * (by_normal * p.slave.n.transpose() + along * law.by_w);
        by_turn_of_arm = p.g * (by_normal * p.normal.transpose() - law.by_w);
      }
    }
  }
  const Mat<1, D> along_ray = at.vary.dual.row(D - 1);
  Mat<R, D> by_ends = by_g * along_ray;
  if constexpr (requires { law.by_w; })
  {
    const Mat<D - 1, D> rho = at.vary.dual.template topRows<D - 1>();
    by_ends -= (law.by_w * at.slip.by_eta) * rho;
  }
  if (at.frame.of_target)
    by_ends += by_n * at.frame.by_ends;
  Mat<R, D> by_turn = -at.vary.g * by_ends;
  if (at.frame.of_target)
    by_turn += (p.g * by_gap) * p.normal.transpose() + by_turn_of_arm;
  else
    by_turn += by_n;
  if constexpr (D == 3 and requires { law.by_w; })
    by_turn += law.by_w * at.slip.spin.by_n;
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

/// @brief Displacement dofs of an element, [slave | master].
template <class F, int L, class Law>
class DofColumns
{
public:
  static constexpr int D = F::gdim;
  static constexpr int side = Variations<F>::side;

  /// Derivatives by C dofs, stored as those of a tangent are
  template <int R, int C>
  using Rows =
      Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

  DofColumns(const HitPoint<F, L, Law>& p, const HitSlopes<F, L, Law>& at)
      : _p(p), _at(at)
  {
  }

  /// The normal's variation has rank one per node  [theory (2.5)]
  template <int R>
  [[nodiscard]] Rows<R, 2 * side> ray(const Mat<R, D>& by_turn,
                                      const Mat<R, D>& by_ends) const
  {
    const PointGeometry<F>& g = _at.geometry;
    Rows<R, 2 * side> rows;
    const Mat<R, F::dofs> turned = by_turn * g.G_s;
    for (int r = 0; r < R; ++r)
    {
      const Vec<D> ends = row_of(by_ends, r);
      for (int a = 0; a < F::dofs; ++a)
      {
        put<D>(-turned(r, a) * g.slave.n - g.N_s[a] * ends,
               half(rows, r, 0) + a * D);
        put<D>(g.N_m[a] * ends, half(rows, r, 1) + a * D);
      }
    }
    return rows;
  }

  /// Typed facets use the slave's frame: nothing to add
  template <int R>
  void add_frame(const Mat<R, D>&, Rows<R, 2 * side>&) const
  {
  }

  /// The slide turns with the master, and with half of the spin
  template <int R>
  void add_slip(const Mat<R, D>& by_w, Rows<R, 2 * side>& rows) const
  {
    const Frame<D>& master = _p.old.master.now;
    const SpinSlopes<D>& spin = _at.slip.spin;
    const SideRows<F, R> slide =
        vary_convected<F, R>(_p.old.slide, spin.before(by_w), master,
                             _at.slip.dual, _at.geometry.dN_m);
    for (int r = 0; r < R; ++r)
      add_scaled<side>(1.0, slide.data() + r * side, half(rows, r, 1));
    if constexpr (D == 3)
    {
      const auto angle =
          vary_angle<F>(_p.old.spin, spin, _at.geometry, master, _at.slip.dual);
      const Vec<R> by_angle = by_w * spin.by_angle;
      for (int r = 0; r < R; ++r)
        add_scaled<2 * side>(by_angle[r], angle.data(), half(rows, r, 0));
    }
  }

  template <int R>
  void add_spring(const Mat<R, D>& by_spring, Rows<R, 2 * side>& rows) const
  {
    const SideRows<F, R> spring =
        vary_turned<F, R>(_p.old.spring, by_spring, _at.geometry);
    for (int r = 0; r < R; ++r)
      add_scaled<side>(1.0, spring.data() + r * side, half(rows, r, 0));
  }

  /// Fields and multiplier do not depend on displacements
  template <int R, class Slopes>
  void add_fields(const Slopes&, const Vec<R>&, Rows<R, 2 * side>&) const
  {
  }

private:
  /// The slave's part of a row, or the master's
  template <int R>
  [[nodiscard]] static double* half(Rows<R, 2 * side>& rows, int r, int of)
  {
    return rows.data() + (2 * r + of) * side;
  }

  const HitPoint<F, L, Law>& _p;
  const HitSlopes<F, L, Law>& _at;
};

/// @brief Coordinates xi of the slave facet: the slave varies by its own
/// tangents, the master not at all  [theory (3.11)].
template <class F, int L, class Law>
class FacetColumns
{
public:
  using Data = ElementData<F, L, Law>;
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  static constexpr int M = ElementLayout<F, L, Law>::components;

  /// @param[in] bend Of the slave
  /// @param[in] log_gamma Derivative of the coefficient's logarithm
  /// @param[in] lam That of the multiplier
  FacetColumns(const Data& e, const ElementPoint<F>& q,
               const HitPoint<F, L, Law>& p, const HitSlopes<F, L, Law>& at,
               const Curvature<D>& bend, const Mat<1, T>& log_gamma,
               const Mat<M, T>& lam)
      : _e(e), _q(q), _p(p), _at(at), _bend(bend), _log_gamma(log_gamma),
        _lam(lam), _offset(at.template along<1>(e.offset.transpose()))
  {
  }

  /// Variation of the hit point
  [[nodiscard]] Mat<T, T> eta() const
  {
    const Mat<T, D> rho = _at.vary.dual.template topRows<T>();
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
    const OldPoint<F, true>& was = _p.old;
    Mat<D, T> w = -_at.slip.by_distance * was.frame.t +
                  was.closing.by_old * was.normal * _offset;
    if constexpr (not F::affine)
    {
      if (not bends_at_slave(_e))
      {
        rows += by_w * w;
        return;
      }
      // The slave's old normal, which tells slide and gap apart, turns as well
      const Curvature<D> bend = old_bend();
      if (not _at.frame.of_target)
        w += slip_by_turn<F>(was, _at.slip.carry, bend.n);
      else if (_p.has_couple())
        w -= _p.g * _at.slip.by_slide * bend.n;
      if constexpr (D == 3)
        w += _at.slip.spin.by_angle *
             angle_along_facet(was.spin, _at.slip.spin, {was.frame, bend},
                               was.dual, {_p.slave, _bend}, _at.slip.convected);
    }
    rows += by_w * w;
  }

  template <int R>
  void add_spring(const Mat<R, D>& by_spring, Mat<R, T>& rows) const
  {
    const OldPoint<F, true>& was = _p.old;
    Mat<D, T> spring = turned_with_facet<D, F::affine>(
        was.spring, {was.frame, old_bend()}, was.dual, {_p.slave, _bend},
        was.accepted, _at.template along<D>(_e.history.traction_old));
    if constexpr (M > 0) // held as lengths
      spring += was.spring.value() * _log_gamma;
    rows += by_spring * spring;
  }

  /// A law takes gamma as a factor of gap and slip, so that a change of gamma
  /// counts as one of these; what a law of the slip rate takes of the slip has
  /// no such factor
  template <int R, class Slopes>
  void add_fields(const Slopes& law, const Vec<R>& by_g, Mat<R, T>& rows) const
  {
    rows += by_g * _offset;
    Vec<R> by_log_gamma = _p.gap * law.by_g;
    if constexpr (requires { law.by_w; })
    {
      by_log_gamma += law.by_w * _p.old.w - law.by_rate;
      if (_e.history.has_coefficient)
        rows += law.by_coefficient *
                _at.template along<1>(_e.history.coefficient.transpose());
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
        rows +=
            law.by_spring / _p.gamma * _at.template along<D>(_e.history.kept);
  }

private:
  [[nodiscard]] Curvature<D> old_bend() const
  {
    return curvature_at<F>(_e.history.slave_old, _q.xi, _p.old.frame,
                           _p.old.dual);
  }

  const Data& _e;
  const ElementPoint<F>& _q;
  const HitPoint<F, L, Law>& _p;
  const HitSlopes<F, L, Law>& _at;
  const Curvature<D>& _bend;
  const Mat<1, T>& _log_gamma;
  const Mat<M, T>& _lam;
  Mat<1, T> _offset;
};
} // namespace raymortar
