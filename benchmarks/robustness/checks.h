// What the library makes of a pair, against exact arithmetic.
#pragma once

#include "pairs.h"
#include <functional>

namespace raymortar::test
{
/// Worst errors seen, and inputs that broke a promise
struct Errors
{
  std::int64_t tried = 0;
  std::int64_t failures = 0;
  double area = 0; ///< by the area of the smaller facet
  /// Area error by what the rounding of coordinates, and the merging of
  /// vertices, may move along the smaller facet's diameter
  double roundings = 0;
  double point = 0;   ///< by the same length: off the lines it must lie on
  double seconds = 0; ///< in the library, without the check

  void add(const Errors& other);
};

/// Errors beyond this many roundings are failures
inline constexpr double allowed_roundings = 8;

/// Clip of many pairs. Polygons must be convex, their vertices distinct and on
/// the two edges they are made of, their area that of exact arithmetic.
Errors check_clips(const std::vector<PlanePair>& pairs);

/// Projection along the slave's normal and clip of triangles in space, up to
/// 60 degrees apart
Errors check_projections(std::mt19937& random, int count);

/// Rays from points of one triangle, along its normal, to another
Errors check_rays(std::mt19937& random, int count);

/// Seconds that a call takes
double timed(const std::function<void()>& call);
} // namespace raymortar::test
