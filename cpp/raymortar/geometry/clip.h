// Intersection of two convex polygons in the plane, and of two intervals.
#pragma once

#include "raymortar/core/error.h"
#include "raymortar/geometry/orientation.h"
#include "raymortar/geometry/parallelogram.h"
#include <cstdint>
#include <span>

namespace raymortar
{
/// Origin of a clip vertex: the moving segments differentiate through it
struct Provenance
{
  /// In order of preference where two vertices merge
  enum class Kind : std::int8_t
  {
    slave_corner,
    master_corner,
    crossing, ///< a slave edge meets a master edge
    cut       ///< made by a closer layer of master (subtract.h)
  };
  Kind kind = Kind::cut;
  /// Corner, or edge (edge i: corner i -> i+1 mod n) of a crossing; -1: unused
  std::int8_t slave = -1;
  std::int8_t master = -1; ///< As `slave`

  bool operator==(const Provenance&) const = default;
};

/// Convex polygon, counter-clockwise, vertices distinct; size 0 if empty
struct ClipPolygon
{
  /// Two convex quads share at most an octagon
  static constexpr int capacity = 8;
  int size = 0;
  std::array<Vec<2>, capacity> points;
  std::array<Provenance, capacity> provenance;

  /// Area; 0 if empty
  [[nodiscard]] double area() const;

  /// Mean of the vertices: inside, and linear in them. Origin if empty.
  [[nodiscard]] Vec<2> centre() const;

  /// Copy without repeated vertices; of two, the preferred kind stays
  [[nodiscard]] ClipPolygon merged(double squared_distance) const;

  /// Append a vertex. Throws Error beyond the capacity, in release builds too:
  /// the check is lost in the noise of a clip.
  void push(const Vec<2>& point, Provenance origin);
};

/// @brief Intersection of two convex polygons.
///
/// Exact predicates decide which corners are inside and which edges cross, so
/// that masters with common corners share out the slave with neither gap nor
/// overlap; the position of a crossing comes from the two original edges, so
/// that both masters of an edge compute the same point. Ties are broken as if
/// the slave were shifted by (e, e^2), e -> 0+: a slave corner on the edge of
/// two masters belongs to one of them.
/// @param[in] slave   3 or 4 corners, counter-clockwise, convex. Length.
/// @param[in] master  As `slave`. Same unit.
/// @return Polygon; empty if it has fewer than 3 vertices that are
/// tolerance::merge times the slave's diameter apart, or no area.
/// @note A corner that makes a quad non-convex (rounding) is left out. A facet
/// that is flat, clockwise or not a number gives the empty polygon, as do
/// coordinates whose products overflow or vanish.
/// @complexity O(1), no allocation.  @see tests/cpp/geometry/test_clip.cpp
[[nodiscard]] ClipPolygon clip_convex(std::span<const Vec<2>> slave,
                                      std::span<const Vec<2>> master);

/// Part of the slave edge [0, 1]; size 2, or 0 if empty; points ascending
struct ClipInterval
{
  int size = 0;
  std::array<double, 2> points{};
  std::array<Provenance, 2> provenance{};
};

/// @brief Intersection of the slave edge [0, 1] with a master edge.
/// @param[in] master_begin  Position of master corner 0. Unit: slave edge.
/// @param[in] master_end    Position of master corner 1, on either side of it.
/// @return Interval; empty if not longer than tolerance::merge. Slave corner i
/// is at i; an end this close to a slave corner is that corner.
[[nodiscard]] ClipInterval clip_interval(double master_begin,
                                         double master_end);

inline double ClipPolygon::area() const
{
  double twice = 0;
  for (int v = 1; v + 1 < size; ++v)
  {
    const Vec<2> a = points[v] - points[0];
    const Vec<2> b = points[v + 1] - points[0];
    twice += parallelogram(a, b);
  }
  return 0.5 * twice;
}

inline Vec<2> ClipPolygon::centre() const
{
  Vec<2> offset = Vec<2>::Zero();
  for (int v = 1; v < size; ++v)
    offset += points[v] - points[0];
  return size == 0 ? offset : Vec<2>(points[0] + offset / size);
}

inline ClipPolygon ClipPolygon::merged(double squared_distance) const
{
  ClipPolygon merged;
  for (int v = 0; v < size; ++v)
  {
    int w = 0;
    while (w < merged.size and
           (merged.points[w] - points[v]).squaredNorm() > squared_distance)
      ++w;
    if (w == merged.size)
      merged.push(points[v], provenance[v]);
    else if (provenance[v].kind < merged.provenance[w].kind)
    {
      merged.points[w] = points[v];
      merged.provenance[w] = provenance[v];
    }
  }
  return merged;
}

inline void ClipPolygon::push(const Vec<2>& point, Provenance origin)
{
  if (size >= capacity) [[unlikely]]
    throw Error("clip polygon with more than 8 vertices");
  points[size] = point;
  provenance[size++] = origin;
}

namespace detail
{
inline Provenance interval_end(double point, int slave_corner,
                               int master_corner)
{
  if (point == slave_corner)
    return {Provenance::Kind::slave_corner,
            static_cast<std::int8_t>(slave_corner), -1};
  return {Provenance::Kind::master_corner, -1,
          static_cast<std::int8_t>(master_corner)};
}
} // namespace detail

inline ClipInterval clip_interval(double master_begin, double master_end)
{
  const bool forward = master_begin <= master_end;
  const double lower = forward ? master_begin : master_end;
  const double upper = forward ? master_end : master_begin;
  const double first = lower <= tolerance::merge ? 0 : lower;
  const double last = upper >= 1 - tolerance::merge ? 1 : upper;
  if (!(last - first > tolerance::merge))
    return {};
  return {2,
          {first, last},
          {detail::interval_end(first, 0, forward ? 0 : 1),
           detail::interval_end(last, 1, forward ? 1 : 0)}};
}
} // namespace raymortar
