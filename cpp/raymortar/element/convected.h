// Slip carried along with the master surface from the accepted step.
#pragma once

#include "raymortar/element/kinematics.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
/// @brief How much of an open gap has closed, with its derivatives.
struct Closing
{
  double length = 0.0;
  double by_old = 0.0; ///< by the gap of the accepted step
  double by_now = 0.0; ///< by the present gap
};

/// @param[in] old, now Gaps; overlap counts as closed
[[nodiscard]] inline Closing closed_part(double old, double now)
{
  if (old <= 0.0 or old <= now)
    return {};
  return now > 0.0 ? Closing{old - now, 1.0, -1.0} : Closing{old, 1.0, 0.0};
}

/// @brief A vector at a point of the old master surface and what it becomes on
/// the present one: its components on tangents and normal stay  [theory
/// (2.11)].
///
/// Where the master has not moved it stays what it is, and it turns with a
/// master that turns, whatever the slave does on its place.
template <int D>
struct ConvectedVector
{
  Mat<D, D> carry; ///< old vectors to present ones
  Vec<D> parts;    ///< components on the tangents, and on the normal
  Vec<D> value;    ///< on the present surface
};

/// @brief Tangents and normal as columns.
template <int D>
[[nodiscard]] Mat<D, D> basis_of(const Frame<D>& frame)
{
  Mat<D, D> columns;
  columns << frame.t, frame.n;
  return columns;
}

/// @param[in] old, now Frames of the same point of the master
/// @param[in] vector On the old surface
template <int D>
[[nodiscard]] ConvectedVector<D>
convect(const Frame<D>& old, const Frame<D>& now, const Vec<D>& vector)
{
  const Mat<D, D> present = basis_of(now);
  const Mat<D, D> inverse = basis_of(old).inverse();
  ConvectedVector<D> c;
  c.parts = inverse * vector;
  c.carry = present * inverse;
  c.value = present * c.parts;
  return c;
}

/// @brief Derivative of the value by eta, the old vector aside.
template <class F>
[[nodiscard]] Mat<F::gdim, F::tdim>
convected_along_master(const ConvectedVector<F::gdim>& c,
                       const Curvature<F::gdim>& old,
                       const Curvature<F::gdim>& now)
{
  constexpr int D = F::gdim;
  const auto bent = [&c](const Curvature<D>& bend, int j) -> Vec<D>
  {
    return bend.t[static_cast<std::size_t>(j)] *
               c.parts.template head<D - 1>() +
           bend.n.col(j) * c.parts[D - 1];
  };
  Mat<D, F::tdim> rate;
  for (int j = 0; j < F::tdim; ++j)
    rate.col(j) = bent(now, j) - c.carry * bent(old, j);
  return rate;
}

/// @brief Derivative of f(value) by the master's displacement dofs at a point
/// that stays on it, for the derivative of f by the value.
/// @param[in] by_value (R, gdim)
/// @param[in] now Frame of the master
/// @param[in] dual Of its tangents
/// @param[in] dN_m Gradients of its shape functions
template <class F, int R>
[[nodiscard]] Mat<R, Variations<F>::side>
vary_convected(const ConvectedVector<F::gdim>& c,
               const Mat<R, F::gdim>& by_value, const Frame<F::gdim>& now,
               const Mat<F::gdim, F::tdim>& dual,
               const Mat<F::dofs, F::tdim>& dN_m)
{
  constexpr int D = F::gdim;
  const Mat<R, D - 1> by_dual = c.parts[D - 1] * by_value * dual;
  Mat<R, Variations<F>::side> rows;
  for (int a = 0; a < F::dofs; ++a)
    rows.template middleCols<D>(a * D) =
        dN_m.row(a).dot(c.parts.template head<D - 1>()) * by_value -
        by_dual * dN_m.row(a).transpose() * now.n.transpose();
  return rows;
}
} // namespace raymortar
