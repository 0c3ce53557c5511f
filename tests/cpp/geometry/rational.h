// Area common to convex polygons, in exact arithmetic: over any integer type,
// and over 128 bits for corners on a grid.
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

template <class I>
struct Rational
{
  I numerator;
  I denominator; ///< > 0

  bool operator<(const Rational& b) const
  {
    return numerator * b.denominator < b.numerator * denominator;
  }
};

template <class I>
struct ExactVector
{
  I x, y;

  friend ExactVector operator-(const ExactVector& a, const ExactVector& b)
  {
    return {a.x - b.x, a.y - b.y};
  }
};

using GridVector = ExactVector<Integer>;

template <class I>
I cross(const ExactVector<I>& a, const ExactVector<I>& b)
{
  return a.x * b.y - a.y * b.x;
}

template <class I>
I dot(const ExactVector<I>& a, const ExactVector<I>& b)
{
  return a.x * b.x + a.y * b.y;
}

/// Nearest grid point, in doubles
inline Vec<2> to_grid(const Vec<2>& point)
{
  const double n = std::ldexp(1.0, grid_bits);
  return {std::round(point.x() * n) / n, std::round(point.y() * n) / n};
}

/// Directed line; the polygon is on its left
template <class I>
struct ExactLine
{
  ExactVector<I> point, along;
};

/// Edge lines of a polygon
template <class I>
std::vector<ExactLine<I>> edge_lines(const std::vector<ExactVector<I>>& polygon)
{
  std::vector<ExactLine<I>> lines;
  for (std::size_t k = 0; k < polygon.size(); ++k)
    lines.push_back(
        {polygon[k], polygon[(k + 1) % polygon.size()] - polygon[k]});
  return lines;
}

/// Part [first, second] of line k that is left of all the others. None if it
/// has no length, if the same line came before, or if its opposite is there.
template <class I>
std::optional<std::pair<Rational<I>, Rational<I>>>
inner_part(const std::vector<ExactLine<I>>& lines, std::size_t k)
{
  const ExactLine<I>& line = lines[k];
  std::optional<Rational<I>> first, second;
  for (std::size_t other = 0; other < lines.size(); ++other)
  {
    const auto& [point, along] = lines[other];
    const I height = cross(along, line.point - point);
    const I rise = cross(along, line.along);
    const bool opposite = dot(along, line.along) < 0;
    if (rise == 0 and (height < 0 or (height == 0 and (other < k or opposite))))
      return {};
    const Rational<I> at =
        rise > 0 ? Rational<I>{-height, rise} : Rational<I>{height, -rise};
    if (rise > 0 and (!first or *first < at))
      first = at;
    if (rise < 0 and (!second or at < *second))
      second = at;
  }
  if (!(*first < *second))
    return {};
  return std::pair{*first, *second};
}

/// Twice the areas under the edges of the polygon that is left of all lines,
/// seen from a corner of the first
template <class I>
std::vector<Rational<I>> area_shares(std::vector<ExactLine<I>> lines)
{
  const ExactVector<I> origin = lines.front().point;
  for (ExactLine<I>& line : lines)
    line.point = line.point - origin;
  std::vector<Rational<I>> shares;
  for (std::size_t k = 0; k < lines.size(); ++k)
  {
    if (const auto part = inner_part(lines, k))
    {
      const auto& [t0, t1] = *part;
      const I top =
          (t1.numerator * t0.denominator - t0.numerator * t1.denominator) *
          cross(lines[k].point, lines[k].along);
      shares.push_back({top, t0.denominator * t1.denominator});
    }
  }
  return shares;
}

/// Common area of two convex polygons on the grid. Each edge's share is exact
/// before it is rounded to long double.
inline long double common_area(const std::vector<Vec<2>>& a,
                               const std::vector<Vec<2>>& b)
{
  std::vector<ExactLine<Integer>> lines;
  for (const auto* polygon : {&a, &b})
  {
    std::vector<GridVector> corners;
    for (const Vec<2>& x : *polygon)
      corners.push_back({static_cast<Integer>(std::ldexp(x.x(), grid_bits)),
                         static_cast<Integer>(std::ldexp(x.y(), grid_bits))});
    for (const auto& line : edge_lines(corners))
      lines.push_back(line);
  }
  long double twice = 0;
  for (const auto& [top, bottom] : area_shares(lines))
    twice += static_cast<long double>(top) / static_cast<long double>(bottom);
  return std::ldexp(twice, -1 - 2 * grid_bits);
}
} // namespace raymortar::test
