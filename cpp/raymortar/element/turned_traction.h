// Tangential traction carried along with the slave surface from the accepted
// step: what the springs of the elastic penalty start from.
#pragma once

#include "raymortar/geometry/curvature.h"

namespace raymortar
{
[[nodiscard]] inline Vec<3> cross(const Vec<3>& a, const Vec<3>& b)
{
  return a.cross(b);
}

/// @brief The traction v of the old surface, turned with the surface.
///
/// Let A = sum_i t_i (x) t_0^i take old tangent vectors to present ones. The
/// rotation of its polar decomposition is A v - n x A (n_0 x v), but for the
/// length: in two dimensions A + cof A is a multiple of it. Neither drilling
/// nor tilting of the surface is lost, and stretch does not change the length
/// [theory (4.9)]. What the traction has along the old normal drops out, or
/// turns to the present normal where it is carried as a whole.
template <int D>
struct TurnedTraction
{
  double squared = 0.0; ///< |v|^2; where it is 0, nothing else of v is set
  Vec<D - 1> along;     ///< components of v on the old tangents
  Vec<D - 1> across;    ///< of n_0 x v, which is 0 in 2D: not set
  Vec<D> direction;     ///< of the turned traction, of any length
  double scale;         ///< what makes it as long as v
  bool whole = false;   ///< false: the next two are not set
  double outward;       ///< part of the traction along the old normal
  Vec<D> n;             ///< present normal

  [[nodiscard]] bool is_zero() const { return squared == 0.0 and not whole; }

  [[nodiscard]] Vec<D> value() const
  {
    Vec<D> v = Vec<D>::Zero();
    if (squared > 0.0)
      v = scale * direction;
    if (whole)
      v += outward * n;
    return v;
  }

  /// @brief How the value changes with the direction, the length of v aside.
  [[nodiscard]] Mat<D, D> by_direction() const
  {
    Mat<D, D> m = (-scale / dot<D>(direction, direction) * direction) *
                  direction.transpose();
    add_to_diagonal(m, scale);
    return m;
  }
};

/// @param[in] old Frame at the accepted step
/// @param[in] now Frame of the same material point
/// @param[in] old_dual Of the old tangents
/// @param[in] whole Whether what there is along the old normal turns as well
template <int D>
[[nodiscard]] TurnedTraction<D>
carry_traction(const Frame<D>& old, const Mat<D, D - 1>& old_dual,
               const Frame<D>& now, const Vec<D>& traction, bool whole = false)
{
  TurnedTraction<D> c;
  const double outward = dot<D>(old.n, traction);
  const Vec<D> v = traction - outward * old.n;
  c.squared = dot<D>(v, v);
  c.whole = whole;
  if (whole)
  {
    c.outward = outward;
    c.n = now.n;
  }
  if (c.squared == 0.0)
    return c;
  c.along = old_dual.transpose() * v;
  c.direction = now.t * c.along;
  if constexpr (D == 3)
  {
    c.across = old_dual.transpose() * cross(old.n, v);
    c.direction -= cross(now.n, now.t * c.across);
  }
  c.scale = std::sqrt(c.squared / dot<D>(c.direction, c.direction));
  return c;
}

/// @brief Add the derivative of f(value()) by the slave's tangents, for the
/// derivative of f by the value.
/// @param[in] now Frame of the slave
/// @param[in] dual Of its tangents
/// @param[in,out] rows By its position and by each tangent
template <int R, int D>
void add_turned(const TurnedTraction<D>& c, const Mat<R, D>& by_value,
                const Frame<D>& now, const Mat<D, D - 1>& dual,
                std::array<Mat<R, D>, D>& rows)
{
  const auto of = [&rows](int j) -> Mat<R, D>&
  { return rows[static_cast<std::size_t>(1 + j)]; };
  if (c.whole)
    for (int j = 0; j < D - 1; ++j)
      of(j) -= (c.outward * by_value * column(dual, j)) * now.n.transpose();
  if (c.squared == 0.0)
    return;
  // d direction = dt along - n x (dt across) + (t across) x dn
  const Mat<R, D> by_along = by_value * c.by_direction();
  for (int j = 0; j < D - 1; ++j)
    of(j) += c.along[j] * by_along;
  if constexpr (D == 3)
  {
    const Mat<R, D> by_across = by_along * cross_matrix(now.n);
    const Mat<R, D> by_n = by_along * cross_matrix(Vec<D>(now.t * c.across));
    for (int j = 0; j < D - 1; ++j)
    {
      const Vec<R> turn = by_n * column(dual, j);
      of(j) -= c.across[j] * by_across + turn * now.n.transpose();
    }
  }
}

/// @brief Frame of a material point with its derivatives along the facet.
template <int D>
struct BentFrame
{
  Frame<D> frame;
  Curvature<D> bend;
};

/// @brief Derivative by xi of what carry_traction makes of a field.
/// @param[in] c What it makes of it
/// @param[in] old, now Of the same material point
/// @param[in] old_dual Of the old tangents
/// @param[in] traction, traction_xi The field and its derivative by xi
template <int D>
[[nodiscard]] Mat<D, D - 1>
turned_with_facet(const TurnedTraction<D>& c, const BentFrame<D>& old,
                  const Mat<D, D - 1>& old_dual, const BentFrame<D>& now,
                  const Vec<D>& traction, const Mat<D, D - 1>& traction_xi)
{
  Mat<D, D - 1> rate = Mat<D, D - 1>::Zero();
  const Vec<D> n_0 = old.frame.n;
  if (c.whole)
    rate = now.frame.n * (n_0.transpose() * traction_xi +
                          traction.transpose() * old.bend.n) +
           c.outward * now.bend.n;
  if (c.squared == 0.0)
    return rate;
  const double normal = dot<D>(n_0, traction);
  const Vec<D> v = traction - normal * n_0;
  const Mat<D, D> by_direction = c.by_direction();
  const Vec<D> by_length = c.scale / c.squared * c.direction;
  for (int j = 0; j < D - 1; ++j)
  {
    const auto k = static_cast<std::size_t>(j);
    const Mat<D, D - 1>&dt_0 = old.bend.t[k], &dt = now.bend.t[k];
    const Vec<D> dn_0 = column(old.bend.n, j), dn = column(now.bend.n, j);
    const Vec<D> dtraction = column(traction_xi, j);
    const Vec<D> dv = dtraction - dot<D>(n_0, dtraction) * n_0 - normal * dn_0 -
                      dot<D>(dn_0, traction) * n_0;
    // The components a of a tangential vector u = t_0 a change by those of
    // du - dt_0 a
    Vec<D> ddirection =
        now.frame.t * (old_dual.transpose() * (dv - dt_0 * c.along)) +
        dt * c.along;
    if constexpr (D == 3)
    {
      const Vec<D> dacross = cross(n_0, dv) + cross(dn_0, v) - dt_0 * c.across;
      const Vec<D> dturned =
          now.frame.t * (old_dual.transpose() * dacross) + dt * c.across;
      ddirection -=
          cross(dn, now.frame.t * c.across) + cross(now.frame.n, dturned);
    }
    set_column(rate, j,
               column(rate, j) + dot<D>(v, dv) * by_length +
                   by_direction * ddirection);
  }
  return rate;
}
} // namespace raymortar
