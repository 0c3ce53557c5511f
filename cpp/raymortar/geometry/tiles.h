// Tiles: parts of a polygon for integration.
#pragma once

#include "raymortar/core/types.h"
#include <array>
#include <cstdint>
#include <span>

namespace raymortar
{
/// @brief A triangle or quadrilateral between vertices of a polygon.
struct Tile
{
  enum class Kind : std::int8_t
  {
    triangle,
    quadrilateral,
    fan ///< triangle whose first corner is the mean of the core's vertices
  };
  Kind kind;
  /// Vertices in their order around the tile, `Tiles::centre` for the mean
  std::array<std::int8_t, 4> corners{};
};

/// @brief Tiles of a polygon with 3 to 8 vertices: ears, and then the core.
///
/// An ear is the triangle of a vertex and its neighbours. Ears with next to no
/// area are cut off, the smallest first; the rest is the core. So a vertex that
/// comes close to another, or to the line between its neighbours, does not move
/// the points of the core: the polygon without this vertex has the same points,
/// and sums over all points are continuous when polygons gain or lose vertices.
/// If edges of slave and master coincide, rounding decides which of them cut,
/// and a rule that jumps with the number of vertices keeps Newton's method from
/// converging. The choice of the first vertex changes less than the ears do.
struct Tiles
{
  static constexpr int capacity =
      8; ///< ears and core of an octagon, or its fan
  static constexpr std::int8_t centre = capacity;

  int size = 0;
  std::array<Tile, capacity> tiles;
  int core_size = 0; ///< vertices of the core
  std::array<std::int8_t, capacity> core;

  /// A mean is asked for
  [[nodiscard]] bool has_centre() const { return core_size > 4; }
};

/// @param[in] polygon Counter-clockwise, in any coordinates: only ratios of
/// areas count, tolerance::ear
/// @complexity O(1), no allocation.  @see tests/cpp/geometry/test_tiles.cpp
[[nodiscard]] Tiles tiles_of(std::span<const Vec<2>> polygon);

/// @brief Mean of some of a polygon's vertices.
template <class Vertices>
auto mean_of_core(const Tiles& tiles, const Vertices& polygon)
{
  auto mean = polygon[tiles.core[0]];
  for (int v = 1; v < tiles.core_size; ++v)
    mean += polygon[tiles.core[v]];
  mean /= tiles.core_size;
  return mean;
}
} // namespace raymortar
