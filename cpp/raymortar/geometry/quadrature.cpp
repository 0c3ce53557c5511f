#include "raymortar/geometry/quadrature.h"

namespace raymortar
{
namespace
{
void append_on_triangle(const QuadratureRule& rule, const Vec<2>& a,
                        const Vec<2>& b, const Vec<2>& c,
                        std::vector<WeightedPoint>& out)
{
  const Vec<2> e = b - a, f = c - a;
  const double det = e[0] * f[1] - e[1] * f[0];
  for (std::size_t q = 0; q < rule.points.size(); ++q)
    out.push_back({a + e * rule.points[q][0] + f * rule.points[q][1],
                   rule.weights[q] * det});
}
} // namespace

void append_on_interval(const QuadratureRule& rule, double begin, double end,
                        std::vector<WeightedPoint>& out)
{
  for (std::size_t q = 0; q < rule.points.size(); ++q)
    out.push_back({Vec<2>(begin + (end - begin) * rule.points[q][0], 0.0),
                   rule.weights[q] * (end - begin)});
}

void append_on_polygon(const QuadratureRule& rule,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out)
{
  const std::size_t n = polygon.size();
  if (n == 3)
    return append_on_triangle(rule, polygon[0], polygon[1], polygon[2], out);
  Vec<2> centre = Vec<2>::Zero();
  for (const Vec<2>& p : polygon)
    centre += p / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i)
    append_on_triangle(rule, centre, polygon[i], polygon[(i + 1) % n], out);
}
} // namespace raymortar
