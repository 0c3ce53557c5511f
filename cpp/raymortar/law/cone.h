// Projection of a tangential traction onto the disc that friction allows.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// How far outside the circle its radius is s again, in slacks
inline constexpr double fade = 100.0;

/// @brief P_s(T_n z) with its derivatives   [theory (4.6)].
template <int D>
struct TangentialProjection
{
  bool stick;   ///< |q| <= s + slack
  Vec<D> value; ///< P_s(q), q = T_n z
  Mat<D, D> by_z;
  Mat<D, D> by_n;
  Vec<D> by_s;
};

/// @brief Radial return of q = (I - n (x) n) z to the disc of radius s.
///
/// Inside, P = q; outside, P = s q/|q|. With A the derivative by q,
/// dP = A (T_n dz - (n . z) dn - n (z . dn)) + q/|q| ds. On the circle, and
/// outside by no more than slack, is inside: rounding must not choose. Further
/// out, up to `fade` slacks, the radius falls from s + slack to s, so that the
/// traction is continuous where states at rest lie  [theory (4.6)].
/// @param[in] n Unit normal
/// @param[in] z Trial traction, any component along n drops out
/// @param[in] s Radius, traction; may be infinite
/// @param[in] slack Traction that is taken for none
template <int D>
[[nodiscard]] TangentialProjection<D>
project_tangential(const Vec<D>& n, const Vec<D>& z, double s,
                   double slack = 0.0)
{
  TangentialProjection<D> r;
  const double z_n = n.dot(z);
  const Vec<D> q = z - z_n * n;
  const double length = q.norm();
  r.stick = length <= s + slack;
  Mat<D, D> A = Mat<D, D>::Identity();
  r.by_s.setZero();
  r.value = q;
  if (not r.stick)
  {
    const Vec<D> along = q / length;
    const double slope = 1.0 / (fade - 1.0);
    const double rest = slack - slope * (length - s - slack);
    const bool fades = rest > 0.0;
    const double radius = fades ? s + rest : s;
    r.by_s = fades ? (1.0 + slope) * along : along;
    r.value = radius * along;
    A = (radius / length) * (A - along * along.transpose());
    if (fades)
      A -= slope * along * along.transpose();
  }
  const Vec<D> A_n = A * n;
  r.by_z = A - A_n * n.transpose();
  r.by_n = -z_n * A - A_n * z.transpose();
  return r;
}
} // namespace raymortar
