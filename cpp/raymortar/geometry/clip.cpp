#include "raymortar/geometry/clip.h"
#include <algorithm>
#include <cassert>

namespace raymortar
{
namespace
{
using Kind = Provenance::Kind;

/// Convex facet without its non-convex corner; ids are the caller's numbers
struct Ring
{
  int size = 0;
  std::array<Vec<2>, 4> points;
  std::array<std::int8_t, 4> ids{};

  [[nodiscard]] int next(int k) const { return k + 1 == size ? 0 : k + 1; }
  [[nodiscard]] const Vec<2>& end(int edge) const { return points[next(edge)]; }
};

/// Sides of all corners, [slave][master] and [master][slave]
struct Sides
{
  /// Twice the area of (master edge j, slave corner a)
  std::array<std::array<double, 4>, 4> slave_height;
  /// Twice the area of (slave edge i, master corner c), [master][slave]
  std::array<std::array<double, 4>, 4> master_height;
  /// Slave corner a is on the inner side of master edge j
  std::array<std::array<bool, 4>, 4> slave_inside;
  /// Master corner c is on the inner side of slave edge i
  std::array<std::array<bool, 4>, 4> master_inside;
};

/// Side of pq to which a point on it moves with the shift (e, e^2), e -> 0+
bool shifts_inside(const Vec<2>& p, const Vec<2>& q)
{
  return p.y() != q.y() ? q.y() < p.y() : q.x() > p.x();
}

/// First corner that a quad is better without, or its size
int bad_corner(std::span<const Vec<2>> corners)
{
  const int n = static_cast<int>(corners.size());
  for (int k = 0; n == 4 && k < n; ++k)
  {
    const Vec<2>& x = corners[k];
    const Vec<2>& next = corners[(k + 1) % n];
    if (x == next or orientation(corners[(k + n - 1) % n], x, next) < 0)
      return k;
  }
  return n;
}

/// Empty if the facet has no positive area
Ring make_ring(std::span<const Vec<2>> corners)
{
  assert(corners.size() == 3 or corners.size() == 4);
  const int n = static_cast<int>(corners.size());
  const int bad = bad_corner(corners);
  Ring ring;
  for (int k = 0; k < n; ++k)
  {
    if (k == bad)
      continue;
    ring.ids[ring.size] = static_cast<std::int8_t>(k);
    ring.points[ring.size++] = corners[k];
  }
  const auto& p = ring.points;
  const bool positive = orientation(p[0], p[1], p[2]) > 0 or
                        (ring.size == 4 and orientation(p[2], p[3], p[0]) > 0);
  if (!positive)
    ring.size = 0;
  return ring;
}

Sides find_sides(const Ring& slave, const Ring& master)
{
  Sides sides;
  for (int i = 0; i < slave.size; ++i)
    for (int j = 0; j < master.size; ++j)
    {
      const Vec<2>& s = slave.points[i];
      const Vec<2>& m = master.points[j];
      const double h = orientation(m, master.end(j), s);
      sides.slave_height[i][j] = h;
      sides.slave_inside[i][j] =
          h != 0 ? h > 0 : shifts_inside(m, master.end(j));
      const double g = orientation(s, slave.end(i), m);
      sides.master_height[j][i] = g;
      // A shift of the slave is the opposite shift of the master
      sides.master_inside[j][i] =
          g != 0 ? g > 0 : !shifts_inside(s, slave.end(i));
    }
  return sides;
}

/// Master edge through which slave edge i enters (or leaves), or -1
int crossed_edge(const Sides& sides, const Ring& slave, const Ring& master,
                 int i, bool entering)
{
  const int k = slave.next(i);
  for (int j = 0; j < master.size; ++j)
  {
    if (sides.slave_inside[i][j] != entering and
        sides.slave_inside[k][j] == entering and
        sides.master_inside[j][i] == entering and
        sides.master_inside[master.next(j)][i] != entering)
      return j;
  }
  return -1;
}

/// Point of ab at the heights' zero, measured from the nearer end. The heights
/// have opposite signs, so nothing cancels.
Vec<2> zero_of(const Vec<2>& a, const Vec<2>& b, double h_a, double h_b)
{
  if (std::abs(h_a) <= std::abs(h_b))
    return a + h_a / (h_a - h_b) * (b - a);
  return b + h_b / (h_b - h_a) * (a - b);
}

bool all_true(const std::array<bool, 4>& row, int size)
{
  return std::all_of(row.begin(), row.begin() + size,
                     [](bool value) { return value; });
}

/// Walk of the intersection's boundary, along the slave where it is inside the
/// master and along the master elsewhere
struct Walk
{
  const Ring& slave;
  const Ring& master;
  const Sides sides = find_sides(slave, master);
  ClipPolygon polygon{};
  int first_entry = -1;
  int last_exit = -1;
  /// More vertices than two convex facets have in common: products of their
  /// coordinates overflow or vanish, so that the sides contradict each other
  bool contradictory = false;

  void push(const Vec<2>& point, Provenance origin)
  {
    contradictory = contradictory or polygon.size == ClipPolygon::capacity;
    if (!contradictory)
      polygon.push(point, origin);
  }

  [[nodiscard]] bool inside(int slave_corner) const
  {
    return all_true(sides.slave_inside[slave_corner], master.size);
  }

  /// On the shorter edge: on the longer one, the heights over a much shorter
  /// one are small differences of products as large as the longer one squared
  [[nodiscard]] Vec<2> crossing(int i, int j) const
  {
    const Vec<2>&s = slave.points[i], &s_end = slave.end(i);
    const Vec<2>&m = master.points[j], &m_end = master.end(j);
    if ((s_end - s).squaredNorm() <= (m_end - m).squaredNorm())
      return zero_of(s, s_end, sides.slave_height[i][j],
                     sides.slave_height[slave.next(i)][j]);
    return zero_of(m, m_end, sides.master_height[j][i],
                   sides.master_height[master.next(j)][i]);
  }

  void push_crossing(int i, int j)
  {
    push(crossing(i, j), {Kind::crossing, slave.ids[i], master.ids[j]});
  }

  /// Master corners between two master edges
  void follow_master(int from, int to)
  {
    for (int k = from; k != to;)
    {
      k = master.next(k);
      push(master.points[k], {Kind::master_corner, -1, master.ids[k]});
    }
  }

  void along_slave_edge(int i)
  {
    if (inside(i))
      push(slave.points[i], {Kind::slave_corner, slave.ids[i], -1});
    if (const int j = crossed_edge(sides, slave, master, i, true); j >= 0)
    {
      if (last_exit >= 0)
        follow_master(last_exit, j);
      else
        first_entry = j;
      push_crossing(i, j);
    }
    if (const int j = crossed_edge(sides, slave, master, i, false); j >= 0)
    {
      push_crossing(i, j);
      last_exit = j;
    }
  }

  /// Without a crossing one facet holds the other, or they are apart
  void run()
  {
    for (int i = 0; i < slave.size; ++i)
      along_slave_edge(i);
    if (first_entry >= 0)
      follow_master(last_exit, first_entry);
    if (polygon.size == 0 and all_true(sides.master_inside[0], slave.size))
    {
      push(master.points[0], {Kind::master_corner, -1, master.ids[0]});
      follow_master(0, master.size - 1);
    }
  }
};

double squared_diameter(const Ring& ring)
{
  double diameter = 0;
  for (int a = 0; a < ring.size; ++a)
    for (int b = 0; b < a; ++b)
      diameter =
          std::max(diameter, (ring.points[a] - ring.points[b]).squaredNorm());
  return diameter;
}

/// Index of the ring's corner within the distance of a point, or -1
int corner_at(const Ring& ring, const Vec<2>& point, double squared_distance)
{
  for (int k = 0; k < ring.size; ++k)
    if ((ring.points[k] - point).squaredNorm() <= squared_distance)
      return k;
  return -1;
}

/// A vertex on a corner is that corner, the slave's first
void snap(Vec<2>& point, Provenance& origin, const Ring& slave,
          const Ring& master, double squared_distance)
{
  if (origin.kind == Kind::slave_corner)
    return;
  if (const int a = corner_at(slave, point, squared_distance); a >= 0)
  {
    point = slave.points[a];
    origin = {Kind::slave_corner, slave.ids[a], -1};
  }
  else if (const int c = corner_at(master, point, squared_distance); c >= 0)
  {
    point = master.points[c];
    origin = {Kind::master_corner, -1, master.ids[c]};
  }
}
} // namespace

ClipPolygon clip_convex(std::span<const Vec<2>> slave,
                        std::span<const Vec<2>> master)
{
  const Ring s = make_ring(slave);
  const Ring m = make_ring(master);
  if (s.size == 0 or m.size == 0)
    return {};
  Walk walk{s, m};
  walk.run();
  if (walk.contradictory) [[unlikely]]
    return {};
  const double distance =
      tolerance::merge * tolerance::merge * squared_diameter(s);
  for (int v = 0; v < walk.polygon.size; ++v)
    snap(walk.polygon.points[v], walk.polygon.provenance[v], s, m, distance);
  ClipPolygon polygon = walk.polygon.merged(distance);
  const double area = polygon.area();
  if (!(area > 0 and std::isfinite(area)))
    polygon.size = 0;
  return polygon;
}
} // namespace raymortar
