#include "raymortar/geometry/quadrature.h"
#include "raymortar/geometry/reference.h"
#include <Eigen/LU>

namespace raymortar
{
namespace
{
/// Under the linear or bilinear map of the corners, in the order of Reference
template <Shape S>
void append_on(const QuadratureRule& rule,
               const Mat<2, Reference<S>::corners>& corners,
               std::vector<WeightedPoint>& out)
{
  for (std::size_t q = 0; q < rule.points.size(); ++q)
  {
    const Vec<2>& r = rule.points[q];
    const Mat<2, 2> J = corners * Lagrange<S, 1>::gradients(r);
    out.push_back({corners * Lagrange<S, 1>::values(r),
                   rule.weights[q] * J.determinant()});
  }
}
} // namespace

void append_on_interval(const QuadratureRule& rule, double begin, double end,
                        std::vector<WeightedPoint>& out)
{
  for (std::size_t q = 0; q < rule.points.size(); ++q)
    out.push_back({Vec<2>(begin + (end - begin) * rule.points[q][0], 0.0),
                   rule.weights[q] * (end - begin)});
}

void append_on_polygon(const SegmentRules& rules,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out)
{
  const std::size_t n = polygon.size();
  Mat<2, 3> triangle;
  if (n == 3)
  {
    triangle << polygon[0], polygon[1], polygon[2];
    return append_on<Shape::triangle>(rules.simplex, triangle, out);
  }
  if (n == 4)
  {
    Mat<2, 4> corners;
    corners << polygon[0], polygon[1], polygon[3], polygon[2];
    return append_on<Shape::quadrilateral>(rules.quadrilateral, corners, out);
  }
  Vec<2> centre = Vec<2>::Zero();
  for (const Vec<2>& p : polygon)
    centre += p / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i)
  {
    triangle << centre, polygon[i], polygon[(i + 1) % n];
    append_on<Shape::triangle>(rules.fan, triangle, out);
  }
}
} // namespace raymortar
