// Rays that leave a slave surface along its normals.
#pragma once

#include "raymortar/pairing/surface.h"
#include <memory>

namespace raymortar
{
template <int D>
struct Ray
{
  Vec<D> x = Vec<D>::Zero(); ///< where it starts
  Vec<D> n = Vec<D>::Zero(); ///< unit direction
};

/// @brief Rays of a slave surface whose type of facets the caller does not
/// know: one ray caster serves all types of slaves.
template <int D>
class SlaveRays
{
public:
  virtual ~SlaveRays() = default;

  /// @brief Ray of a point at the present positions.
  [[nodiscard]] virtual Ray<D> now(Index facet, const Vec<2>& xi) = 0;

  /// @brief The same at the positions of the last accepted step.
  [[nodiscard]] virtual Ray<D> before(Index facet, const Vec<2>& xi) const = 0;
};

/// @param[in] slave Surface of dimension D, which outlives the result
template <int D>
[[nodiscard]] std::unique_ptr<SlaveRays<D>>
make_slave_rays(const Surface& slave);
} // namespace raymortar
