// Overlap of one slave patch with one projected master patch, in the plane
// coordinates of the slave. Intervals in 2D and polygons in 3D under one name.
#pragma once

#include "raymortar/geometry/clip.h"
#include "raymortar/geometry/subtract.h"
#include "raymortar/mortar/plane.h"
#include <algorithm>
#include <type_traits>

namespace raymortar
{
/// @brief A master patch seen along the slave normal.
///
/// Corners are counter-clockwise in the slave's coordinates, that is against
/// the master's own order; `corner` keeps the master's numbering.
template <int D>
struct ProjectedPatch
{
  int size = 0;
  std::array<Vec<D - 1>, 4> y;
  std::array<std::int8_t, 4> corner;
  int cycle = 0;        ///< corners of the uncut patch
  Vec<D - 1> slope;     ///< of the height over the slave plane (first corners)
  double height0 = 0.0; ///< height at y[0], length
  double lowest = 0.0, highest = 0.0;

  [[nodiscard]] double height(const Vec<D - 1>& at) const
  {
    return height0 + slope.dot(at - y[0]);
  }
};

/// @brief Project a master patch along the slave normal.
/// @return size 0 where the patches do not face each other (n . n_m above
/// -tolerance::facing) or the master has no area
template <int D>
[[nodiscard]] ProjectedPatch<D>
project_patch(const PatchPlane<D>& plane, const std::array<Vec<D>, 4>& corners,
              int count)
{
  ProjectedPatch<D> p;
  const PatchPlane<D> own = patch_plane<D>(corners, count);
  if (not own.valid or not(own.n.dot(plane.n) < -tolerance::facing))
    return p;
  p.size = count;
  p.cycle = count;
  std::array<double, 4> h{};
  for (int i = 0; i < count; ++i)
  {
    const int from = count - 1 - i;
    const auto k = static_cast<std::size_t>(i);
    const Vec<D>& x = corners[static_cast<std::size_t>(from)];
    p.y[k] = plane.coordinates(x);
    p.corner[k] = static_cast<std::int8_t>(from);
    h[k] = plane.height(x);
  }
  p.height0 = h[0];
  p.lowest = *std::min_element(h.begin(), h.begin() + count);
  p.highest = *std::max_element(h.begin(), h.begin() + count);
  Mat<D - 1, D - 1> A;
  Vec<D - 1> rise;
  for (int j = 0; j < D - 1; ++j)
  {
    const auto k = static_cast<std::size_t>(j) + 1;
    A.row(j) = (p.y[k] - p.y[0]).transpose();
    rise[j] = h[k] - h[0];
  }
  p.slope = A.inverse() * rise;
  return p;
}

/// Region of overlap: an interval or a convex polygon with provenance
template <int D>
using Region = std::conditional_t<D == 2, ClipInterval, ClipPolygon>;

[[nodiscard]] inline double measure_of(const ClipInterval& r)
{
  return r.size == 0 ? 0.0 : r.points[1] - r.points[0];
}
[[nodiscard]] inline double measure_of(const ClipPolygon& r)
{
  return r.size == 0 ? 0.0 : r.area();
}
[[nodiscard]] inline Vec<1> centre_of(const ClipInterval& r)
{
  return Vec<1>(0.5 * (r.points[0] + r.points[1]));
}
[[nodiscard]] inline Vec<2> centre_of(const ClipPolygon& r)
{
  return r.centre();
}

/// @brief Overlap of a slave patch with a projected master patch.
/// @param[in] slave Slave corners in plane coordinates, counter-clockwise
/// @param[in] count Number of slave corners
/// @return Region with provenance in the master's own numbers: edge e runs
/// from corner e to e + 1; -1 where the edge is the diagonal of a cut quad
[[nodiscard]] Region<2> overlap(const std::array<Vec<1>, 4>& slave, int count,
                                const ProjectedPatch<2>& master);
[[nodiscard]] Region<3> overlap(const std::array<Vec<2>, 4>& slave, int count,
                                const ProjectedPatch<3>& master);

/// @brief The projected patch, or the two triangles it must be cut into
/// because its projection is not convex (a strongly warped quadrilateral).
/// An unusable one (turned over in itself) gives none.
struct ConvexParts
{
  int size = 0;
  std::array<ProjectedPatch<3>, 2> part;
};
[[nodiscard]] ConvexParts convex_parts(const ProjectedPatch<3>& patch);
} // namespace raymortar
