#include "facets.h"
#include "raymortar/geometry/clip.h"
#include "raymortar/geometry/orientation.h"
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Twice the area on a grid of 2^-40, exact in 128 bits
Integer exact(const Vec<2>& p, const Vec<2>& q, const Vec<2>& x)
{
  const auto grid = [](const Vec<2>& at) -> GridVector
  {
    return {static_cast<Integer>(std::ldexp(at.x(), 40)),
            static_cast<Integer>(std::ldexp(at.y(), 40))};
  };
  return cross(grid(p) - grid(x), grid(q) - grid(x));
}

Vec<2> on_grid(const Vec<2>& x)
{
  return {std::ldexp(std::round(std::ldexp(x.x(), 40)), -40),
          std::ldexp(std::round(std::ldexp(x.y(), 40)), -40)};
}
} // namespace

TEST(Orientation, HasTheExactSignAndSixDigitsOfTheValue)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  int zero = 0;
  for (int trial = 0; trial < 100000; ++trial)
  {
    const Vec<2> p = on_grid({unit(random), unit(random)});
    const Vec<2> q = on_grid({unit(random), unit(random)});
    // Off the line by 1e-16 to 1, or on it
    const double off = trial % 4 == 0 ? 0 : std::pow(10, -16 * unit(random));
    const Vec<2> x = on_grid(p + unit(random) * (q - p) +
                             off * Vec<2>(q.y() - p.y(), p.x() - q.x()));
    const Integer twice = exact(p, q, x);
    const double value = orientation(p, q, x);
    const double expected = std::ldexp(static_cast<double>(twice), -80);
    ASSERT_EQ(value > 0, twice > 0);
    ASSERT_EQ(value < 0, twice < 0);
    ASSERT_NEAR(value, expected, 1e-6 * std::abs(expected));
    zero += twice == 0;
  }
  EXPECT_LT(zero, 50000);
}

TEST(Orientation, ChangesSignWithTheOrderOnly)
{
  std::mt19937 random(2);
  for (int trial = 0; trial < 10000; ++trial)
  {
    const double step = std::pow(10, -17 + trial % 9);
    const Vec<2> p = random_facet(random, 1)[0], q = random_facet(random, 1)[0];
    const Facet t{p, q, 0.3 * p + 0.7 * q + step * Vec<2>(1, -1)};
    const double value = orientation(t[0], t[1], t[2]);
    for (const double other :
         {orientation(t[1], t[2], t[0]), orientation(t[2], t[0], t[1]),
          -orientation(t[1], t[0], t[2]), -orientation(t[0], t[2], t[1])})
    {
      ASSERT_EQ(value > 0, other > 0);
      ASSERT_EQ(value < 0, other < 0);
    }
  }
}

TEST(Orientation, PlacesCrossingsOfNearlyParallelEdgesOnBoth)
{
  // Neighbours that share an edge up to rounding: a crossing anywhere on the
  // line would fold the polygon over, and its quadrature weights below zero
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  int crossings = 0;
  for (int trial = 0; trial < 100000; ++trial)
  {
    Facet slave = unit_square;
    Facet master = moved(unit_square, 1, 0, {0.3, 0});
    const double angle = unit(random);
    const Vec<2> shift(unit(random), unit(random));
    slave = moved(slave, 1, angle, shift);
    master = moved(master, 0.9, angle, shift);
    const ClipPolygon p = clip_convex(slave, master);
    ASSERT_GE(p.size, 4);
    for (int v = 0; v < p.size; ++v)
    {
      const Vec<2> a = p.points[v] - p.centre();
      const Vec<2> b = p.points[(v + 1) % p.size] - p.centre();
      ASSERT_GT(cross(a, b), -1e-15);
      crossings += p.provenance[v].kind == Provenance::Kind::crossing;
    }
  }
  EXPECT_GT(crossings, 1000);
}
