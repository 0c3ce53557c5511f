// Where a ray meets a surface of facets, and how deep a hit may be.
#pragma once

#include "raymortar/geometry/ray.h"
#include "raymortar/pairing/distances.h"
#include "raymortar/pairing/surface.h"
#include <algorithm>

namespace raymortar
{
/// @brief A ray's result together with the facet it ended on.
template <class F>
struct FacetHit
{
  RayHit<F> hit;
  Index facet = no_index;
  double facing = 0.0; ///< -n . n_m, of rays that have met a facet

  [[nodiscard]] bool is_hit() const { return hit.status == RayStatus::hit; }
};

/// @brief Penetration that counts whatever was before [theory (3.12)]. From
/// there on the back faces of the two bodies are nearer to each other than the
/// front faces are, or the slave has left the master through its back.
/// @param[in] behind Thickness of the master
[[nodiscard]] inline double certain_depth(const FacetDistances& distances,
                                          const Surface& slave, Index facet,
                                          double behind)
{
  const double depth = distances[facet].depth;
  if (not distances.depth_is_default())
    return depth;
  return std::min(
      {depth, behind, 0.5 * (behind + slave.thickness_behind(facet))});
}
} // namespace raymortar
