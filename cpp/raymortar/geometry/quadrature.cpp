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

void append_on_polygon(const SegmentRules& rules, const Tiles& tiles,
                       std::span<const Vec<2>> polygon,
                       std::vector<WeightedPoint>& out)
{
  Vec<2> centre = Vec<2>::Zero();
  if (tiles.has_centre())
    centre = mean_of_core(tiles, polygon);
  for (int i = 0; i < tiles.size; ++i)
  {
    const Tile& tile = tiles.tiles[i];
    const auto corner = [&](std::size_t k) -> const Vec<2>&
    {
      const std::int8_t v = tile.corners[k];
      return v == Tiles::centre ? centre : polygon[v];
    };
    const QuadratureRule& rule = rules.on(tile.kind);
    if (tile.kind == Tile::Kind::quadrilateral)
    {
      Mat<2, 4> corners;
      corners << corner(0), corner(1), corner(3), corner(2);
      append_on<Shape::quadrilateral>(rule, corners, out);
    }
    else
    {
      Mat<2, 3> corners;
      corners << corner(0), corner(1), corner(2);
      append_on<Shape::triangle>(rule, corners, out);
    }
  }
}
} // namespace raymortar
