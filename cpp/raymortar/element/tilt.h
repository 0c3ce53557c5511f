// By how much the slave has tilted against the master in a step.
#pragma once

#include "raymortar/element/convected.h"
#include "raymortar/element/facet_states.h"
#include <algorithm>

namespace raymortar
{
/// @brief Turns a slide by half of the tilt of a step, and makes it longer
/// [theory (2.17)]: the slide around a round surface is the chord of an arc,
/// whose ends have other tangent planes.
template <int D>
struct Tilt
{
  ConvectedVector<D> carried; ///< slave's old normal, carried by the master
  double length;              ///< of that
  Vec<D> a;                   ///< its direction
  Vec<D> n;                   ///< slave's present normal
  double between;             ///< cosine of the angle between them
  double half;                ///< that of half the angle
  double arc;                 ///< length of the arc over the chord
  Mat<D, D> turn;             ///< by half the angle, from a to n; times that

  /// @param[in] slave, master Of the point and of what it hits
  void set(const TwoFrames<D>& slave, const TwoFrames<D>& master)
  {
    carried = convect<D>(master.old, master.old_dual, master.now, slave.old.n);
    length = carried.value.norm();
    a = carried.value / length;
    n = slave.now.n;
    between = a.dot(n);
    // Of normals that are opposite no way is the shorter one
    half = std::sqrt(std::max(0.5 * (1.0 + between), smallest));
    set_arc();
    const Mat<D, D> a_n = a * n.transpose(), n_a = a_n.transpose();
    turn = -shrink() *
               (a * a.transpose() + n * n.transpose() - between * (a_n + n_a)) +
           0.5 / half * (n_a - a_n);
    turn.diagonal().array() += 1.0;
    turn *= arc;
  }

  /// @brief Derivative of turn * v by n.
  [[nodiscard]] Mat<D, D> by_normal(const Vec<D>& v) const
  {
    return slope(a, n, v, 1.0);
  }
  /// @brief The same by what is carried.
  [[nodiscard]] Mat<D, D> by_carried(const Vec<D>& v) const
  {
    const Mat<D, D> by_a = slope(n, a, v, -1.0) / length;
    return by_a - by_a * a * a.transpose();
  }

private:
  static constexpr double smallest = 1e-12;
  double _arc_slope; ///< derivative of the arc's logarithm by the cosine

  void set_arc()
  {
    const double s = 1.0 - half * half; // sin^2 of half the angle
    double slope;                       // by `half`
    if (s < 1e-4)
    {
      arc = 1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * 5.0 / 112.0));
      slope = -half * (1.0 / 3.0 + s * (0.3 + s * 15.0 / 56.0));
    }
    else
    {
      arc = std::acos(half) / std::sqrt(s);
      slope = (half * arc - 1.0) / s;
    }
    _arc_slope = 0.25 * slope / (half * arc);
  }

  /// (1 - cos) / sin^2 of half the angle over the whole one
  [[nodiscard]] double shrink() const
  {
    return 0.25 / (half * half * (1.0 + half));
  }

  /// By q, of a turn from p to q (sign 1) or from q to p (-1)
  [[nodiscard]] Mat<D, D> slope(const Vec<D>& p, const Vec<D>& q,
                                const Vec<D>& v, double sign) const
  {
    const double v_p = v.dot(p), v_q = v.dot(q), k = shrink();
    const Vec<D> mixed = p * v_q + q * v_p;
    const Vec<D> whole = p * v_p + q * v_q - between * mixed;
    const Vec<D> across = q * v_p - p * v_q;
    const double by_half = k * (2.0 + 3.0 * half) / (half * (1.0 + half));
    const Vec<D> by_cosine = 0.25 * by_half / half * whole + k * mixed -
                             (0.125 * sign / (half * half * half)) * across;
    Mat<D, D> by = by_cosine * p.transpose();
    by -= (k * q + 0.5 * sign / half * p - k * between * p) * v.transpose();
    by.diagonal().array() +=
        0.5 * sign / half * v_p - k * (v_q - between * v_p);
    return arc * by + (_arc_slope * (turn * v)) * p.transpose();
  }
};
} // namespace raymortar
