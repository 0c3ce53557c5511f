#include "polygons.h"
#include <gtest/gtest.h>
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
using Polygon = std::vector<Vec<2>>;

/// Smooth, and no polynomial: rules of low degree have an error
double f(const Vec<2>& x) { return std::exp(x.x()) * std::sin(2 * x.y() + 1); }

double integral(const Polygon& polygon)
{
  double sum = 0;
  for (const WeightedPoint& p : lay(segment_rules(Shape::triangle, 2), polygon))
    sum += p.weight * f(p.xi);
  return sum;
}

/// Vertices on an ellipse, unevenly
Polygon on_ellipse(int vertices)
{
  Polygon polygon;
  for (int v = 0; v < vertices; ++v)
  {
    const double angle =
        2 * std::numbers::pi * (v + 0.2 * std::sin(3.0 * v)) / vertices;
    polygon.emplace_back(std::cos(angle), 0.6 * std::sin(angle));
  }
  return polygon;
}

/// One more vertex beside vertex v, towards the next but one: convex
Polygon doubled(Polygon polygon, std::size_t v, double distance)
{
  const std::size_t n = polygon.size();
  const Vec<2> side = polygon[(v + 1) % n] - polygon[v];
  const Vec<2> outward(side.y(), -side.x());
  const Vec<2> beside = polygon[v] + distance * (side + 0.5 * outward);
  polygon.insert(polygon.begin() + static_cast<std::ptrdiff_t>(v) + 1, beside);
  return polygon;
}

/// One more vertex outside of the middle of side v
Polygon bent(Polygon polygon, std::size_t v, double distance)
{
  const Vec<2> a = polygon[v], b = polygon[(v + 1) % polygon.size()];
  const Vec<2> outward(b.y() - a.y(), a.x() - b.x());
  polygon.insert(polygon.begin() + static_cast<std::ptrdiff_t>(v) + 1,
                 0.5 * (a + b) + distance * outward);
  return polygon;
}
} // namespace

TEST(Tiles, FillThePolygonOfAllVertices)
{
  for (const Polygon& polygon : random_polygons(2000))
  {
    const Tiles tiles = tiles_of(polygon);
    ASSERT_LE(tiles.size, Tiles::capacity);
    std::set<int> used;
    for (int i = 0; i < tiles.size; ++i)
    {
      const Tile& tile = tiles.tiles[static_cast<std::size_t>(i)];
      for (std::size_t k = 0;
           k < (tile.kind == Tile::Kind::quadrilateral ? 4 : 3); ++k)
        used.insert(tile.corners[k]);
    }
    used.erase(Tiles::centre);
    EXPECT_EQ(used.size(), polygon.size());
    double area = 0, exact = 0;
    for (const WeightedPoint& p :
         lay(segment_rules(Shape::triangle, 2), polygon))
      area += p.weight;
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    {
      const Vec<2> a = polygon[k] - polygon[0], b = polygon[k + 1] - polygon[0];
      exact += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    EXPECT_NEAR(area, exact, 2e-15);
  }
}

// Rounding decides whether edges that coincide cut a polygon or not: sums must
// not hop with the number of vertices, as they do by 1e-4 without ears
TEST(Tiles, SumsAreContinuousWhereVerticesMerge)
{
  for (int n = 3; n <= 7; ++n)
  {
    const Polygon polygon = on_ellipse(n);
    const double limit = integral(polygon);
    for (const double d : {1e-4, 1e-6, 1e-9, 1e-13, 0.0})
      for (std::size_t v = 0; v < polygon.size(); ++v)
      {
        EXPECT_NEAR(integral(doubled(polygon, v, d)), limit, 4 * d + 1e-15)
            << n << " vertices, one doubled at " << d;
        EXPECT_NEAR(integral(bent(polygon, v, d)), limit, 4 * d + 1e-15)
            << n << " vertices, one on a side, off by " << d;
      }
  }
}

TEST(Tiles, TwoVerticesMayMergeAtOnce)
{
  for (int n = 3; n <= 6; ++n)
  {
    const Polygon polygon = on_ellipse(n);
    const double limit = integral(polygon);
    for (const double d : {1e-4, 1e-9})
    {
      EXPECT_NEAR(integral(bent(doubled(polygon, 0, d), 2, d)), limit, 8 * d);
      EXPECT_NEAR(integral(doubled(doubled(polygon, 0, d), 0, d)), limit,
                  8 * d);
    }
  }
}

TEST(Tiles, LargeEarsStay)
{
  const Tiles square = tiles_of(Polygon{{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  ASSERT_EQ(square.size, 1);
  EXPECT_EQ(square.tiles[0].kind, Tile::Kind::quadrilateral);
  const Tiles hexagon = tiles_of(on_ellipse(6));
  EXPECT_EQ(hexagon.size, 6);
  EXPECT_TRUE(hexagon.has_centre());
}

TEST(Tiles, WithoutAreaNothingIsCut)
{
  const Tiles line = tiles_of(Polygon{{0, 0}, {1, 1}, {2, 2}, {1, 1}});
  ASSERT_EQ(line.size, 1);
  EXPECT_EQ(line.tiles[0].kind, Tile::Kind::quadrilateral);
}
