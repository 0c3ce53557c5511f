#include "raymortar/geometry/subtract.h"
#include <algorithm>

namespace raymortar
{
namespace
{
constexpr Provenance cut_vertex{Provenance::Kind::cut, -1, -1};

/// Polygon on its way: a's vertices, and at most one more for each cut
struct Rest
{
  static constexpr int capacity = 2 * ClipPolygon::capacity;
  int size = 0;
  std::array<Vec<2>, capacity> points;
  std::array<Provenance, capacity> provenance;

  void push(const Vec<2>& point, Provenance origin)
  {
    if (size >= capacity) [[unlikely]]
      throw Error("cut polygon with too many vertices");
    points[size] = point;
    provenance[size++] = origin;
  }
};

/// The two parts of a cut; empty if they have no inner point
struct Halves
{
  Rest inside;
  Rest outside;
};

double extent(const ClipPolygon& a, const ClipPolygon& b)
{
  double squared = 0;
  for (const ClipPolygon* polygon : {&a, &b})
    for (int v = 0; v < polygon->size; ++v)
      squared =
          std::max(squared, (polygon->points[v] - a.points[0]).squaredNorm());
  return std::sqrt(squared);
}

/// Signed distance to the line pq, inside > 0; 0 within the tolerance
double distance(const Vec<2>& p, const Vec<2>& q, const Vec<2>& x,
                double tolerance)
{
  const double h = orientation(p, q, x) / (q - p).norm();
  return std::abs(h) > tolerance ? h : 0;
}

/// Polygon without the corners that are on a line with their neighbours to
/// rounding: the line of a short edge there has a wrong direction, and would
/// cut through the polygon
ClipPolygon without_flat_corners(ClipPolygon polygon, double tolerance)
{
  for (int v = 0; v < polygon.size;)
  {
    const int n = polygon.size;
    const Vec<2>& before = polygon.points[(v + n - 1) % n];
    const Vec<2>& after = polygon.points[(v + 1) % n];
    const bool flat =
        !(distance(before, after, polygon.points[v], tolerance) < 0);
    if (flat)
    {
      std::copy(polygon.points.begin() + v + 1, polygon.points.begin() + n,
                polygon.points.begin() + v);
      --polygon.size;
    }
    v = flat ? 0 : v + 1;
  }
  return polygon;
}

Halves cut(const Rest& polygon, const Vec<2>& p, const Vec<2>& q,
           double tolerance)
{
  std::array<double, Rest::capacity> h;
  for (int v = 0; v < polygon.size; ++v)
    h[v] = distance(p, q, polygon.points[v], tolerance);
  const auto [lowest, highest] =
      std::minmax_element(h.begin(), h.begin() + polygon.size);
  if (*lowest >= 0)
    return {polygon, {}};
  if (*highest <= 0)
    return {{}, polygon};
  Halves halves;
  for (int v = 0; v < polygon.size; ++v)
  {
    const int w = (v + 1) % polygon.size;
    const Vec<2>& x = polygon.points[v];
    if (h[v] >= 0)
      halves.inside.push(x, polygon.provenance[v]);
    if (h[v] <= 0)
      halves.outside.push(x, polygon.provenance[v]);
    if (h[v] * h[w] < 0)
    {
      const Vec<2> point = x + h[v] / (h[v] - h[w]) * (polygon.points[w] - x);
      halves.inside.push(point, cut_vertex);
      halves.outside.push(point, cut_vertex);
    }
  }
  return halves;
}

/// Add vertices first, ..., last of a polygon as a piece, if it has an area
void add_part(PolygonPieces& result, const Rest& polygon, int first, int last)
{
  ClipPolygon piece;
  for (int v = first; v <= last; ++v)
    piece.push(polygon.points[v % polygon.size],
               polygon.provenance[v % polygon.size]);
  if (!(piece.area() > 0))
    return;
  if (result.size >= PolygonPieces::capacity) [[unlikely]]
    throw Error("cut polygon with too many pieces");
  result.pieces[result.size++] = piece;
}

/// Add a polygon, halved by a diagonal if it has too many vertices
void add(PolygonPieces& result, const Rest& polygon)
{
  const int middle = polygon.size / 2;
  if (polygon.size <= ClipPolygon::capacity)
  {
    add_part(result, polygon, 0, polygon.size - 1);
    return;
  }
  add_part(result, polygon, 0, middle);
  add_part(result, polygon, middle, polygon.size);
}

void add(IntervalPieces& result, const ClipInterval& piece)
{
  if (piece.points[1] - piece.points[0] > tolerance::merge)
    result.pieces[result.size++] = piece;
}
} // namespace

double PolygonPieces::area() const
{
  double sum = 0;
  for (int k = 0; k < size; ++k)
    sum += pieces[k].area();
  return sum;
}

PolygonPieces subtract_convex(const ClipPolygon& a, const ClipPolygon& b)
{
  PolygonPieces untouched;
  if (a.size == 0)
    return untouched;
  untouched.size = 1;
  untouched.pieces[0] = a;
  const double tolerance = tolerance::cut * extent(a, b);
  const ClipPolygon cutter = without_flat_corners(b, tolerance);
  if (cutter.size < 3)
    return untouched;
  Rest rest;
  for (int v = 0; v < a.size; ++v)
    rest.push(a.points[v], a.provenance[v]);
  PolygonPieces result;
  for (int k = 0; k < cutter.size; ++k)
  {
    const Halves halves = cut(rest, cutter.points[k],
                              cutter.points[(k + 1) % cutter.size], tolerance);
    rest = halves.inside;
    if (rest.size == 0)
      return untouched;
    add(result, halves.outside);
  }
  return result;
}

IntervalPieces subtract_interval(const ClipInterval& a, const ClipInterval& b)
{
  IntervalPieces result;
  if (a.size == 0)
    return result;
  if (b.size == 0)
  {
    add(result, a);
    return result;
  }
  ClipInterval before = a;
  ClipInterval after = a;
  if (b.points[0] < a.points[1])
  {
    before.points[1] = b.points[0];
    before.provenance[1] = cut_vertex;
  }
  if (b.points[1] > a.points[0])
  {
    after.points[0] = b.points[1];
    after.provenance[0] = cut_vertex;
  }
  add(result, before);
  add(result, after);
  return result;
}
} // namespace raymortar
