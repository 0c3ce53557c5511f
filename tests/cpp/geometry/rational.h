// Area common to convex polygons on an integer grid, in exact arithmetic.
//
// Shares nothing with the clip: each edge line is cut by all the other
// half-planes, and the areas under the remains are added (Green).
#pragma once

#include "raymortar/core/types.h"
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace raymortar::test
{
__extension__ using Integer = __int128;

/// Coordinates are multiples of 2^-19 in [-1, 1]. Edges are then below 2^20,
/// cross products 2^41, differences of two quotients 2^83 over 2^82, and the
/// area under an edge below 2^124: all fit in 127 bits.
inline constexpr int grid_bits = 19;

struct Rational
{
  Integer numerator;
  Integer denominator; ///< > 0

  bool operator<(const Rational& b) const
  {
    return numerator * b.denominator < b.numerator * denominator;
  }
};

struct GridVector
{
  Integer x, y;
};

inline Integer cross(GridVector a, GridVector b)
{
  return a.x * b.y - a.y * b.x;
}

inline Integer dot(GridVector a, GridVector b) { return a.x * b.x + a.y * b.y; }

inline GridVector operator-(GridVector a, GridVector b)
{
  return {a.x - b.x, a.y - b.y};
}

/// Nearest grid point, in doubles
inline Vec<2> to_grid(const Vec<2>& point)
{
  const double n = std::ldexp(1.0, grid_bits);
  return {std::round(point.x() * n) / n, std::round(point.y() * n) / n};
}

/// Directed line; the polygon is on its left
struct GridLine
{
  GridVector point, along;
};

inline std::vector<GridLine> grid_lines(const std::vector<Vec<2>>& polygon)
{
  const auto grid = [](const Vec<2>& x) -> GridVector
  {
    return {static_cast<Integer>(std::ldexp(x.x(), grid_bits)),
            static_cast<Integer>(std::ldexp(x.y(), grid_bits))};
  };
  std::vector<GridLine> lines;
  for (std::size_t k = 0; k < polygon.size(); ++k)
  {
    const GridVector begin = grid(polygon[k]);
    lines.push_back({begin, grid(polygon[(k + 1) % polygon.size()]) - begin});
  }
  return lines;
}

/// Part [first, second] of line k that is left of all the others. None if it
/// has no length, if the same line came before, or if its opposite is there.
inline std::optional<std::pair<Rational, Rational>>
inner_part(const std::vector<GridLine>& lines, std::size_t k)
{
  const GridLine& line = lines[k];
  std::optional<Rational> first, second;
  for (std::size_t other = 0; other < lines.size(); ++other)
  {
    const auto& [point, along] = lines[other];
    const Integer height = cross(along, line.point - point);
    const Integer rise = cross(along, line.along);
    const bool opposite = dot(along, line.along) < 0;
    if (rise == 0 and (height < 0 or (height == 0 and (other < k or opposite))))
      return {};
    const Rational at =
        rise > 0 ? Rational{-height, rise} : Rational{height, -rise};
    if (rise > 0 and (!first or *first < at))
      first = at;
    if (rise < 0 and (!second or at < *second))
      second = at;
  }
  if (!(*first < *second))
    return {};
  return std::pair{*first, *second};
}

/// Common area of two convex polygons on the grid. Each edge's share is exact
/// before it is rounded to long double.
inline long double common_area(const std::vector<Vec<2>>& a,
                               const std::vector<Vec<2>>& b)
{
  std::vector<GridLine> lines = grid_lines(a);
  for (const GridLine& line : grid_lines(b))
    lines.push_back(line);
  const GridVector origin = lines.front().point;
  for (GridLine& line : lines)
    line.point = line.point - origin;
  long double twice = 0;
  for (std::size_t k = 0; k < lines.size(); ++k)
  {
    if (const auto part = inner_part(lines, k))
    {
      const auto& [t0, t1] = *part;
      const Integer top =
          (t1.numerator * t0.denominator - t0.numerator * t1.denominator) *
          cross(lines[k].point, lines[k].along);
      twice += static_cast<long double>(top) /
               static_cast<long double>(t0.denominator * t1.denominator);
    }
  }
  return std::ldexp(twice, -1 - 2 * grid_bits);
}
} // namespace raymortar::test
