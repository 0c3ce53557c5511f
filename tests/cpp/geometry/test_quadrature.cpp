#include "polygons.h"
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Integral of x^a y^b over a polygon, by Gauss rules on its edges (Green)
double moment(std::span<const Vec<2>> polygon, int a, int b)
{
  const QuadratureRule line = gauss((a + b) / 2 + 2);
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k)
  {
    const Vec<2>& p = polygon[k];
    const Vec<2> e = polygon[(k + 1) % polygon.size()] - p;
    for (std::size_t q = 0; q < line.points.size(); ++q)
    {
      const Vec<2> x = p + line.points[q].x() * e;
      sum += line.weights[q] * e.y() * std::pow(x.x(), a + 1) / (a + 1) *
             std::pow(x.y(), b);
    }
  }
  return sum;
}

double integral(const std::vector<WeightedPoint>& points, int a, int b)
{
  double sum = 0;
  for (const WeightedPoint& p : points)
    sum += p.weight * std::pow(p.xi.x(), a) * std::pow(p.xi.y(), b);
  return sum;
}

void expect_exact(std::span<const Vec<2>> polygon, int degree)
{
  const auto points = lay(segment_rules(Shape::triangle, degree), polygon);
  for (int a = 0; a <= degree; ++a)
    for (int b = 0; a + b <= degree; ++b)
      ASSERT_NEAR(integral(points, a, b), moment(polygon, a, b), 4e-15);
}
} // namespace

TEST(Quadrature, PolygonsAreExactUpToTheRulesDegree)
{
  std::array<int, 9> seen{};
  for (const auto& polygon : random_polygons(2000))
  {
    ++seen[polygon.size()];
    for (const int degree : {1, 2, 3, 4, 5})
      expect_exact(polygon, degree);
  }
  for (std::size_t n = 3; n <= 8; ++n)
    EXPECT_GT(seen[n], 0) << n << " vertices";
}

TEST(Quadrature, QuadrilateralsMayDegenerate)
{
  const double tiny = 1e-15;
  const std::vector<std::vector<Vec<2>>> quadrilaterals = {
      {{0, 0}, {1, 0}, {1, 0}, {0, 1}},             // a triangle
      {{0, 0}, {1, 0}, {1 - tiny, tiny}, {0, 1}},   // nearly so
      {{0, 0}, {0.5, 0}, {1, 0}, {0, 1}},           // three in line
      {{0, 0}, {0.5, -tiny}, {1, 0}, {0, 1}},       // nearly so
      {{0, 0}, {0.5, tiny}, {1, 0}, {0, 1}},        // dented by rounding
      {{0, 0}, {1, 0}, {1, tiny}, {0, tiny}},       // without width
      {{0, 0}, {1, 0}, {0.3, 0.3}, {0, 1}},         // dented
      {{0, 0}, {0.1, 0.9}, {1, 0.5}, {0.2, 0.95}}}; // crossing itself
  for (const auto& polygon : quadrilaterals)
    for (const int degree : {1, 2, 3, 4, 5})
      expect_exact(polygon, degree);
}

TEST(Quadrature, WeightsArePositiveAndPointsInside)
{
  const SegmentRules rules = segment_rules(Shape::triangle, 4);
  for (const auto& polygon : random_polygons(500))
  {
    const std::vector<WeightedPoint> points = lay(rules, polygon);
    for (const WeightedPoint& p : points)
    {
      ASSERT_GT(p.weight, 0);
      for (std::size_t k = 0; k < polygon.size(); ++k)
        ASSERT_GT(
            orientation(polygon[k], polygon[(k + 1) % polygon.size()], p.xi),
            0);
    }
  }
}

TEST(Quadrature, QuadrilateralsHaveNoFirstVertexAndNoDirection)
{
  const std::vector<Vec<2>> polygon = {{0, 0}, {1, 0.1}, {1.3, 0.9}, {0.2, 1}};
  const SegmentRules rules = segment_rules(Shape::quadrilateral, 5);
  const std::vector<WeightedPoint> points = lay(rules, polygon);
  for (const int direction : {1, 3})
    for (std::size_t first = 0; first < 4; ++first)
    {
      std::vector<Vec<2>> same;
      for (std::size_t k = 0; k < 4; ++k)
        same.push_back(
            polygon[(first + k * static_cast<std::size_t>(direction)) % 4]);
      const std::vector<WeightedPoint> others = lay(rules, same);
      ASSERT_EQ(others.size(), points.size());
      for (const WeightedPoint& p : points)
        EXPECT_TRUE(std::any_of(others.begin(), others.end(),
                                [&](const WeightedPoint& o)
                                {
                                  const double sign = direction == 1 ? 1 : -1;
                                  return (o.xi - p.xi).norm() < 1e-15 and
                                         std::abs(o.weight - sign * p.weight) <
                                             1e-16;
                                }));
    }
}

TEST(Quadrature, TrianglesTakeTheRuleAsItIs)
{
  const SegmentRules rules = segment_rules(Shape::triangle, 2);
  const QuadratureRule& rule = rules.simplex;
  const std::vector<WeightedPoint> points = lay(rules, unit_triangle);
  ASSERT_EQ(points.size(), rule.points.size());
  for (std::size_t q = 0; q < points.size(); ++q)
  {
    EXPECT_LT((points[q].xi - rule.points[q]).norm(), 1e-16);
    EXPECT_DOUBLE_EQ(points[q].weight, rule.weights[q]);
  }
}

TEST(Quadrature, IntervalsAreExactAndAppended)
{
  for (const int degree : {1, 5, 7})
  {
    std::vector<WeightedPoint> points;
    append_on_interval(gauss(degree / 2 + 1), 0.2, 0.5, points);
    append_on_interval(gauss(degree / 2 + 1), 0.5, 0.9, points);
    for (int a = 0; a <= degree; ++a)
      EXPECT_NEAR(integral(points, a, 0),
                  (std::pow(0.9, a + 1) - std::pow(0.2, a + 1)) / (a + 1),
                  2e-16);
    for (const WeightedPoint& p : points)
      EXPECT_EQ(p.xi.y(), 0);
  }
}
