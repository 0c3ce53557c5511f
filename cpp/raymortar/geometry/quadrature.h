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
/// measure of the reference facet. Rules come from Basix at set-up.
struct QuadratureRule
{
  std::vector<Vec<2>> points;
  std::vector<double> weights;
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

/// @brief Triangle rule laid on a polygon, counter-clockwise.
///
/// Triangle i has the mean of the vertices and the vertices i and i + 1. Exact
/// for polynomials up to the rule's degree; areas are signed, so that this
/// holds for polygons that are not convex, too.
void append_on_polygon(const QuadratureRule& rule,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out);
} // namespace raymortar
