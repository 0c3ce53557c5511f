#include "rational.h"
#include "raymortar/geometry/clip.h"
#include "raymortar/geometry/predicates.h"
#include "raymortar/geometry/subtract.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>

using namespace raymortar;
using raymortar::test::common_area;
using raymortar::test::to_grid;
using Kind = Provenance::Kind;

namespace
{
using Facet = std::vector<Vec<2>>;

const Facet unit_square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
const Facet unit_triangle{{0, 0}, {1, 0}, {0, 1}};

double cross(const Vec<2>& a, const Vec<2>& b)
{
  return a.x() * b.y() - a.y() * b.x();
}

double diameter(const Facet& facet)
{
  double d = 0;
  for (const Vec<2>& a : facet)
    for (const Vec<2>& b : facet)
      d = std::max(d, (a - b).norm());
  return d;
}

double facet_area(const Facet& facet)
{
  double twice = 0;
  for (std::size_t k = 1; k + 1 < facet.size(); ++k)
    twice += cross(facet[k] - facet[0], facet[k + 1] - facet[0]);
  return 0.5 * twice;
}

Facet moved(Facet facet, double scale, double angle, const Vec<2>& shift)
{
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  for (Vec<2>& x : facet)
    x = scale * Vec<2>(c * x.x() - s * x.y(), s * x.x() + c * x.y()) + shift;
  return facet;
}

Facet rotated_corners(Facet facet, int by)
{
  std::rotate(facet.begin(), facet.begin() + by, facet.end());
  return facet;
}

/// Corners on an ellipse with random axes: any aspect, always convex
Facet random_facet(std::mt19937& random, double flattest)
{
  std::uniform_real_distribution<double> unit(0, 1);
  const int n = unit(random) < 0.5 ? 3 : 4;
  std::vector<double> angle(n);
  for (double& a : angle)
    a = 2 * std::numbers::pi * unit(random);
  std::sort(angle.begin(), angle.end());
  const double flat = std::pow(flattest, unit(random));
  Facet facet;
  for (int k = 0; k < n; ++k)
    facet.emplace_back(std::cos(angle[k]), flat * std::sin(angle[k]));
  const Vec<2> shift(0.6 * unit(random) - 0.3, 0.6 * unit(random) - 0.3);
  return moved(facet, 0.1 + 0.55 * unit(random),
               2 * std::numbers::pi * unit(random), shift);
}

bool is_convex(const Facet& facet)
{
  const std::size_t n = facet.size();
  for (std::size_t k = 0; k < n; ++k)
    if (orientation(facet[k], facet[(k + 1) % n], facet[(k + 2) % n]) <= 0)
      return false;
  return n == 3 or (orientation(facet[0], facet[1], facet[3]) > 0 and
                    orientation(facet[1], facet[2], facet[3]) > 0);
}

/// Convex after rounding to the grid of the exact oracle
Facet random_grid_facet(std::mt19937& random, double flattest)
{
  Facet facet;
  do
  {
    facet = random_facet(random, flattest);
    std::transform(facet.begin(), facet.end(), facet.begin(), to_grid);
  } while (!is_convex(facet));
  return facet;
}

/// Corners 0, 1, ..., 6: most pairs share corners, edges or lines
Facet random_coarse_facet(std::mt19937& random)
{
  std::uniform_int_distribution<int> coordinate(0, 6);
  Facet facet;
  do
  {
    facet.resize(random() % 2 == 0 ? 3 : 4);
    for (Vec<2>& x : facet)
      x = Vec<2>(coordinate(random), coordinate(random)) / 8;
  } while (!is_convex(facet));
  return facet;
}

/// Corners nearly on each other and edges nearly along each other
Facet random_nudged_facet(std::mt19937& random)
{
  std::uniform_real_distribution<double> unit(0, 1);
  const double step = std::pow(10, -17 + 8 * unit(random));
  Facet facet;
  do
  {
    facet = moved(random_coarse_facet(random), 1, 0.7, {0, 0});
    for (Vec<2>& x : facet)
      x += step * Vec<2>(unit(random) - 0.5, unit(random) - 0.5);
  } while (!is_convex(facet));
  return facet;
}

Vec<2> lines_meet(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c,
                  const Vec<2>& d)
{
  return a + cross(c - a, d - c) / cross(b - a, d - c) * (b - a);
}

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

/// Grid of n x n cells over [-1, 2]^2, nodes moved by up to `jitter` of a cell,
/// cells cut at random into two triangles or left whole
std::vector<Facet> tiling(std::mt19937& random, int n, double jitter)
{
  std::uniform_real_distribution<double> move(-jitter, jitter);
  std::vector<Vec<2>> nodes;
  for (int k = 0; k < (n + 1) * (n + 1); ++k)
    nodes.push_back(3.0 / n *
                        (Vec<2>(k % (n + 1), k / (n + 1)) +
                         Vec<2>(move(random), move(random))) -
                    Vec<2>::Ones());
  std::vector<Facet> facets;
  for (int k = 0; k < n * n; ++k)
  {
    const int first = k % n + (n + 1) * (k / n);
    const Facet q{nodes[first], nodes[first + 1], nodes[first + n + 2],
                  nodes[first + n + 1]};
    const unsigned long cut = random() % 3;
    if (cut == 0)
      facets.push_back(q);
    for (unsigned long t = cut; t < 5 and cut > 0; t += 2)
      facets.push_back({q[t % 4], q[(t + 1) % 4], q[(t + 2) % 4]});
  }
  return facets;
}

/// Area common to two convex polygons, through their triangles
double common(const ClipPolygon& a, const ClipPolygon& b)
{
  double sum = 0;
  for (int v = 1; v + 1 < a.size; ++v)
    for (int w = 1; w + 1 < b.size; ++w)
      sum += clip_convex(Facet{a.points[0], a.points[v], a.points[v + 1]},
                         Facet{b.points[0], b.points[w], b.points[w + 1]})
                 .area();
  return sum;
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

TEST(Clip, FewerThanThreeVerticesGiveNothing)
{
  const Facet touching{{1 - 1e-14, -1}, {2, -1}, {2, 2}, {1 - 1e-14, 2}};
  EXPECT_EQ(clip_convex(unit_square, touching).size, 0);
  const Facet pricking{{1 - 1e-14, 0.5}, {2, 0}, {2, 1}};
  EXPECT_EQ(clip_convex(unit_square, pricking).size, 0);
  const Facet thin{{1 - 1e-12, -1}, {2, -1}, {2, 2}, {1 - 1e-12, 2}};
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
  for (const auto& [a, b] : {std::pair{1.0, 2.0},
                             {0.0, -1.0},
                             {3.0, 2.0},
                             {0.5, 0.5},
                             {1e-14, -1.0},
                             {nan, 0.5},
                             {0.5, nan},
                             {nan, nan}})
    EXPECT_EQ(clip_interval(a, b).size, 0) << a << " " << b;
}

void expect_pieces(const ClipPolygon& a, const ClipPolygon& b)
{
  const PolygonPieces pieces = subtract_convex(a, b);
  ASSERT_NEAR(pieces.area() + common(a, b), a.area(), 3e-13);
  for (int k = 0; k < pieces.size; ++k)
  {
    ASSERT_GE(pieces.pieces[k].size, 3);
    ASSERT_GT(pieces.pieces[k].area(), 0);
    ASSERT_NEAR(common(pieces.pieces[k], b), 0, 3e-13);
    ASSERT_NEAR(common(pieces.pieces[k], a), pieces.pieces[k].area(), 3e-13);
    for (int other = 0; other < k; ++other)
      ASSERT_NEAR(common(pieces.pieces[k], pieces.pieces[other]), 0, 3e-13);
  }
}

TEST(Subtract, PiecesAndOverlapAddUp)
{
  std::mt19937 random(11);
  for (int trial = 0; trial < 45000 and !HasFatalFailure(); ++trial)
  {
    const auto facet = [&]
    {
      return trial % 3 == 0   ? random_facet(random, 0.1)
             : trial % 3 == 1 ? random_coarse_facet(random)
                              : random_nudged_facet(random);
    };
    const Facet slave = facet();
    const ClipPolygon a = clip_convex(slave, facet());
    expect_pieces(a, clip_convex(slave, facet()));
    expect_pieces(a, clip_convex(slave, slave));
  }
}

TEST(Subtract, OctagonsLeaveTheirTips)
{
  const Facet centred = moved(unit_square, 1, 0, {-0.5, -0.5});
  const double turn = std::numbers::pi / 4;
  const ClipPolygon a = clip_convex(centred, moved(centred, 1, turn, {0, 0}));
  for (const double angle : {0.0, turn / 2})
  {
    for (const double size : {0.5, 0.95, 1.0, 1.02, 1.5})
    {
      const ClipPolygon b =
          clip_convex(moved(centred, size, angle, {0, 0}),
                      moved(centred, size, angle + turn, {0, 0}));
      EXPECT_NEAR(subtract_convex(a, b).area(), a.area() - common(a, b), 1e-14);
    }
  }
}

TEST(Subtract, PieceWithManyVerticesIsHalved)
{
  const Facet centred = moved(unit_square, 1, 0, {-0.5, -0.5});
  const double turn = std::numbers::pi / 4;
  const ClipPolygon a = clip_convex(centred, moved(centred, 1, turn, {0, 0}));
  // A sting on one vertex of the octagon: what is beyond its tip has 9
  const Facet sting = moved({{0.52, 0.01}, {0.52, -0.01}, {2, -0.1}, {2, 0.1}},
                            1, std::numbers::pi / 8, {0, 0});
  const ClipPolygon b = clip_convex(sting, moved(unit_square, 8, 0, {-4, -4}));
  const PolygonPieces pieces = subtract_convex(a, b);
  ASSERT_GE(pieces.size, 2);
  EXPECT_EQ(pieces.pieces[0].size + pieces.pieces[1].size, 11);
  EXPECT_NEAR(pieces.area(), a.area() - common(a, b), 1e-14);
}

TEST(Subtract, ApartOrEmptyLeavesAllAndCoveredNothing)
{
  const ClipPolygon a = clip_convex(unit_square, unit_triangle);
  const Facet far = moved(unit_square, 1, 0, {3, 0.2});
  const PolygonPieces all = subtract_convex(a, clip_convex(far, far));
  ASSERT_EQ(all.size, 1);
  EXPECT_EQ(all.pieces[0].size, a.size);
  EXPECT_EQ(all.pieces[0].provenance, a.provenance);
  EXPECT_EQ(subtract_convex(a, {}).size, 1);
  EXPECT_EQ(subtract_convex({}, a).size, 0);
  EXPECT_EQ(subtract_convex(a, a).size, 0);
  EXPECT_EQ(subtract_convex(a, clip_convex(unit_square, unit_square)).size, 0);
}

TEST(Subtract, NewVerticesAreCuts)
{
  const ClipPolygon a = clip_convex(unit_square, unit_square);
  const Facet half{{0.5, -1}, {2, -1}, {2, 2}, {0.5, 2}};
  const PolygonPieces left = subtract_convex(a, clip_convex(unit_square, half));
  ASSERT_EQ(left.size, 1);
  ASSERT_EQ(left.pieces[0].size, 4);
  for (int v = 0; v < 4; ++v)
  {
    const Provenance& p = left.pieces[0].provenance[v];
    const bool corner = left.pieces[0].points[v].x() == 0;
    EXPECT_EQ(p.kind, corner ? Kind::slave_corner : Kind::cut);
    EXPECT_EQ(p.slave == -1, !corner);
    EXPECT_EQ(p.master, -1);
  }
}

TEST(Subtract, IntervalsAddUp)
{
  std::mt19937 random(12);
  std::uniform_real_distribution<double> end(-0.2, 1.2);
  for (int trial = 0; trial < 10000; ++trial)
  {
    const ClipInterval a = clip_interval(end(random), end(random));
    const ClipInterval b = clip_interval(end(random), end(random));
    const IntervalPieces pieces = subtract_interval(a, b);
    double sum = std::max(0.0, std::min(a.points[1], b.points[1]) -
                                   std::max(a.points[0], b.points[0]));
    for (int k = 0; k < pieces.size; ++k)
      sum += pieces.pieces[k].points[1] - pieces.pieces[k].points[0];
    ASSERT_NEAR(sum, a.points[1] - a.points[0], 1e-12);
  }
}

TEST(Subtract, IntervalCutInTheMiddleLeavesBothEnds)
{
  const IntervalPieces pieces =
      subtract_interval(clip_interval(0, 1), clip_interval(0.25, 0.5));
  ASSERT_EQ(pieces.size, 2);
  EXPECT_EQ(pieces.pieces[0].points, (std::array{0.0, 0.25}));
  EXPECT_EQ(pieces.pieces[1].points, (std::array{0.5, 1.0}));
  EXPECT_EQ(pieces.pieces[0].provenance[1].kind, Kind::cut);
  EXPECT_EQ(pieces.pieces[1].provenance[1].kind, Kind::slave_corner);
  EXPECT_EQ(subtract_interval(clip_interval(0, 1), {}).size, 1);
  EXPECT_EQ(subtract_interval({}, clip_interval(0, 1)).size, 0);
}
