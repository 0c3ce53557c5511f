// Part of a polygon, or interval, that a closer layer of master leaves over.
#pragma once

#include "raymortar/geometry/clip.h"

namespace raymortar
{
/// Convex polygons without overlap
struct PolygonPieces
{
  /// Each of the at most 8 edges of b cuts one piece off. Beyond edge k only
  /// the lines of b before and after it can bound the piece as well, so it has
  /// at most 3 vertices more than a, and is halved if these are more than 8.
  /// A piece of 9 takes 6 of a's edges and leaves no second piece as many.
  static constexpr int capacity = ClipPolygon::capacity + 1;
  int size = 0;
  std::array<ClipPolygon, capacity> pieces;

  [[nodiscard]] double area() const;
};

/// @brief Convex pieces of a minus b.
///
/// Each edge line of b cuts off the part of a beyond it, and the rest goes on.
/// Since a piece is a ClipPolygon again, several b can be taken away in turn.
/// @param[in] a, b  Convex, counter-clockwise polygons. Same unit of length.
/// @return Pieces with an area; a itself if b does not meet it, none if b
/// covers it. A vertex of a keeps its provenance, one made by b is a Kind::cut.
/// @note What sticks out of b by less than tolerance::cut times the extent
/// of both is not cut off.
/// @complexity O(1), no allocation.  @see tests/cpp/geometry/test_subtract.cpp
[[nodiscard]] PolygonPieces subtract_convex(const ClipPolygon& a,
                                            const ClipPolygon& b);

/// Intervals without overlap, ascending
struct IntervalPieces
{
  int size = 0;
  std::array<ClipInterval, 2> pieces{};
};

/// @brief Parts of the interval a outside b, longer than tolerance::merge.
/// @return Pieces; an end made by b is a Kind::cut.
[[nodiscard]] IntervalPieces subtract_interval(const ClipInterval& a,
                                               const ClipInterval& b);
} // namespace raymortar
