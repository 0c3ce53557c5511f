#include "facets.h"
#include "raymortar/geometry/clip.h"
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

/// Vertices distinct, polygon convex and counter-clockwise to rounding
void expect_valid(const ClipPolygon& polygon, double size)
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

double valid_area(const Facet& slave, const Facet& master)
{
  const ClipPolygon polygon = clip_convex(slave, master);
  expect_valid(polygon, diameter(slave));
  return polygon.area();
}
double covered(const Facet& slave, const std::vector<Facet>& masters)
{
  double sum = 0;
  for (const Facet& master : masters)
    sum += clip_convex(slave, master).area();
  return sum;
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

TEST(Clip, SliverKeepsItsArea)
{
  for (double h = 1e-3; h > 1e-9; h /= 10)
  {
    const Facet sliver{{-1, -h / 3}, {1, -h / 3}, {1, h}, {-1, h}};
    for (const double angle : {0.0, 1e-9, 0.3, 1.5})
    {
      const Facet square = moved(unit_square, 1, angle, {0.2, -0.4});
      const Facet slave = moved(sliver, 1, angle, {0.2, 0.1});
      const double area = valid_area(slave, square);
      EXPECT_NEAR(valid_area(square, slave), area, 1e-15);
      EXPECT_GT(area, 0.5 * h);
      const std::vector<Facet> halves{{{-2, -2}, {2, -2}, {2, 2}},
                                      {{-2, -2}, {2, 2}, {-2, 2}}};
      EXPECT_NEAR(covered(slave, halves), facet_area(slave), 1e-15);
    }
    EXPECT_NEAR(valid_area(sliver, unit_square), h, 4e-16 * h);
  }
}

TEST(Clip, LongEdgeThroughATinyFacetHalvesIt)
{
  // The centre is on the edge to rounding, which moves the cut by as much
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 2000; ++trial)
  {
    const double turn = 2 * std::numbers::pi * unit(random);
    const Facet large = moved(unit_triangle, 1, turn, {0, 0});
    const Vec<2> on_edge = large[1] + unit(random) * (large[2] - large[1]);
    const double h = 0.1 * std::pow(10, -7 * unit(random));
    const Facet tiny =
        moved(moved(unit_square, 1, 0, {-0.5, -0.5}), h, unit(random), on_edge);
    const bool within =
        (on_edge - large[1]).norm() > h and (on_edge - large[2]).norm() > h;
    if (!within)
      continue;
    ASSERT_NEAR(valid_area(large, tiny), 0.5 * h * h, 1e-15 * h) << h;
    ASSERT_NEAR(valid_area(tiny, large), 0.5 * h * h, 1e-15 * h) << h;
  }
}

TEST(Clip, NearCoincidenceIsLipschitz)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 2000; ++trial)
  {
    const Facet facet = random_facet(random, 0.1);
    const double size = diameter(facet);
    const double step = size * std::pow(10, -16 + 10 * unit(random));
    const double angle = 2 * std::numbers::pi * unit(random);
    const Vec<2> shift(step * std::cos(angle), step * std::sin(angle));
    const double area = valid_area(facet, moved(facet, 1, 0, shift));
    EXPECT_NEAR(area, facet_area(facet), size * (3 * step + 1e-15));
  }
}

TEST(Clip, FarFromTheOriginLosesOnlyTheOffset)
{
  std::mt19937 random(2);
  const Vec<2> offset(1e6, -1e6);
  for (int trial = 0; trial < 2000; ++trial)
  {
    const Facet slave = random_facet(random, 0.01);
    const Facet master = trial % 4 == 0 ? slave : random_facet(random, 0.01);
    EXPECT_NEAR(
        valid_area(moved(slave, 1, 0, offset), moved(master, 1, 0, offset)),
        valid_area(slave, master), 4e-9);
  }
}

TEST(Clip, AgreesWithExactArithmetic)
{
  std::mt19937 random(3);
  for (int trial = 0; trial < 100000; ++trial)
  {
    const Facet slave = random_grid_facet(random, 1e-4);
    const Facet master = random_grid_facet(random, 1e-4);
    const double exact = static_cast<double>(common_area(slave, master));
    ASSERT_NEAR(valid_area(slave, master), exact, 2e-16) << trial;
  }
}

TEST(Clip, CoincidencesAgreeWithExactArithmetic)
{
  std::mt19937 random(4);
  for (int trial = 0; trial < 100000; ++trial)
  {
    const Facet slave = random_coarse_facet(random);
    const Facet master = random_coarse_facet(random);
    const double exact = static_cast<double>(common_area(slave, master));
    ASSERT_NEAR(valid_area(slave, master), exact, 2e-16) << trial;
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

TEST(Clip, QuadBentInwardsByRoundingIsItsTriangle)
{
  const Facet bent{{0, 0}, {1, 0}, {0.5 - 1e-16, 0.5 - 1e-16}, {0, 1}};
  for (int by = 0; by < 4; ++by)
  {
    EXPECT_NEAR(valid_area(rotated_corners(bent, by), unit_square), 0.5, 1e-15);
    EXPECT_NEAR(valid_area(unit_square, rotated_corners(bent, by)), 0.5, 1e-15);
  }
  const Facet folded{{0, 0}, {1, 0}, {1, 0}, {0, 1}};
  EXPECT_DOUBLE_EQ(valid_area(unit_square, folded), 0.5);
}

TEST(Clip, FacetWithoutAreaGivesNothing)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Facet& bad :
       std::vector<Facet>{{{0, 0}, {1, 1}, {0.5, 0.5}},
                          {{0, 0}, {0, 0}, {0, 0}},
                          {{0, 0}, {0, 1}, {1, 0}},
                          {{0, 0}, {1, 0}, {1, 0}, {0, 0}},
                          {{0, 0}, {0.3, 0.3}, {0.6, 0.6}, {0.9, 0.9}},
                          {{0, 0}, {nan, 0}, {0, 1}},
                          {{nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}},
                          {{0, 0}, {1, 0}, {infinity, infinity}, {nan, 1}}})
  {
    EXPECT_EQ(clip_convex(unit_square, bad).size, 0);
    EXPECT_EQ(clip_convex(bad, unit_square).size, 0);
  }
}

TEST(Clip, AbsurdCoordinatesGiveNothingOrAFinitePolygon)
{
  // An iterate of Newton's method may be anywhere; no exception may come of it
  std::mt19937 random(12);
  std::uniform_real_distribution<double> exponent(-300, 300);
  for (int trial = 0; trial < 20000; ++trial)
  {
    std::array<Facet, 2> pair{Facet(4), Facet(4)};
    for (Facet& facet : pair)
      for (Vec<2>& x : facet)
        for (double& component : x)
          component =
              (random() % 2 == 0 ? 1 : -1) * std::pow(10, exponent(random));
    const ClipPolygon polygon = clip_convex(pair[0], pair[1]);
    ASSERT_TRUE(std::isfinite(polygon.area()));
  }
  // Found by the fuzzer: sides contradict each other where products vanish
  const Facet slave{{1.93101616978e-312, 9.777e-320},
                    {2.4108255004517747e+64, 1.7484050860694e+63},
                    {0, 5.43172907765e-312},
                    {-5.486124068793689e+303, 1.456888840062918e+66}};
  const Facet master{{2.1895594979953788e-277, 2.386302995730437e+64},
                     {8.899684282666963e-308, 7.100924451287169e-304},
                     {2.388562791735076e+64, 5.686073566141286e-270},
                     {-1.3396087580921922e+200, 5.6860735661413805e-270}};
  EXPECT_EQ(clip_convex(slave, master).size, 0);
}

TEST(Clip, FewerThanThreeVerticesGiveNothing)
{
  const Facet touching{{1 - 1e-15, -1}, {2, -1}, {2, 2}, {1 - 1e-15, 2}};
  EXPECT_EQ(clip_convex(unit_square, touching).size, 0);
  const Facet pricking{{1 - 1e-15, 0.5}, {2, 0}, {2, 1}};
  EXPECT_EQ(clip_convex(unit_square, pricking).size, 0);
  const Facet thin{{1 - 1e-14, -1}, {2, -1}, {2, 2}, {1 - 1e-14, 2}};
  EXPECT_EQ(clip_convex(unit_square, thin).size, 4);
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
