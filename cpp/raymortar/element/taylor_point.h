// Points of Taylor facets: where values, derivatives and frames are known, and
// nothing is to be multiplied with shape functions.
#pragma once

#include "raymortar/element/any_blocks.h"
#include "raymortar/element/rates.h"
#include "raymortar/element/taylor_data.h"

namespace raymortar
{
template <class F, int L, class Law>
requires F::is_taylor struct SlavePoint<F, L, Law>
{
  using Layout = ElementLayout<F, L, Law>;
  using Data = ElementData<F, L, Law>;
  static constexpr int D = F::gdim;
  static constexpr int M = Layout::components;

  Frame<D> slave;
  Vec<M> lam;
  double gamma;
  double weight; ///< area in the measure of integration

  SlavePoint(const Data& e, const ElementPoint<F>& q)
      : slave(e.slave_frames.now), lam(e.lam.template block<M, 1>(0, 0)),
        gamma(e.gamma[0]), weight(area_of(e.measure, q.weight, q.area, slave))
  {
  }
  SlavePoint(const Data& e, const ElementPoint<F>& q, const Frame<D>&,
             const Vec<F::dofs>&)
      : SlavePoint(e, q)
  {
  }

  [[nodiscard]] double value(const Vec<D>& coefficients) const
  {
    return coefficients[0];
  }
  [[nodiscard]] Vec<D> value(const Mat<D, D>& coefficients) const
  {
    return coefficients.col(0);
  }
};

template <class F>
requires F::is_taylor struct FrameSlopes<F> : TargetFrame<F>
{
  static constexpr int D = F::gdim;
  using TargetFrame<F>::of_target;
  Vec<D> n;             ///< of the master
  Mat<D, F::tdim> dual; ///< of its tangents
  Mat<D, F::tdim> bend; ///< derivative of that normal along the master
  Mat<D, D> by_ends;    ///< by what both ends of the ray do, see chain

  /// @param[in] rho Rows of (2.6)
  FrameSlopes(const TaylorData<D>& e, const ElementPoint<F>& q,
              const Mat<F::tdim, D>& rho)
      : TargetFrame<F>(e.frame_of_target)
  {
    if (not of_target)
      return;
    const Frame<D>& frame = e.master_frames.now;
    n = frame.n;
    dual = dual_tangents<D>(frame);
    bend.setZero();
    if (e.master_bends)
      bend = curvature_at<F>(e.master, q.eta, frame, dual).n;
    by_ends = bend * rho;
  }
};

/// Variations of the gap and of the hit point
template <class F>
requires F::is_taylor struct Variations<F>
{
  static constexpr int D = F::gdim;
  static constexpr int side = F::dofs * D;
  double g;
  Mat<D, D> dual; ///< rows rho, dual of the master's tangents, and b of n
};

template <class F, int L, class Law>
requires F::is_taylor struct HitSlopes<F, L, Law>
{
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  Mat<D, T> dual; ///< of the slave's tangents
  Variations<F> vary;
  SlipSlopes<F, is_frictional<Law>> slip;
  FrameSlopes<F> frame;

  HitSlopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
            const HitPoint<F, L, Law>& p)
      : dual(dual_tangents<D>(p.slave)), vary(vary_hit(e, p)),
        slip(slip_slopes(e, q, p)), frame(e, q, vary.dual.template topRows<T>())
  {
  }

  template <int R>
  [[nodiscard]] Mat<R, T> along(const Mat<R, D>& coefficients) const
  {
    return coefficients.template rightCols<T>();
  }

private:
  [[nodiscard]] static Variations<F> vary_hit(const ElementData<F, L, Law>& e,
                                              const HitPoint<F, L, Law>& p)
  {
    Mat<D, D> ends;
    ends.template leftCols<T>() = e.master.template middleCols<T>(1);
    ends.col(T) = p.slave.n;
    return {p.g, ends.inverse()};
  }

  [[nodiscard]] static SlipSlopes<F, is_frictional<Law>>
  slip_slopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
              const HitPoint<F, L, Law>& p)
  {
    if constexpr (is_frictional<Law>)
      return {e.master, e.history.master_old, q,
              p.old,    e.frame_of_target,    e.master_bends};
    else
      return {};
  }
};

/// @brief Taylor coefficients of both displacements, in place of the dofs of
/// DofColumns.
template <class F, int L, class Law>
class TaylorColumns
{
public:
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  template <int R>
  using Rows = TaylorRows<R, D>;

  /// @param[in] target_moves Whether there are rows of the target
  TaylorColumns(const HitPoint<F, L, Law>& p, const HitSlopes<F, L, Law>& at,
                bool target_moves)
      : _p(p), _at(at), _target_moves(target_moves)
  {
  }

  template <int R>
  [[nodiscard]] Rows<R> ray(const Mat<R, D>& by_turn,
                            const Mat<R, D>& by_ends) const
  {
    Rows<R> rows;
    rows.slave[0] = -by_ends;
    rows.target[0] = by_ends;
    for (int j = 0; j < T; ++j)
    {
      const Vec<R> turned = by_turn * column(_at.dual, j);
      slave(rows, j) = -turned * _p.slave.n.transpose();
      target(rows, j).setZero();
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
      target(rows, j) += turned * _at.frame.n.transpose();
    }
  }

  /// The slide turns with the target, and with half of the spin
  template <int R>
  void add_slip(const Mat<R, D>& by_w, Rows<R>& rows) const
  {
    const SpinSlopes<D>& spin = _at.slip.spin;
    if (_target_moves)
      add_convected<R>(_p.old.slide, spin.before(by_w), rows);
    if constexpr (D == 3)
      add_angle<R>(by_w * spin.by_angle, rows);
  }

  /// See vary_turned
  template <int R>
  void add_spring(const Mat<R, D>& by_spring, Rows<R>& rows) const
  {
    const TurnedTraction<D>& c = _p.old.spring;
    const Vec<D>& n = _p.slave.n;
    if (c.whole)
      for (int j = 0; j < T; ++j)
        slave(rows, j) -=
            (c.outward * by_spring * column(_at.dual, j)) * n.transpose();
    if (c.squared == 0.0)
      return;
    const Mat<R, D> by_along = by_spring * c.by_direction();
    for (int j = 0; j < T; ++j)
      slave(rows, j) += c.along[j] * by_along;
    if constexpr (D == 3)
    {
      const Mat<R, D> by_across = by_along * cross_matrix(n);
      const Mat<R, D> by_n =
          by_along * cross_matrix(Vec<D>(_p.slave.t * c.across));
      for (int j = 0; j < T; ++j)
      {
        const Vec<R> turn = by_n * column(_at.dual, j);
        slave(rows, j) -= c.across[j] * by_across + turn * n.transpose();
      }
    }
  }

  /// Fields and multiplier do not depend on displacements
  template <int R, class Slopes>
  void add_fields(const Slopes&, const Vec<R>&, Rows<R>&) const
  {
  }

private:
  template <int R>
  [[nodiscard]] static Mat<R, D>& slave(Rows<R>& rows, int j)
  {
    return rows.slave[static_cast<std::size_t>(1 + j)];
  }
  template <int R>
  [[nodiscard]] static Mat<R, D>& target(Rows<R>& rows, int j)
  {
    return rows.target[static_cast<std::size_t>(1 + j)];
  }

  /// See vary_convected
  template <int R>
  void add_convected(const ConvectedVector<D>& c, const Mat<R, D>& by_value,
                     Rows<R>& rows) const
  {
    const Vec<D>& n = _p.old.master.now.n;
    const Mat<R, T> by_n = c.across * (by_value * _at.slip.dual);
    for (int j = 0; j < T; ++j)
      target(rows, j) +=
          c.along[j] * by_value - column(by_n, j) * n.transpose();
  }

  /// See vary_angle
  template <int R>
  void add_angle(const Vec<R>& by_angle, Rows<R>& rows) const
  {
    const Spin<3>& spin = _p.old.spin;
    const SpinSlopes<3>& by = _at.slip.spin;
    slave(rows, 0) += by_angle * by.by_first_now.transpose();
    for (int j = 0; j < T; ++j)
      slave(rows, j) +=
          (spin.across[j] * by_angle) * by.by_second_now.transpose();
    if (not _target_moves)
      return;
    add_convected<R>(spin.first, by_angle * by.by_first.transpose(), rows);
    add_convected<R>(spin.second, by_angle * by.by_second.transpose(), rows);
  }

  const HitPoint<F, L, Law>& _p;
  const HitSlopes<F, L, Law>& _at;
  bool _target_moves;
};
} // namespace raymortar
