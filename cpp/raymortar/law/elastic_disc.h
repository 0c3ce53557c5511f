// Elastic slip: the disc on which trial tractions are projected, and the share
// of the projection that is traction.
#pragma once

#include "raymortar/law/cone.h"
#include "raymortar/law/friction.h"

namespace raymortar
{
/// @brief Disc of the trial traction z of a law that slips elastically by a
/// length e before it slides: t = share P_radius(T_n z)  [theory (4.52)].
///
/// Without elastic slip the disc has the radius s, and all is traction.
struct ElasticDisc
{
  double radius;
  double share = 1.0;
  // Derivatives by the bound s, and by the logarithm of gamma
  double radius_s = 1.0, share_s = 0.0;
  double radius_gamma = 0.0, share_gamma = 0.0;

  /// @param[in] has_multiplier Whether z contains the traction itself
  ElasticDisc(const FrictionBound& bound, double gamma, bool has_multiplier)
      : radius(bound.s)
  {
    if (bound.elastic_slip == 0.0)
      return;
    const double stretch = gamma * bound.elastic_slip;
    radius = has_multiplier ? bound.s + stretch : stretch;
    share = bound.s / radius;
    radius_s = has_multiplier ? 1.0 : 0.0;
    share_s = (1.0 - share * radius_s) / radius;
    radius_gamma = stretch;
    share_gamma = -share * stretch / radius;
  }
};

/// @brief Make the slopes of a projection those of the traction, its share
/// [theory (4.54)].
/// @param[in,out] f Of the projection on the disc, by whose radius `by_s` is
template <int D>
void take_share(const ElasticDisc& disc, TangentialProjection<D>& f)
{
  const Vec<D> by_radius = disc.share * f.by_s;
  f.by_s = disc.radius_s * by_radius + disc.share_s * f.value;
  f.by_gamma = disc.radius_gamma * by_radius + disc.share_gamma * f.value;
  f.value *= disc.share;
  f.by_z *= disc.share;
  f.by_n *= disc.share;
}
} // namespace raymortar
