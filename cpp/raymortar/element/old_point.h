// The accepted step at a point, and how the slip since then varies.
#pragma once

#include "raymortar/element/taylor_data.h"
#include "raymortar/element/tilt.h"

namespace raymortar
{
/// @brief The accepted step at a point; nothing without friction.
template <int D, bool Frictional>
struct OldPoint
{
};

template <int D>
struct OldPoint<D, true>
{
  const TwoFrames<D>& slave;
  const TwoFrames<D>& master; ///< of the point that is hit now
  const Spin<D>& spin;        ///< of the slave against the master
  Vec<D> normal;              ///< of the law's frame
  Vec<D> distance;            ///< from the slave's point to the master's
  Vec<D> ahead;               ///< the same from the end of the present arm
  /// Mean of the frame's normal and the master's reversed one. The distance
  /// between two points of one circle has no part along that of both surfaces,
  /// so that curvature is not taken for a gap
  Vec<D> across;
  Closing closing;
  ConvectedVector<D> slide;  ///< distance along the slave, carried along
  Tilt<D> tilt;              ///< of the slave against the master
  Vec<D> w;                  ///< slip increment (2)
  Vec<D> accepted;           ///< of springs, see ContactState
  TurnedTraction<D> spring;  ///< made of it
  double elastic_slip = 0.0; ///< of the law; springs then hold lengths
  Vec<D> elastic; ///< slip that springs of a multiplier hold besides excess

  explicit OldPoint(const TaylorData<D>& e)
      : slave(e.slave_frames), master(e.master_frames), spin(e.spin)
  {
  }
};

/// @brief How the slip changes where the old normal of the frame turns.
/// @param[in] carry What takes old slides to present ones
/// @param[in] turn Change of the normal, along some coordinates
template <int D>
[[nodiscard]] Mat<D, D - 1> slip_by_turn(const OldPoint<D, true>& was,
                                         const Mat<D, D>& carry,
                                         const Mat<D, D - 1>& turn)
{
  const Mat<1, D - 1> along = was.ahead.transpose() * turn;
  const Mat<D, D - 1> turned =
      dot<D>(was.normal, was.ahead) * turn + was.normal * along;
  return was.closing.length * turn - carry * turned +
         0.5 * was.closing.by_old * was.normal *
             (was.distance.transpose() * turn);
}

/// @brief How the slip changes with the point that is hit, and with its master.
template <int D, bool Frictional>
struct SlipSlopes
{
};

template <int D>
struct SlipSlopes<D, true>
{
  static constexpr int T = D - 1;
  Mat<D, T> dual; ///< of the master's tangents
  SpinSlopes<D> spin;
  TiltSlopes<D> tilt;
  Mat<D, D> convected; ///< old vectors to present ones, along the master
  Mat<D, D> carry;     ///< the same for a slide, with spin and tilt
  Mat<D, D> by_slide;  ///< by `ahead`, but for what has closed
  Mat<D, D> by_distance;
  Mat<D, T> by_eta;

  /// The frame may be the master's  [theory (2.9)]
  SlipSlopes(const TaylorData<D>& e, const OldPoint<D, true>& was)
      : dual(dual_tangents<D>(was.master.now)), spin(was.spin, was.slide.value),
        tilt(was.tilt, was.spin.turned(was.slide.value)),
        convected(
            convection<D>(was.master.old, was.master.old_dual, was.master.now)),
        carry(tilt.by_slide * spin.after(convected)),
        by_slide(carry - carry * was.normal * was.normal.transpose()),
        by_distance(by_slide)
  {
    if (was.closing.by_old != 0.0)
      by_distance += was.closing.by_old * was.normal * was.across.transpose();
    by_eta = by_distance * was.master.old.t;
    if (e.master_bends)
      add_bends(e, was);
  }

private:
  /// Add that tangents and normal of the master change along it
  void add_bends(const TaylorData<D>& e, const OldPoint<D, true>& was)
  {
    const Curvature<D> old = curvature_of<D>(
        e.history.master_old, was.master.old, was.master.old_dual);
    const Curvature<D> now = curvature_of<D>(e.master, was.master.now, dual);
    const auto along = [&](const ConvectedVector<D>& c)
    { return convected_along_master<D>(c, convected, old, now); };
    by_eta += tilt.by_slide * spin.after(along(was.slide)) +
              tilt.by_carried * along(was.tilt.carried);
    if constexpr (D == 3)
      by_eta += tilt.by_slide * spin.by_angle *
                (spin.by_first.transpose() * along(was.spin.first) +
                 spin.by_second.transpose() * along(was.spin.second));
    by_eta -= 0.5 * was.closing.by_old * was.normal *
              (was.distance.transpose() * old.n);
    if (e.frame_of_target)
      by_eta += slip_by_turn<D>(was, carry, -old.n);
  }
};
} // namespace raymortar
