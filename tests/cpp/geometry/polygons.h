// Convex polygons, and points laid on them.
#pragma once

#include "facets.h"
#include "raymortar/geometry/clip.h"
#include "raymortar/geometry/quadrature.h"
#include "rules.h"
#include <numbers>

namespace raymortar::test
{
/// Convex polygons with 3 to 8 vertices
inline std::vector<std::vector<Vec<2>>> random_polygons(int count)
{
  std::mt19937 random(1);
  const Facet square = moved(unit_square, 1, 0, {-0.5, -0.5});
  const ClipPolygon octagon =
      clip_convex(square, moved(square, 1, std::numbers::pi / 4, {0, 0}));
  std::vector<std::vector<Vec<2>>> polygons{
      {octagon.points.begin(), octagon.points.end()}};
  while (static_cast<int>(polygons.size()) < count)
  {
    const ClipPolygon p =
        clip_convex(random_facet(random, 0.2), random_facet(random, 0.2));
    if (p.size > 0)
      polygons.emplace_back(p.points.begin(), p.points.begin() + p.size);
  }
  return polygons;
}

/// A rule's points on a polygon
inline std::vector<WeightedPoint> lay(const SegmentRules& rules,
                                      std::span<const Vec<2>> polygon)
{
  std::vector<WeightedPoint> points;
  append_on_polygon(rules, tiles_of(polygon), polygon, points);
  return points;
}
} // namespace raymortar::test
