// What every clipped polygon must be.
#pragma once

#include "facets.h"
#include "raymortar/geometry/clip.h"
#include <gtest/gtest.h>

namespace raymortar::test
{
/// Vertices distinct, polygon convex and counter-clockwise to rounding
inline void expect_valid(const ClipPolygon& polygon, double size)
{
  ASSERT_TRUE(polygon.size == 0 or polygon.size >= 3);
  for (int v = 0; v < polygon.size; ++v)
  {
    const Vec<2>& a = polygon.points[v];
    const Vec<2>& b = polygon.points[(v + 1) % polygon.size];
    for (int w = 0; w < v; ++w)
      ASSERT_GT((polygon.points[w] - a).norm(), tolerance::merge * size);
    for (int w = 0; w < polygon.size; ++w)
      ASSERT_GE(cross(b - a, polygon.points[w] - a), -2e-13 * size * size);
  }
}

/// Area of the intersection, which is checked
inline double valid_area(const Facet& slave, const Facet& master)
{
  const ClipPolygon polygon = clip_convex(slave, master);
  expect_valid(polygon, diameter(slave));
  return polygon.area();
}

/// Sum of the areas that masters cover
inline double covered(const Facet& slave, const std::vector<Facet>& masters)
{
  double sum = 0;
  for (const Facet& master : masters)
    sum += clip_convex(slave, master).area();
  return sum;
}
} // namespace raymortar::test
