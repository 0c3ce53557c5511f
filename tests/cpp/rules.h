// Gauss rules of any degree: the library takes its own from Basix.
#pragma once

#include "raymortar/geometry/quadrature.h"
#include "raymortar/geometry/reference.h"
#include <cmath>
#include <numbers>

namespace raymortar::test
{
/// n points on [0, 1], exact to degree 2 n - 1: Newton on Legendre's P_n
inline QuadratureRule gauss(int n)
{
  QuadratureRule rule;
  for (int i = 0; i < n; ++i)
  {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 50; ++step)
    {
      double before = 1, value = x;
      for (int k = 2; k <= n; ++k)
      {
        const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    rule.points.push_back(Vec<2>(0.5 * (1 + x), 0));
    rule.weights.push_back(1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

/// Rule on a reference facet, exact to the degree: products of Gauss rules,
/// for the triangle with the square's edge y = 1 drawn together
inline QuadratureRule rule_on(Shape shape, int degree)
{
  const QuadratureRule line = gauss(degree / 2 + 1);
  if (shape == Shape::interval)
    return line;
  const bool triangle = shape == Shape::triangle;
  const QuadratureRule other = gauss(degree / 2 + (triangle ? 2 : 1));
  QuadratureRule rule;
  for (std::size_t i = 0; i < line.points.size(); ++i)
    for (std::size_t j = 0; j < other.points.size(); ++j)
    {
      const double y = other.points[j].x(), shrink = triangle ? 1 - y : 1;
      rule.points.push_back(Vec<2>(shrink * line.points[i].x(), y));
      rule.weights.push_back(line.weights[i] * other.weights[j] * shrink);
    }
  return rule;
}

/// Rules for the segments of facets of a shape
inline SegmentRules segment_rules(Shape shape, int degree)
{
  if (shape == Shape::interval)
    return {rule_on(shape, degree), {}, {}};
  return {rule_on(Shape::triangle, degree),
          rule_on(Shape::quadrilateral, degree + 1),
          rule_on(Shape::triangle, degree)};
}
} // namespace raymortar::test
