#include "facet_types.h"
#include "raymortar/mortar/plane.h"
#include "slave_square.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
Vec<2> bilinear(const std::array<Vec<2>, 4>& c, const Vec<2>& s)
{
  return (1 - s[0]) * (1 - s[1]) * c[0] + s[0] * (1 - s[1]) * c[1] +
         s[0] * s[1] * c[2] + (1 - s[0]) * s[1] * c[3];
}

Vec<3> bilinear(const Corners<3>& c, const Vec<2>& s)
{
  return (1 - s[0]) * (1 - s[1]) * c[0] + s[0] * (1 - s[1]) * c[1] +
         s[0] * s[1] * c[2] + (1 - s[0]) * s[1] * c[3];
}
} // namespace

TEST(Plane, IntervalBecomesTheUnitInterval)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const double scale = std::pow(10, trial % 19 - 9);
    const Corners<2> c = {scale * random_vector<2>(random, 1),
                          scale * random_vector<2>(random, 1)};
    const auto plane = patch_plane<2>(c, 2);
    ASSERT_TRUE(plane.valid);
    EXPECT_EQ(plane.coordinates(c[0])[0], 0);
    EXPECT_NEAR(plane.coordinates(c[1])[0], 1, 1e-15);
    EXPECT_NEAR(plane.height(c[1]), 0, 1e-15 * scale);
    EXPECT_NEAR(plane.size, (c[1] - c[0]).norm(), 1e-15 * scale);
  }
}

TEST(Plane, TriangleBecomesTheReferenceTriangle)
{
  std::mt19937 random(2);
  for (int trial = 0; trial < 1000; ++trial)
  {
    Corners<3> c;
    for (Vec<3>& x : c)
      x = random_vector<3>(random, 1);
    const auto plane = patch_plane<3>(c, 3);
    if (not plane.valid or plane.dual.norm() > 100)
      continue;
    EXPECT_LT(plane.coordinates(c[0]).norm(), 1e-16);
    EXPECT_LT((plane.coordinates(c[1]) - Vec<2>(1, 0)).norm(), 1e-12);
    EXPECT_LT((plane.coordinates(c[2]) - Vec<2>(0, 1)).norm(), 1e-12);
  }
}

TEST(Plane, CoordinatesAreBlindAlongTheNormal)
{
  std::mt19937 random(3);
  for (int trial = 0; trial < 1000; ++trial)
  {
    Corners<3> c = slave_square;
    for (Vec<3>& x : c)
      x += random_vector<3>(random, 0.3);
    const auto plane = patch_plane<3>(c, 4);
    const Vec<3> x = random_vector<3>(random, 1);
    EXPECT_LT(
        (plane.coordinates(x + 2 * plane.n) - plane.coordinates(x)).norm(),
        1e-14);
    EXPECT_NEAR(plane.height(x + 2 * plane.n) - plane.height(x), 2, 1e-15);
  }
}

TEST(Plane, WarpedQuadrilateralIsHalvedByItsMeanPlane)
{
  for (const double lift : {0.1, 0.5, -0.5})
  {
    Corners<3> c = slave_square;
    c[2][2] += lift;
    const auto plane = patch_plane<3>(c, 4);
    ASSERT_TRUE(plane.valid);
    double sum = 0;
    for (const Vec<3>& x : c)
      sum += plane.height(x);
    EXPECT_NEAR(sum, 0, 1e-15);
    EXPECT_NEAR(plane.height(c[0]), -plane.height(c[1]), 1e-15);
    EXPECT_GT(plane.n[2], 0.7);
  }
}

TEST(Plane, PatchWithoutAreaIsInvalidAtAnyScale)
{
  for (const double scale : {1e-9, 1.0, 1e6})
  {
    Corners<3> line = {scale * Vec<3>(0, 0, 0), scale * Vec<3>(1, 1, 1),
                       scale * Vec<3>(2, 2, 2), scale * Vec<3>(3, 3, 3)};
    EXPECT_FALSE(patch_plane<3>(line, 3).valid);
    EXPECT_FALSE(patch_plane<3>(line, 4).valid);
    line[2] = scale * Vec<3>(0, 1e-6, 0);
    EXPECT_TRUE(patch_plane<3>(line, 3).valid);
    line[2][0] = NAN;
    EXPECT_FALSE(patch_plane<3>(line, 3).valid);
    const Vec<2> point(scale, scale);
    EXPECT_FALSE(patch_plane<2>({point, point}, 2).valid);
  }
}

TEST(InverseBilinear, FindsThePointInTrapezoidsAndSkewQuads)
{
  const std::vector<std::array<Vec<2>, 4>> quads = {
      slave_reference,
      {Vec<2>(0, 0), Vec<2>(1, 0), Vec<2>(0.7, 1), Vec<2>(0.3, 1)},
      {Vec<2>(0, 0), Vec<2>(1, 0), Vec<2>(0.51, 1), Vec<2>(0.49, 1)},
      {Vec<2>(0, 0), Vec<2>(1, 0.3), Vec<2>(1.4, 1.2), Vec<2>(-0.1, 0.8)}};
  std::mt19937 random(4);
  for (const auto& quad : quads)
    for (int trial = 0; trial < 2000; ++trial)
    {
      const Vec<2> s = random_inside<Quad1>(random);
      const Vec<2> found = inverse_bilinear(quad, bilinear(quad, s));
      // Near the short edge of a trapezoid s is worth few digits, y all
      ASSERT_LT((bilinear(quad, found) - bilinear(quad, s)).norm(), 1e-15);
      ASSERT_LT((found - s).norm(), 1e-13);
    }
}

TEST(InverseBilinear, MapsThroughTheMeanPlaneOfAWarpedQuad)
{
  // Projection of the bilinear surface is the bilinear map of the projections
  std::mt19937 random(5);
  for (int trial = 0; trial < 2000; ++trial)
  {
    Corners<3> c = slave_square;
    c[static_cast<std::size_t>(trial % 4)][2] += 0.5;
    for (Vec<3>& x : c)
      x += random_vector<3>(random, 0.1);
    const auto plane = patch_plane<3>(c, 4);
    std::array<Vec<2>, 4> y;
    for (std::size_t i = 0; i < 4; ++i)
      y[i] = plane.coordinates(c[i]);
    const Vec<2> s = random_inside<Quad1>(random);
    const Vec<2> found = inverse_bilinear(y, plane.coordinates(bilinear(c, s)));
    ASSERT_LT((found - s).norm(), 1e-13);
  }
}
