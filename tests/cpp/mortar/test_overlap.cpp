#include "facet_types.h"
#include "raymortar/mortar/overlap.h"
#include "slave_square.h"

using namespace raymortar;
using namespace raymortar::test;
using Kind = Provenance::Kind;

namespace
{
/// Master above the slave, facing down: corners clockwise seen from above
Corners<3> above(const std::vector<Vec<2>>& y, double height)
{
  Corners<3> c;
  for (std::size_t i = 0; i < y.size(); ++i)
    c[i] = Vec<3>(y[i].x(), y[i].y(), height);
  return c;
}

Vec<2> meet(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c, const Vec<2>& d)
{
  const Vec<2> e = b - a, f = d - c, g = c - a;
  return a +
         (g.x() * f.y() - g.y() * f.x()) / (e.x() * f.y() - e.y() * f.x()) * e;
}

/// Vertex from its provenance in the numbers of slave and master
Vec<2> rebuilt(const Provenance& p, const Corners<3>& master, int count)
{
  const auto m = [&](int i) -> Vec<2>
  { return master[static_cast<std::size_t>(i % count)].head<2>(); };
  const auto s = [&](int i)
  { return slave_reference[static_cast<std::size_t>(i % 4)]; };
  if (p.kind == Kind::slave_corner)
    return s(p.slave);
  if (p.kind == Kind::master_corner)
    return m(p.master);
  return meet(s(p.slave), s(p.slave + 1), m(p.master), m(p.master + 1));
}

double turn(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c)
{
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}
} // namespace

TEST(Overlap, ProvenanceIsInTheMastersOwnNumbers)
{
  const auto plane = patch_plane<3>(slave_square, 4);
  std::mt19937 random(1);
  int crossings = 0;
  for (int trial = 0; trial < 5000; ++trial)
  {
    const int count = 3 + trial % 2;
    std::vector<Vec<2>> y{{0, 0}, {0, 1}, {1, 1}, {1, 0}};
    y.resize(static_cast<std::size_t>(count));
    const Vec<2> shift = random_vector<2>(random, 0.8);
    for (Vec<2>& x : y)
      x += shift + random_vector<2>(random, 0.1);
    const Corners<3> master = above(y, 0.1);
    const auto seen = project_patch<3>(plane, master, count);
    ASSERT_EQ(seen.size, count);
    const ClipPolygon region = overlap(slave_reference, 4, seen);
    for (int v = 0; v < region.size; ++v)
    {
      const auto k = static_cast<std::size_t>(v);
      crossings += region.provenance[k].kind == Kind::crossing;
      ASSERT_LT(
          (region.points[k] - rebuilt(region.provenance[k], master, count))
              .norm(),
          1e-12);
    }
  }
  EXPECT_GT(crossings, 1000);
}

TEST(Overlap, IntervalKeepsTheMastersNumbers)
{
  const Corners<2> edge = {Vec<2>(1, 0), Vec<2>(0, 0)};
  const auto plane = patch_plane<2>(edge, 2);
  ASSERT_GT(plane.n[1], 0);
  const Corners<2> master = {Vec<2>(0.3, 0.1), Vec<2>(0.8, 0.2)};
  const auto region = overlap({}, 2, project_patch<2>(plane, master, 2));
  ASSERT_EQ(region.size, 2);
  EXPECT_NEAR(region.points[0], 0.2, 1e-15);
  EXPECT_NEAR(region.points[1], 0.7, 1e-15);
  EXPECT_EQ(region.provenance[0], (Provenance{Kind::master_corner, -1, 1}));
  EXPECT_EQ(region.provenance[1], (Provenance{Kind::master_corner, -1, 0}));
}

TEST(Overlap, ProjectionKnowsItsHeight)
{
  const auto plane = patch_plane<3>(slave_square, 4);
  const Corners<3> tilted = {Vec<3>(0, 0, 0.1), Vec<3>(0, 1, 0.4),
                             Vec<3>(1, 1, 0.6), Vec<3>(1, 0, 0.3)};
  const auto seen = project_patch<3>(plane, tilted, 4);
  ASSERT_EQ(seen.size, 4);
  EXPECT_NEAR(seen.lowest, 0.1, 1e-15);
  EXPECT_NEAR(seen.highest, 0.6, 1e-15);
  EXPECT_NEAR(seen.height({0.5, 0.5}), 0.35, 1e-15);
  EXPECT_NEAR(seen.height({1, 0}), 0.3, 1e-15);
}

TEST(Overlap, PatchesThatDoNotFaceEachOtherAreRejected)
{
  // G-9: angle between the planes in degrees; from 90 on the back is seen
  const auto plane = patch_plane<3>(slave_square, 4);
  for (const auto& [degrees, accepted] : {std::pair{0.0, true},
                                          {60.0, true},
                                          {89.0, true},
                                          {89.99, false},
                                          {90.0, false},
                                          {91.0, false},
                                          {180.0, false}})
  {
    const double angle = degrees * std::numbers::pi / 180;
    Corners<3> master;
    for (std::size_t i = 0; i < 4; ++i)
    {
      const Vec<3>& x = slave_square[3 - i];
      master[i] =
          Vec<3>(std::cos(angle) * x.x(), x.y(), 0.1 + std::sin(angle) * x.x());
    }
    const auto seen = project_patch<3>(plane, master, 4);
    EXPECT_EQ(seen.size > 0, accepted) << degrees;
    if (accepted)
    {
      EXPECT_NEAR(overlap(slave_reference, 4, seen).area(), std::cos(angle),
                  1e-15);
    }
  }
}

TEST(Overlap, MasterWithoutAreaIsRejected)
{
  const auto plane = patch_plane<3>(slave_square, 4);
  EXPECT_EQ(project_patch<3>(plane, above({{0, 0}, {1, 1}, {2, 2}}, 1), 3).size,
            0);
  EXPECT_EQ(
      project_patch<3>(plane, above({{0, 0}, {0, NAN}, {1, 0}}, 1), 3).size, 0);
}

TEST(Overlap, NonConvexProjectionIsTwoTriangles)
{
  const auto plane = patch_plane<3>(slave_square, 4);
  std::mt19937 random(2);
  int cut = 0;
  for (int trial = 0; trial < 20000; ++trial)
  {
    std::vector<Vec<2>> y{{0, 0}, {0, 1}, {1, 1}, {1, 0}};
    for (Vec<2>& x : y)
      x += random_vector<2>(random, 0.5);
    const Corners<3> master = above(y, 0.1);
    const auto seen = project_patch<3>(plane, master, 4);
    if (seen.size == 0)
      continue;
    const auto parts = convex_parts(seen);
    double area = 0, twice = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(parts.size); ++k)
    {
      const auto& p = parts.part[k];
      const auto n = static_cast<std::size_t>(p.size);
      for (std::size_t i = 0; i < n; ++i)
      {
        ASSERT_GE(turn(p.y[i], p.y[(i + 1) % n], p.y[(i + 2) % n]), 0);
        const auto from = static_cast<std::size_t>(p.corner[i]);
        ASSERT_LT((p.y[i] - y[from]).norm(), 1e-15);
      }
      for (std::size_t i = 1; i + 1 < n; ++i)
        area += 0.5 * turn(p.y[0], p.y[i], p.y[i + 1]);
    }
    for (std::size_t i = 1; i + 1 < 4; ++i)
      twice -= turn(y[0], y[i], y[i + 1]);
    if (parts.size > 0)
    {
      ASSERT_NEAR(area, 0.5 * twice, 1e-14);
    }
    cut += parts.size == 2;
  }
  EXPECT_GT(cut, 100);
}

TEST(Overlap, DiagonalOfACutQuadIsNoEdgeOfTheMaster)
{
  const auto plane = patch_plane<3>(slave_square, 4);
  // Corner 2 is pushed past the diagonal from 1 to 3
  const Corners<3> master =
      above({{-0.5, -0.5}, {-0.5, 1.5}, {0.3, 0.2}, {1.5, -0.5}}, 0.1);
  const auto parts = convex_parts(project_patch<3>(plane, master, 4));
  ASSERT_EQ(parts.size, 2);
  int on_diagonal = 0;
  for (std::size_t k = 0; k < 2; ++k)
  {
    const ClipPolygon region = overlap(slave_reference, 4, parts.part[k]);
    ASSERT_GT(region.size, 0);
    for (int v = 0; v < region.size; ++v)
    {
      const auto& p = region.provenance[static_cast<std::size_t>(v)];
      const bool diagonal = p.kind == Kind::crossing and p.master == -1;
      on_diagonal += diagonal;
      if (not diagonal)
      {
        EXPECT_LT(
            (region.points[static_cast<std::size_t>(v)] - rebuilt(p, master, 4))
                .norm(),
            1e-14);
      }
    }
  }
  EXPECT_GT(on_diagonal, 0);
}
