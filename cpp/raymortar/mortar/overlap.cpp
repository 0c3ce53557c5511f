#include "raymortar/mortar/overlap.h"

namespace raymortar
{
namespace
{
/// Twice the signed area of a triangle
double twice_area(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c)
{
  return parallelogram(b - a, c - a);
}

/// From positions in the projected patch to the master's own numbers
template <int D>
void restore_numbers(Provenance& from, const ProjectedPatch<D>& patch)
{
  if (from.master < 0)
    return;
  const auto i = static_cast<std::size_t>(from.master);
  const std::int8_t begin = patch.corner[i];
  const std::int8_t end =
      patch.corner[(i + 1) % static_cast<std::size_t>(patch.size)];
  if (from.kind == Provenance::Kind::master_corner)
    from.master = begin;
  else if ((end + 1) % patch.cycle == begin)
    from.master = end;
  else
    from.master = -1;
}

ProjectedPatch<3> triangle_of(const ProjectedPatch<3>& quad,
                              std::array<std::size_t, 3> keep)
{
  ProjectedPatch<3> t = quad;
  t.size = 3;
  for (std::size_t i = 0; i < 3; ++i)
  {
    t.y[i] = quad.y[keep[i]];
    t.corner[i] = quad.corner[keep[i]];
  }
  t.height0 = quad.height(t.y[0]);
  return t;
}
} // namespace

Region<2> overlap(const std::array<Vec<1>, 4>&, int,
                  const ProjectedPatch<2>& master)
{
  ClipInterval r = clip_interval(master.y[0][0], master.y[1][0]);
  for (int i = 0; i < r.size; ++i)
    restore_numbers(r.provenance[static_cast<std::size_t>(i)], master);
  return r;
}

Region<3> overlap(const std::array<Vec<2>, 4>& slave, int count,
                  const ProjectedPatch<3>& master)
{
  ClipPolygon r = clip_convex(
      std::span(slave.data(), static_cast<std::size_t>(count)),
      std::span(master.y.data(), static_cast<std::size_t>(master.size)));
  for (int i = 0; i < r.size; ++i)
    restore_numbers(r.provenance[static_cast<std::size_t>(i)], master);
  return r;
}

ConvexParts convex_parts(const ProjectedPatch<3>& patch)
{
  ConvexParts parts;
  if (patch.size == 3)
  {
    parts.size = 1;
    parts.part[0] = patch;
    return parts;
  }
  const auto& y = patch.y;
  const std::array<double, 4> turn = {
      twice_area(y[3], y[0], y[1]), twice_area(y[0], y[1], y[2]),
      twice_area(y[1], y[2], y[3]), twice_area(y[2], y[3], y[0])};
  if (*std::min_element(turn.begin(), turn.end()) >= 0.0)
  {
    parts.size = 1;
    parts.part[0] = patch;
  }
  else if (turn[1] > 0.0 and turn[3] > 0.0)
  {
    parts.size = 2;
    parts.part[0] = triangle_of(patch, {0, 1, 2});
    parts.part[1] = triangle_of(patch, {2, 3, 0});
  }
  else if (turn[0] > 0.0 and turn[2] > 0.0)
  {
    parts.size = 2;
    parts.part[0] = triangle_of(patch, {3, 0, 1});
    parts.part[1] = triangle_of(patch, {1, 2, 3});
  }
  return parts;
}
} // namespace raymortar
