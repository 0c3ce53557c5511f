// Rotation of the slave against the master about the slave's normal.
#pragma once

#include "raymortar/element/convected.h"
#include "raymortar/element/turned_traction.h"
#include "raymortar/element/two_frames.h"

namespace raymortar
{
/// @brief Turns a slide by half of the spin of a step  [theory (2.15)]: the
/// slide is a chord, and the arc on which a body spins ends in another
/// direction and is longer. In the plane there is no spin.
template <int D>
struct Spin
{
  void set(const TwoFrames<D>&, const TwoFrames<D>&) {}
  [[nodiscard]] const Vec<D>& turned(const Vec<D>& slide) const
  {
    return slide;
  }
};

template <>
struct Spin<3>
{
  double half;               ///< of the angle
  double along;              ///< half / tan(half)
  double by_half;            ///< the derivative of that
  Vec<3> n;                  ///< slave's present normal
  Vec<2> across;             ///< n_0 x t_01 on the slave's old tangents t_0
  Vec<3> of_slave;           ///< t_01 turned with the slave, of any length
  Vec<3> of_master;          ///< t_01 turned with the master
  ConvectedVector<3> first;  ///< t_01 carried along by the master
  ConvectedVector<3> second; ///< n_0 x t_01

  /// @param[in] slave, master Of the point and of what it hits
  void set(const TwoFrames<3>& slave, const TwoFrames<3>& master)
  {
    n = slave.now.n;
    const Vec<3> t_2 = slave.old.jacobian * column(slave.old_dual, 1);
    across = slave.old_dual.transpose() * t_2;
    of_slave = column(slave.now.t, 0) - cross(n, slave.now.t * across);
    first = convect<3>(master.old, master.old_dual, master.now,
                       column(slave.old.t, 0));
    second = convect<3>(master.old, master.old_dual, master.now, t_2);
    of_master = first.value - cross(n, second.value);
    set_half(0.5 * std::atan2(n.dot(of_master.cross(of_slave)),
                              dot<3>(of_master, of_slave)));
  }

  /// Rotation by half the angle, times the arc per chord, half / sin(half)
  [[nodiscard]] Vec<3> turned(const Vec<3>& slide) const
  {
    return along * slide + half * n.cross(slide);
  }

private:
  void set_half(double angle)
  {
    constexpr double small = 0.1; // the next terms of the series are rounding
    half = angle;
    const double s = half * half;
    if (std::abs(half) < small)
    {
      along =
          1.0 -
          s / 3.0 * (1.0 + s / 15.0 * (1.0 + 2.0 / 21.0 * s * (1.0 + 0.1 * s)));
      by_half =
          -half * 2.0 / 3.0 *
          (1.0 + 2.0 / 15.0 * s * (1.0 + s / 7.0 * (1.0 + 2.0 / 15.0 * s)));
      return;
    }
    const double sine = std::sin(half), cosine = std::cos(half);
    along = half * cosine / sine;
    by_half = (sine * cosine - half) / (sine * sine);
  }
};

/// @brief How a turned slide changes with the slide and with the spin.
template <int D>
struct SpinSlopes
{
  SpinSlopes(const Spin<D>&, const Vec<D>&) {}
  template <class Matrix>
  [[nodiscard]] Matrix before(const Matrix& by_turned) const
  {
    return by_turned;
  }
  template <class Matrix>
  [[nodiscard]] Matrix after(const Matrix& slides) const
  {
    return slides;
  }
};

template <>
struct SpinSlopes<3>
{
  Mat<3, 3> by_slide;
  Vec<3> by_angle;
  Mat<3, 3> by_n; ///< by the slave's normal
  // Derivatives of the angle
  Vec<3> by_first_now;  ///< by the slave's first tangent
  Vec<3> by_second_now; ///< by what its tangents make of `across`
  Vec<3> by_first;      ///< by what the master carries along
  Vec<3> by_second;

  SpinSlopes(const Spin<3>& spin, const Vec<3>& slide)
  {
    const Vec<3>& n = spin.n;
    by_slide = spin.half * cross_matrix(n);
    add_to_diagonal(by_slide, spin.along);
    by_angle = 0.5 * (n.cross(slide) + spin.by_half * slide);
    const Vec<3> beside = n.cross(spin.of_master);
    const double own = 1.0 / spin.of_slave.squaredNorm();
    const double other = 1.0 / beside.squaredNorm();
    by_first_now = own * n.cross(spin.of_slave);
    by_second_now = -own * spin.of_slave;
    by_first = -other * beside;
    by_second = other * beside.cross(n);
    by_n = -spin.half * cross_matrix(slide);
    const Vec<3> turn = n.dot(spin.first.value) * by_first +
                        n.dot(spin.second.value) * by_second;
    by_n -= by_angle * turn.transpose();
  }

  /// @brief Derivatives by a slide from those by what it turns to.
  template <class Matrix>
  [[nodiscard]] Matrix before(const Matrix& by_turned) const
  {
    return by_turned * by_slide;
  }
  /// @brief What slides, as columns, turn to.
  template <class Matrix>
  [[nodiscard]] Matrix after(const Matrix& slides) const
  {
    return by_slide * slides;
  }
};

/// @brief Derivative of the angle along the slave facet, its normal and the
/// point that is hit aside.
/// @param[in] carry What takes the master's old vectors to present ones
[[nodiscard]] inline Mat<1, 2>
angle_along_facet(const Spin<3>& spin, const SpinSlopes<3>& by,
                  const BentFrame<3>& old, const Mat<3, 2>& old_dual,
                  const BentFrame<3>& now, const Mat<3, 3>& carry)
{
  Mat<1, 2> rate;
  const Vec<3> t_1 = column(old.frame.t, 0);
  for (int j = 0; j < 2; ++j)
  {
    const auto k = static_cast<std::size_t>(j);
    const Vec<3> dt_1 = column(old.bend.t[k], 0);
    const Vec<3> dt_2 =
        cross(column(old.bend.n, j), t_1) + cross(old.frame.n, dt_1);
    const Vec<2> dacross =
        old_dual.transpose() * (dt_2 - old.bend.t[k] * spin.across);
    rate[j] = by.by_first_now.dot(column(now.bend.t[k], 0)) +
              by.by_second_now.dot(now.bend.t[k] * spin.across +
                                   now.frame.t * dacross) +
              by.by_first.dot(carry * dt_1) + by.by_second.dot(carry * dt_2);
  }
  return rate;
}
} // namespace raymortar
