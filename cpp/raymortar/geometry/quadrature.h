// Quadrature rules as data, and their placement on segments.
#pragma once

#include "raymortar/geometry/tiles.h"
#include <vector>

namespace raymortar
{
/// @brief A rule on a reference interval, triangle or quadrilateral.
///
/// Points of an interval use the first coordinate. Weights sum to the
/// measure of the reference facet.
struct QuadratureRule
{
  std::vector<Vec<2>> points;
  std::vector<double> weights;
};

/// @brief Rules for the tiles of segments, by their kind.
///
/// All are symmetric such that points depend neither on the vertex that comes
/// first nor on the direction around the segment.
struct SegmentRules
{
  QuadratureRule simplex; ///< intervals; triangles between three vertices
  /// One degree more than the others, for the Jacobian of the map
  QuadratureRule quadrilateral;
  QuadratureRule fan; ///< triangles around a mean, which is their first corner

  [[nodiscard]] const QuadratureRule& on(Tile::Kind kind) const
  {
    return kind == Tile::Kind::triangle        ? simplex
           : kind == Tile::Kind::quadrilateral ? quadrilateral
                                               : fan;
  }
};

/// @brief One quadrature point in the reference coordinates of a facet.
struct WeightedPoint
{
  Vec<2> xi;
  double weight; ///< reference measure: multiply by the surface Jacobian
};

/// @brief Interval rule laid on [begin, end].
void append_on_interval(const QuadratureRule& rule, double begin, double end,
                        std::vector<WeightedPoint>& out);

/// @brief Rules laid on the tiles of a polygon, counter-clockwise.
///
/// Triangles take theirs as it is, quadrilaterals theirs under the bilinear map
/// of the vertices. Exact for polynomials up to the rules' degree; areas are
/// signed, so that this holds for polygons that are not convex, too.
/// @param[in] tiles As `tiles_of` the same vertices, in any coordinates
void append_on_polygon(const SegmentRules& rules, const Tiles& tiles,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out);
} // namespace raymortar
