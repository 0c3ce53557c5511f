#include "clipping.h"
#include <gtest/gtest.h>
#include <limits>

using namespace raymortar;
using namespace raymortar::test;
using Kind = Provenance::Kind;

namespace
{
/// Vertex from its provenance
Vec<2> rebuilt(const Provenance& p, const Facet& slave, const Facet& master)
{
  if (p.kind == Kind::slave_corner)
    return slave[p.slave];
  if (p.kind == Kind::master_corner)
    return master[p.master];
  return lines_meet(slave[p.slave], slave[(p.slave + 1) % slave.size()],
                    master[p.master], master[(p.master + 1) % master.size()]);
}

} // namespace

TEST(Clip, IdenticalFacetsGiveTheirCornersOnce)
{
  for (const Facet& facet :
       {unit_square, unit_triangle, moved(unit_square, 0.7, 0.3, {3, -2}),
        moved(unit_triangle, 1.3, 2, {0.1, 0.2})})
  {
    const int n = static_cast<int>(facet.size());
    for (int by = 0; by < n; ++by)
    {
      const ClipPolygon polygon =
          clip_convex(facet, rotated_corners(facet, by));
      ASSERT_EQ(polygon.size, n);
      for (int v = 0; v < n; ++v)
      {
        const int corner = polygon.provenance[v].slave;
        EXPECT_EQ(polygon.provenance[v].kind, Kind::slave_corner);
        EXPECT_EQ(polygon.points[v], facet[corner]);
      }
      EXPECT_DOUBLE_EQ(polygon.area(), facet_area(facet));
    }
  }
}

TEST(Clip, SharedEdgeGivesZeroArea)
{
  for (const Vec<2>& shift : {Vec<2>(1, 0), Vec<2>(-1, 0), Vec<2>(0, 1),
                              Vec<2>(0, -1), Vec<2>(1, 0.3), Vec<2>(-0.7, 1)})
    for (int by = 0; by < 4; ++by)
      EXPECT_EQ(
          clip_convex(unit_square,
                      rotated_corners(moved(unit_square, 1, 0, shift), by))
              .size,
          0);
}

TEST(Clip, TouchingVertexGivesZeroArea)
{
  EXPECT_EQ(clip_convex(unit_square, moved(unit_square, 1, 0, {1, 1})).size, 0);
  EXPECT_EQ(clip_convex(unit_square, moved(unit_square, 1, 0, {1, -1})).size,
            0);
  const Facet on_edge{{1, 0.4}, {2, 0}, {2, 1}};
  EXPECT_EQ(clip_convex(unit_square, on_edge).size, 0);
  EXPECT_EQ(clip_convex(on_edge, unit_square).size, 0);
}

TEST(Clip, EdgePartlyOnEdgeHasNoRepeatedVertex)
{
  const Facet beside{{0.25, 0}, {0.75, 0}, {0.5, 0.5}};
  for (int by = 0; by < 4; ++by)
  {
    const Facet square = rotated_corners(unit_square, by);
    EXPECT_EQ(clip_convex(square, beside).size, 3);
    EXPECT_EQ(clip_convex(beside, square).size, 3);
    EXPECT_DOUBLE_EQ(valid_area(square, beside), 0.125);
    const Facet across{{0.5, 0}, {1.5, 0}, {1.5, 1}, {0.5, 1}};
    EXPECT_EQ(clip_convex(square, across).size, 4);
    EXPECT_DOUBLE_EQ(valid_area(square, across), 0.5);
  }
}

TEST(Clip, RotatedSquaresGiveTheOctagon)
{
  const Facet centred = moved(unit_square, 1, 0, {-0.5, -0.5});
  const Facet turned = moved(centred, 1, std::numbers::pi / 4, {0, 0});
  for (int by = 0; by < 4; ++by)
  {
    const ClipPolygon octagon =
        clip_convex(centred, rotated_corners(turned, by));
    EXPECT_EQ(octagon.size, 8);
    expect_valid(octagon, 1);
    EXPECT_NEAR(octagon.area(), 2 * (std::sqrt(2) - 1), 1e-15);
    EXPECT_NEAR(octagon.centre().norm(), 0, 1e-15);
  }
}

TEST(Clip, RotatedTrianglesGiveTheHexagon)
{
  const double radius = 1 / std::sqrt(3);
  Facet triangle;
  for (int k = 0; k < 3; ++k)
  {
    const double angle = 2 * std::numbers::pi * k / 3;
    triangle.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  const ClipPolygon hexagon =
      clip_convex(triangle, moved(triangle, 1, std::numbers::pi / 3, {0, 0}));
  EXPECT_EQ(hexagon.size, 6);
  EXPECT_NEAR(hexagon.area(), std::sqrt(3) / 6, 1e-15);
}

TEST(Clip, NestedFacetsGiveTheInner)
{
  for (const Facet& outer : {unit_square, unit_triangle})
  {
    for (const Facet& shape : {unit_square, unit_triangle})
    {
      const Facet inner = moved(shape, 0.2, 0.4, {0.3, 0.2});
      EXPECT_DOUBLE_EQ(valid_area(outer, inner), facet_area(inner));
      EXPECT_DOUBLE_EQ(valid_area(inner, outer), facet_area(inner));
      EXPECT_EQ(clip_convex(outer, inner).provenance[0],
                (Provenance{Kind::master_corner, -1, 0}));
      EXPECT_EQ(clip_convex(inner, outer).provenance[0],
                (Provenance{Kind::slave_corner, 0, -1}));
    }
  }
}

TEST(Clip, SwapAndCornerOrderKeepTheArea)
{
  std::mt19937 random(5);
  for (int trial = 0; trial < 10000; ++trial)
  {
    const Facet slave = random_facet(random, 0.01);
    const Facet master = random_facet(random, 0.01);
    const double area = valid_area(slave, master);
    ASSERT_NEAR(valid_area(master, slave), area, 3e-16);
    for (int by = 1; by < 3; ++by)
      ASSERT_NEAR(valid_area(rotated_corners(slave, by),
                             rotated_corners(master, 3 - by)),
                  area, 3e-16);
  }
}

TEST(Clip, ScaleDoesNotMatter)
{
  std::mt19937 random(6);
  for (int trial = 0; trial < 2000; ++trial)
  {
    const Facet slave = random_facet(random, 0.01);
    const Facet master = random_facet(random, 0.01);
    const double area = valid_area(slave, master);
    for (const double scale : {1e-9, 1e-3, 1e3, 1e9})
      ASSERT_NEAR(valid_area(moved(slave, scale, 0, {0, 0}),
                             moved(master, scale, 0, {0, 0})),
                  scale * scale * area, 4e-16 * scale * scale);
  }
}

TEST(Clip, ProvenanceRebuildsEveryVertex)
{
  std::mt19937 random(7);
  for (int trial = 0; trial < 20000; ++trial)
  {
    const Facet slave =
        trial % 2 ? random_facet(random, 0.1) : random_coarse_facet(random);
    const Facet master =
        trial % 2 ? random_facet(random, 0.1) : random_coarse_facet(random);
    const ClipPolygon polygon = clip_convex(slave, master);
    for (int v = 0; v < polygon.size; ++v)
    {
      const Provenance& p = polygon.provenance[v];
      ASSERT_EQ(p.slave == -1, p.kind == Kind::master_corner);
      ASSERT_EQ(p.master == -1, p.kind == Kind::slave_corner);
      const Vec<2> point = rebuilt(p, slave, master);
      ASSERT_NEAR((polygon.points[v] - point).norm(), 0, 1e-11);
    }
  }
}

TEST(Clip, VertexOnACornerIsThatCorner)
{
  std::mt19937 random(8);
  for (int trial = 0; trial < 20000; ++trial)
  {
    const Facet slave = random_coarse_facet(random);
    const Facet master = random_coarse_facet(random);
    const ClipPolygon polygon = clip_convex(slave, master);
    for (int v = 0; v < polygon.size; ++v)
    {
      const Vec<2>& x = polygon.points[v];
      const Kind kind = polygon.provenance[v].kind;
      const bool on_slave = std::count(slave.begin(), slave.end(), x) > 0;
      const bool on_master = std::count(master.begin(), master.end(), x) > 0;
      ASSERT_EQ(kind == Kind::slave_corner, on_slave);
      ASSERT_EQ(kind == Kind::crossing, !on_slave and !on_master);
    }
  }
}

TEST(Clip, TilingAddsUpToTheFacet)
{
  std::mt19937 random(9);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const Facet slave = moved(random_facet(random, 0.1), 1, 0, {0.5, 0.5});
    const std::vector<Facet> masters = tiling(random, 3 + trial % 9, 0.25);
    ASSERT_NEAR(covered(slave, masters), facet_area(slave),
                1e-14 * std::max(facet_area(slave), 0.1));
  }
}

TEST(Clip, TilingThroughTheCornersAddsUpToTheFacet)
{
  std::mt19937 random(10);
  std::uniform_real_distribution<double> digits(-17, -8);
  const Vec<2> shift(0.1, 0.1);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const bool near = trial % 2 == 0;
    const double jitter = near ? std::pow(10, digits(random)) : 0;
    const Facet slave = moved(random_coarse_facet(random), 1, 0, shift);
    std::vector<Facet> masters = tiling(random, 24, jitter);
    for (Facet& master : masters)
      master = moved(master, 1, 0, shift);
    // A vertex merged into its neighbour takes a strip along an edge with it
    ASSERT_NEAR(covered(slave, masters), facet_area(slave),
                near ? tolerance::merge : 1e-15);
  }
}

TEST(ClipInterval, KnowsWhatMadeItsEnds)
{
  const ClipInterval inside = clip_interval(0.7, 0.2);
  ASSERT_EQ(inside.size, 2);
  EXPECT_EQ(inside.points, (std::array{0.2, 0.7}));
  EXPECT_EQ(inside.provenance[0], (Provenance{Kind::master_corner, -1, 1}));
  EXPECT_EQ(inside.provenance[1], (Provenance{Kind::master_corner, -1, 0}));
  const ClipInterval over = clip_interval(-3, 1 - 1e-15);
  EXPECT_EQ(over.points, (std::array{0.0, 1.0}));
  EXPECT_EQ(over.provenance[0], (Provenance{Kind::slave_corner, 0, -1}));
  EXPECT_EQ(over.provenance[1], (Provenance{Kind::slave_corner, 1, -1}));
}

TEST(ClipInterval, TouchingOrApartIsEmpty)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::array<double, 2>> ends{
      {1, 2},      {0, -1},    {3, 2},     {0.5, 0.5},
      {1e-15, -1}, {nan, 0.5}, {0.5, nan}, {nan, nan}};
  for (const auto& [a, b] : ends)
    EXPECT_EQ(clip_interval(a, b).size, 0) << a << " " << b;
}
