// The plane of a slave patch and its own coordinates, in which masters are
// projected and clipped.
#pragma once

#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/predicates.h"
#include <array>

namespace raymortar
{
/// @brief Plane coordinates of a slave patch.
///
/// A point x has coordinates y = dual^T (x - origin), blind to its distance
/// along the normal: projecting is evaluating. Coordinates are scaled so that
/// an interval becomes [0, 1], a triangle the reference triangle and a
/// parallelogram the unit square, whatever the unit of length.
template <int D>
struct PatchPlane
{
  bool valid = false; ///< false: the patch has no area
  Vec<D> origin;
  Vec<D> n;           ///< unit normal at the barycentre
  Mat<D, D - 1> dual; ///< coordinate gradients, 1/length
  double size = 0.0;  ///< largest edge or diagonal, length

  [[nodiscard]] Vec<D - 1> coordinates(const Vec<D>& x) const
  {
    return dual.transpose() * (x - origin);
  }
  [[nodiscard]] double height(const Vec<D>& x) const
  {
    return n.dot(x - origin);
  }
};

/// @brief Plane through the corners of a patch (mean plane for a warped quad).
/// @param[in] corners Deformed corners, counter-clockwise seen from outside
/// @param[in] count 2, 3 or 4
template <int D>
[[nodiscard]] PatchPlane<D> patch_plane(const std::array<Vec<D>, 4>& corners,
                                        int count)
{
  PatchPlane<D> p;
  Mat<D, D - 1> t;
  p.origin = corners[0];
  t.col(0) = corners[1] - corners[0];
  if constexpr (D == 3)
  {
    t.col(1) = corners[2] - corners[0];
    if (count == 4)
    {
      t.col(0) = 0.5 * (corners[1] - corners[0] + corners[2] - corners[3]);
      t.col(1) = 0.5 * (corners[3] - corners[0] + corners[2] - corners[1]);
      p.origin = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]) -
                 0.5 * (t.col(0) + t.col(1));
    }
  }
  const Vec<D> m = normal_of(t);
  const double area = m.norm();
  p.size = t.colwise().norm().maxCoeff();
  const double scale = D == 3 ? p.size * p.size : p.size;
  p.valid = area > tolerance::degenerate * scale;
  if (p.valid)
  {
    p.n = m / area;
    p.dual = dual_tangents<D>(t);
  }
  return p;
}

/// @brief Where in the unit square the bilinear map through four corners
/// (counter-clockwise) takes the value y: Newton, quadratic from y itself.
[[nodiscard]] inline Vec<2>
inverse_bilinear(const std::array<Vec<2>, 4>& corners, const Vec<2>& y)
{
  const Vec<2>& a = corners[0];
  const Vec<2> b = corners[1] - a, c = corners[3] - a;
  const Vec<2> d = corners[2] - corners[1] - corners[3] + a;
  Vec<2> s = y;
  for (int step = 0; step < 20; ++step)
  {
    Mat<2, 2> A;
    A.col(0) = b + d * s[1];
    A.col(1) = c + d * s[0];
    const Vec<2> ds =
        A.inverse() * (y - a - b * s[0] - c * s[1] - d * s[0] * s[1]);
    s += ds;
    if (not(ds.cwiseAbs().maxCoeff() > tolerance::ray_step))
      break;
  }
  return s;
}
} // namespace raymortar
