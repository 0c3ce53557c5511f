// Tilt of the slave against the master in a step: a slide around a bend
// is as long as its arc.
#pragma once

#include "raymortar/element/convected.h"
#include "raymortar/element/two_frames.h"

namespace raymortar
{
/// @brief A series in the square of a sine, and its derivative.
struct ArcSeries
{
  double value = 0.0;
  double slope = 0.0;
};

/// @brief Factors of the powers of x in missing_arc. At 45 degrees the rest is
/// a thousandth of the slide.
[[nodiscard]] constexpr std::array<double, 8> arc_factors(bool of_target)
{
  std::array<double, 8> factors{};
  double factor = 1.0;
  for (std::size_t k = 0; k < factors.size(); ++k)
  {
    const double n = 2.0 * static_cast<double>(k);
    factor *= of_target ? (n + 1.0) * (n + 1.0) / ((n + 2.0) * (n + 3.0))
                        : (n + 2.0) / (n + 3.0);
    factors[k] = factor;
  }
  return factors;
}

/// @brief Share by which a slide is too short, over the square x of the sine of
/// the angle a by which the path bends  [theory (2.17)].
///
/// In the slave's frame a / (sin a cos a) - 1, in the target's a / sin a - 1.
/// @param[in] of_target Whether the frame is the target's
[[nodiscard]] inline ArcSeries missing_arc(double x, bool of_target)
{
  constexpr auto of_slave = arc_factors(false), ahead = arc_factors(true);
  const auto& factors = of_target ? ahead : of_slave;
  ArcSeries sum;
  for (std::size_t k = factors.size(); k-- > 0;)
  {
    sum.slope = sum.slope * x + sum.value;
    sum.value = sum.value * x + factors[k];
  }
  return sum;
}

/// @brief Tilt of the slave's normal against the one that the master has
/// carried along from the accepted step.
///
/// A slide is the path of a point relative to the master, which is an arc where
/// the slave tilts: the slide, a chord projected on the old surface, is made as
/// long as that arc, in the direction of the tilt  [theory (2.17)].
template <int D>
struct Tilt
{
  ConvectedVector<D> carried; ///< the slave's old normal
  Vec<D> unit;                ///< its direction
  Vec<D> n;                   ///< slave's present normal
  Vec<D> across;              ///< part of the direction along the surface
  ArcSeries arc;

  /// @param[in] old_normal, now Of the slave
  /// @param[in] master Of the point that is hit
  void set(const Vec<D>& old_normal, const Vec<D>& now,
           const TwoFrames<D>& master, bool of_target)
  {
    n = now;
    carried = convect<D>(master.old, master.old_dual, master.now, old_normal);
    unit = carried.value / length<D>(carried.value);
    across = unit - dot<D>(n, unit) * n;
    arc = missing_arc(dot<D>(across, across), of_target);
  }

  [[nodiscard]] Vec<D> lengthened(const Vec<D>& slide) const
  {
    return slide + arc.value * dot<D>(across, slide) * across;
  }
};

/// @brief How a lengthened slide changes with the slide and with the tilt.
template <int D>
struct TiltSlopes
{
  Mat<D, D> by_slide;
  Mat<D, D> by_carried;
  Mat<D, D> by_n; ///< by the slave's normal

  TiltSlopes(const Tilt<D>& tilt, const Vec<D>& slide)
  {
    const Vec<D>&m = tilt.across, &n = tilt.n;
    const double along = dot<D>(m, slide), f = tilt.arc.value;
    by_slide = f * m * m.transpose();
    add_to_diagonal(by_slide, 1.0);
    Mat<D, D> by_across =
        m * (2.0 * tilt.arc.slope * along * m + f * slide).transpose();
    add_to_diagonal(by_across, f * along);
    const Vec<D> by_along = by_across * n;
    const Vec<D>& unit = tilt.unit;
    by_n = -by_along * unit.transpose() - dot<D>(n, unit) * by_across;
    const Mat<D, D> by_unit = by_across - by_along * n.transpose();
    by_carried = (by_unit - by_unit * unit * unit.transpose()) /
                 length<D>(tilt.carried.value);
  }
};
} // namespace raymortar
