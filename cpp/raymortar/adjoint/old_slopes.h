// Variations of slip and springs at a point by the positions of the accepted
// step.
#pragma once

#include "raymortar/element/any_blocks.h"
#include "raymortar/element/old_point.h"

namespace raymortar
{
/// @brief How a vector that is carried along by the master varies with its old
/// tangent j, the vector aside.
/// @param[in] carry What takes old vectors to present ones
template <int D>
[[nodiscard]] Mat<D, D> carried_by_tangent(const ConvectedVector<D>& c,
                                           const Mat<D, D>& carry,
                                           const TwoFrames<D>& master, int j)
{
  Mat<D, D> by =
      -c.across * column(master.old_dual, j) * master.old.n.transpose();
  add_to_diagonal(by, c.along[j]);
  return -1.0 * (carry * by);
}

/// @brief Derivative of the slip by the Taylor coefficients of the old
/// positions of slave and master  [theory (8.8)].
template <int D>
class OldSlopes
{
public:
  static constexpr int T = D - 1;
  using Rows = TaylorRows<D, D>;

  /// @param[in] slave Present frame of the slave
  /// @param[in] arm Length of the ray where friction makes a couple over it and
  /// the frame is the target's, else 0
  OldSlopes(const OldPoint<D, true>& was, const SlipSlopes<D, true>& by,
            const Frame<D>& slave, bool of_target, double arm)
      : _was(was), _by(by), _slave(slave)
  {
    const Vec<D>& n = was.normal;
    Mat<D, D> by_frame =
        -1.0 * (by.carry * (n * was.ahead.transpose())) +
        0.5 * was.closing.by_old * (n * was.distance.transpose());
    by_frame += -dot<D>(n, was.ahead) * by.carry;
    add_to_diagonal(by_frame, was.closing.length);
    _by_n_s = by.tilt.by_carried * by.convected;
    _by_n_m = -0.5 * was.closing.by_old * (n * was.distance.transpose());
    if (of_target)
    {
      _by_n_s += -arm * by.by_slide;
      _by_n_m += -1.0 * by_frame;
    }
    else
      _by_n_s += by_frame;
  }

  [[nodiscard]] Rows rows() const
  {
    Rows rows;
    rows.slave[0] = -1.0 * _by.by_distance;
    rows.target[0] = _by.by_distance;
    for (int j = 0; j < T; ++j)
    {
      rows.slave[static_cast<std::size_t>(1 + j)] = by_slave(j);
      rows.target[static_cast<std::size_t>(1 + j)] = by_master(j);
    }
    return rows;
  }

private:
  [[nodiscard]] Mat<D, D> by_slave(int j) const
  {
    const Vec<D> turn = -1.0 * column(_was.slave.old_dual, j);
    Mat<D, D> by = (_by_n_s * turn) * _was.slave.old.n.transpose();
    if constexpr (D == 3)
    {
      const Vec<3> by_angle = _by.tilt.by_slide * _by.spin.by_angle;
      by += by_angle * angle_by_slave(j).transpose();
    }
    return by;
  }

  [[nodiscard]] Mat<D, D> by_master(int j) const
  {
    const TwoFrames<D>& master = _was.master;
    const auto carried = [&](const ConvectedVector<D>& c)
    { return carried_by_tangent<D>(c, _by.convected, master, j); };
    const Vec<D> turn = -1.0 * column(master.old_dual, j);
    Mat<D, D> by = (_by_n_m * turn) * master.old.n.transpose();
    by += _by.tilt.by_slide * _by.spin.after(carried(_was.slide));
    by += _by.tilt.by_carried * carried(_was.tilt.carried);
    if constexpr (D == 3)
    {
      const Vec<3> by_angle = _by.tilt.by_slide * _by.spin.by_angle;
      const Vec<3> angle =
          carried(_was.spin.first).transpose() * _by.spin.by_first +
          carried(_was.spin.second).transpose() * _by.spin.by_second;
      by += by_angle * angle.transpose();
    }
    return by;
  }

  /// Derivative of the spin's angle by the slave's old tangent j
  [[nodiscard]] Vec<3> angle_by_slave(int j) const requires(D == 3)
  {
    const Spin<3>& spin = _was.spin;
    const SpinSlopes<3>& by = _by.spin;
    const Vec<3>& n = _was.slave.old.n;
    const Vec<3> t_1 = column(_was.slave.old.t, 0);
    Vec<3> slope;
    for (int i = 0; i < 3; ++i)
    {
      const Vec<3> unit = Vec<3>::Unit(i);
      const Vec<3> dn = -n[i] * column(_was.slave.old_dual, j);
      const Vec<3> dt_1 = j == 0 ? unit : Vec<3>(Vec<3>::Zero());
      const Vec<3> dt_2 = cross(dn, t_1) + cross(n, dt_1);
      const Vec<2> dacross = _was.slave.old_dual.transpose() *
                             Vec<3>(dt_2 - spin.across[j] * unit);
      Vec<3> now = _slave.t * dacross;
      slope[i] = by.by_second_now.dot(now) +
                 by.by_first.dot(_by.convected * dt_1) +
                 by.by_second.dot(_by.convected * dt_2);
    }
    return slope;
  }

  const OldPoint<D, true>& _was;
  const SlipSlopes<D, true>& _by;
  const Frame<D>& _slave;
  Mat<D, D> _by_n_s, _by_n_m; ///< by the old normals of both sides
};

/// @brief Derivative of what springs hold, as the law takes it, by the field of
/// the accepted step: (4.9) is linear.
/// @param[in] slave Its present frame
/// @param[in] whole See carry_traction
template <int D>
[[nodiscard]] Mat<D, D> spring_by_held(const OldPoint<D, true>& was,
                                       const Frame<D>& slave, bool whole)
{
  Mat<D, D> by;
  for (int i = 0; i < D; ++i)
    set_column(by, i,
               carry_traction<D>(was.slave.old, was.slave.old_dual, slave,
                                 Vec<D>(Vec<D>::Unit(i)), whole)
                   .value());
  return by;
}

/// @brief Derivative of what springs hold by the old tangent j of the slave.
/// @param[in] slave Its present frame
template <int D>
[[nodiscard]] Mat<D, D> spring_by_old_tangent(const OldPoint<D, true>& was,
                                              const Frame<D>& slave, int j)
{
  Curvature<D> none, bend;
  for (Curvature<D>* one : {&none, &bend})
  {
    one->t.fill(Mat<D, D - 1>::Zero());
    one->n.setZero();
  }
  const Mat<D, D - 1> held = Mat<D, D - 1>::Zero();
  Mat<D, D> by;
  for (int i = 0; i < D; ++i)
  {
    // A bend along the first coordinate alone is one change of the tangents
    set_column(bend.t[0], j, Vec<D>(Vec<D>::Unit(i)));
    set_column(bend.n, 0,
               Vec<D>(-was.slave.old.n[i] * column(was.slave.old_dual, j)));
    const Mat<D, D - 1> change = turned_with_facet<D>(
        was.spring, {was.slave.old, bend}, was.slave.old_dual, {slave, none},
        was.accepted, held);
    set_column(by, i, column(change, 0));
  }
  return by;
}
} // namespace raymortar
