// The accepted step at a point, and how the slip since then varies.
#pragma once

#include "raymortar/element/convected.h"
#include "raymortar/element/element_states.h"
#include "raymortar/element/turned_traction.h"

namespace raymortar
{
/// @brief The accepted step at a point; nothing without friction.
template <class F, bool Frictional>
struct OldPoint
{
};

template <class F>
struct OldPoint<F, true>
{
  Frame<F::gdim> frame;       ///< of the slave
  Mat<F::gdim, F::tdim> dual; ///< of its tangents
  Vec<F::gdim> normal;        ///< of the law's frame
  TwoFrames<F::gdim> master;  ///< of the point that is hit now
  Vec<F::gdim> distance;      ///< from the slave's point to the master's
  Vec<F::gdim> ahead;         ///< the same from the end of the present arm
  /// Mean of the frame's normal and the master's reversed one. The distance
  /// between two points of one circle has no part along that of both surfaces,
  /// so that curvature is not taken for a gap
  Vec<F::gdim> across;
  Closing closing;
  ConvectedVector<F::gdim> slide; ///< distance along the slave, carried along
  Spin<F::gdim> spin;             ///< of the slave against the master
  Vec<F::gdim> w;                 ///< slip increment (2)
  Vec<F::gdim> accepted;          ///< of springs, see ContactState
  TurnedTraction<F::gdim> spring; ///< made of it
};

/// @brief How the slip changes where the old normal of the frame turns.
/// @param[in] carry Old vectors to present ones
/// @param[in] turn Change of the normal, along some coordinates
template <class F>
[[nodiscard]] Mat<F::gdim, F::tdim>
slip_by_turn(const OldPoint<F, true>& was, const Mat<F::gdim, F::gdim>& carry,
             const Mat<F::gdim, F::tdim>& turn)
{
  const Mat<1, F::tdim> along = was.ahead.transpose() * turn;
  const Mat<F::gdim, F::tdim> turned =
      dot<F::gdim>(was.normal, was.ahead) * turn + was.normal * along;
  return was.closing.length * turn - carry * turned +
         0.5 * was.closing.by_old * was.normal *
             (was.distance.transpose() * turn);
}

/// @brief How the slip changes with the point that is hit, and with its master.
template <class F, bool Frictional>
struct SlipSlopes
{
};

template <class F>
struct SlipSlopes<F, true>
{
  static constexpr int D = F::gdim;
  Mat<D, F::tdim> dual; ///< of the master's tangents
  SpinSlopes<D> spin;
  Mat<D, D> convected; ///< old vectors to present ones, along the master
  Mat<D, D> carry;     ///< the same for a slide, with half of the spin
  Mat<D, D> by_slide;  ///< by `ahead`, but for what has closed
  Mat<D, D> by_distance;
  Mat<D, F::tdim> by_eta;

  /// @param[in] of_target Whether the frame is the master's  [theory (2.9)]
  /// @param[in] bends Whether tangents and normal of the master change along it
  SlipSlopes(const typename F::NodeMatrix& master_nodes,
             const typename F::NodeMatrix& master_old, const ElementPoint<F>& q,
             const OldPoint<F, true>& was, bool of_target, bool bends)
      : dual(dual_tangents<D>(was.master.now)), spin(was.spin, was.slide.value),
        convected(
            convection<D>(was.master.old, was.master.old_dual, was.master.now)),
        carry(spin.after(convected)),
        by_slide(carry - carry * was.normal * was.normal.transpose()),
        by_distance(by_slide)
  {
    if (was.closing.by_old != 0.0)
      by_distance += was.closing.by_old * was.normal * was.across.transpose();
    by_eta = by_distance * was.master.old.t;
    if constexpr (not F::affine)
    {
      if (not bends)
        return;
      const NodeBends<F> second = node_bends<F>(q.eta);
      const Curvature<D> old = curvature_at<F>(
          master_old, second, was.master.old, was.master.old_dual);
      const Curvature<D> now =
          curvature_at<F>(master_nodes, second, was.master.now, dual);
      const auto along = [&](const ConvectedVector<D>& c)
      { return convected_along_master<F>(c, convected, old, now); };
      by_eta += spin.after(along(was.slide));
      if constexpr (D == 3)
        by_eta += spin.by_angle *
                  (spin.by_first.transpose() * along(was.spin.first) +
                   spin.by_second.transpose() * along(was.spin.second));
      by_eta -= 0.5 * was.closing.by_old * was.normal *
                (was.distance.transpose() * old.n);
      if (of_target)
        by_eta += slip_by_turn<F>(was, carry, -old.n);
    }
  }
};
} // namespace raymortar
