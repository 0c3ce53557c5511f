// Projection of a tangential traction onto the disc that friction allows.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// Distance outside the circle beyond which the radius is s again, in slacks
inline constexpr double fade = 100.0;

/// @brief Radial return of q = T_n z = (I - n (x) n) z to the disc of radius s
/// [theory (4.6)].
///
/// Inside, P = q; outside, P = s q/|q|. On the circle, and outside by no more
/// than slack, is inside: rounding must not choose. Further out, up to `fade`
/// slacks, the radius falls from s + slack to s, so that the traction is
/// continuous where states at rest lie  [theory (4.6)].
template <int D>
struct DiscProjection
{
  bool stick = true;             ///< |q| <= s + slack
  Vec<D> value;                  ///< P_s(q)
  double z_n;                    ///< n . z
  double shrink = 1.0;           ///< |P| / |q|
  double slope = 0.0;            ///< by which |P| falls where |q| grows
  Vec<D> along = Vec<D>::Zero(); ///< q / |q|, outside

  /// @param[in] n Unit normal
  /// @param[in] z Trial traction, any component along n drops out
  /// @param[in] s Radius, traction; may be infinite
  /// @param[in] slack Traction that is taken for none
  DiscProjection(const Vec<D>& n, const Vec<D>& z, double s, double slack)
      : z_n(dot<D>(n, z))
  {
    value = z - z_n * n;
    const double length = raymortar::length<D>(value);
    stick = length <= s + slack;
    if (stick)
      return;
    const double fall = 1.0 / (fade - 1.0);
    const double rest = slack - fall * (length - s - slack);
    const double radius = rest > 0.0 ? s + rest : s;
    slope = rest > 0.0 ? fall : 0.0;
    along = value / length;
    shrink = radius / length;
    value = radius * along;
  }
};

/// @brief P_s(T_n z) with its derivatives   [theory (4.6)].
template <int D>
struct TangentialProjection
{
  bool stick;   ///< |q| <= s + slack
  Vec<D> value; ///< P_s(q), q = T_n z
  Mat<D, D> by_z;
  Mat<D, D> by_n;
  Vec<D> by_s;
  /// By the logarithm of gamma where z is fixed: of elastic slip
  Vec<D> by_gamma = Vec<D>::Zero();
};

/// @brief Its derivatives. With A the one by q,
/// dP = A (T_n dz - (n . z) dn - n (z . dn)) + q/|q| ds.
/// @param[in] n, z What it is the projection of
template <int D>
[[nodiscard]] TangentialProjection<D>
slopes_of(const DiscProjection<D>& on_disc, const Vec<D>& n, const Vec<D>& z)
{
  TangentialProjection<D> r;
  r.stick = on_disc.stick;
  r.value = on_disc.value;
  const Vec<D>& along = on_disc.along;
  const double less = on_disc.shrink + on_disc.slope;
  Mat<D, D> A = -less * along * along.transpose();
  add_to_diagonal(A, on_disc.shrink);
  const Vec<D> A_n = A * n;
  r.by_z = A - A_n * n.transpose();
  r.by_n = -on_disc.z_n * A - A_n * z.transpose();
  r.by_s = (1.0 + on_disc.slope) * along;
  return r;
}

/// @brief Projection with derivatives, see DiscProjection for the parameters.
template <int D>
[[nodiscard]] TangentialProjection<D>
project_tangential(const Vec<D>& n, const Vec<D>& z, double s,
                   double slack = 0.0)
{
  return slopes_of<D>(DiscProjection<D>(n, z, s, slack), n, z);
}
} // namespace raymortar
