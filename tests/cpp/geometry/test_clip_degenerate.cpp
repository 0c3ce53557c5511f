#include "clipping.h"
#include <gtest/gtest.h>
#include <limits>

using namespace raymortar;
using namespace raymortar::test;

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
