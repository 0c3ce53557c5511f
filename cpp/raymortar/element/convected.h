// Slip carried along with the master surface from the accepted step.
#pragma once

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
/// The vector stays as it is on a master at rest, and turns with a master that
/// turns, whatever the slave does.
template <int D>
struct ConvectedVector
{
  Vec<D - 1> along; ///< components on the tangents
  double across;    ///< and on the normal
  Vec<D> value;     ///< on the present surface
};

/// @param[in] old, now Frames of the same point of the master
/// @param[in] old_dual Of the old tangents
/// @param[in] vector On the old surface
template <int D>
[[nodiscard]] ConvectedVector<D>
convect(const Frame<D>& old, const Mat<D, D - 1>& old_dual, const Frame<D>& now,
        const Vec<D>& vector)
{
  ConvectedVector<D> c;
  c.along = old_dual.transpose() * vector;
  c.across = dot<D>(old.n, vector);
  c.value = now.t * c.along + c.across * now.n;
  return c;
}

/// @brief What takes old vectors to present ones.
template <int D>
[[nodiscard]] Mat<D, D> convection(const Frame<D>& old,
                                   const Mat<D, D - 1>& old_dual,
                                   const Frame<D>& now)
{
  return now.t * old_dual.transpose() + now.n * old.n.transpose();
}

/// @brief Derivative of the value by eta, the old vector aside.
/// @param[in] carry What takes old vectors to present ones
template <int D>
[[nodiscard]] Mat<D, D - 1>
convected_along_master(const ConvectedVector<D>& c, const Mat<D, D>& carry,
                       const Curvature<D>& old, const Curvature<D>& now)
{
  const auto bent = [&c](const Curvature<D>& bend, int j) -> Vec<D>
  {
    return bend.t[static_cast<std::size_t>(j)] * c.along +
           c.across * column(bend.n, j);
  };
  Mat<D, D - 1> rate;
  for (int j = 0; j < D - 1; ++j)
    set_column(rate, j, bent(now, j) - carry * bent(old, j));
  return rate;
}

/// @brief Add the derivative of f(value) by the master's tangents at a point
/// that stays on it, for the derivative of f by the value.
/// @param[in] n Normal of the master
/// @param[in] dual Of its tangents
/// @param[in,out] rows By its position and by each tangent
template <int R, int D>
void add_convected(const ConvectedVector<D>& c, const Mat<R, D>& by_value,
                   const Vec<D>& n, const Mat<D, D - 1>& dual,
                   std::array<Mat<R, D>, D>& rows)
{
  const Mat<R, D - 1> by_n = c.across * (by_value * dual);
  for (int j = 0; j < D - 1; ++j)
    rows[static_cast<std::size_t>(1 + j)] +=
        c.along[j] * by_value - column(by_n, j) * n.transpose();
}
} // namespace raymortar
