// Quadrature rules as data, and their placement on segments.
#pragma once

#include "raymortar/core/types.h"
#include <span>
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

/// @brief Rules for segments, by their number of vertices.
///
/// All are symmetric such that points depend neither on the vertex that comes
/// first nor on the direction around the segment.
struct SegmentRules
{
  QuadratureRule simplex; ///< two on an interval, three in 3D
  /// four: one degree more than the others, for the Jacobian of the map
  QuadratureRule quadrilateral;
  /// more: on triangles around the mean of the vertices, their first corner
  QuadratureRule fan;
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

/// @brief Rule laid on a polygon, counter-clockwise.
///
/// Triangles take theirs as it is, quadrilaterals theirs under the bilinear map
/// of the vertices; of more vertices, piece i is the triangle of their mean and
/// the vertices i and i + 1. Exact for polynomials up to the rules' degree;
/// areas are signed, so that this holds for polygons that are not convex, too.
void append_on_polygon(const SegmentRules& rules,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out);
} // namespace raymortar
