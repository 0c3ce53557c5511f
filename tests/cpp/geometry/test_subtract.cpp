#include "facets.h"
#include "raymortar/geometry/subtract.h"
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;
using Kind = Provenance::Kind;

namespace
{
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
} // namespace

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
