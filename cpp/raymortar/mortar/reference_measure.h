// Length or area of a part of a reference facet.
#pragma once

#include "raymortar/geometry/parallelogram.h"
#include <functional>

namespace raymortar
{
/// @brief Length of an interval, signed area of a polygon.
/// @param[in] polygon  Its vertices, two of an interval, whose second
/// coordinates count for nothing
/// @param[in] position Gives the reference coordinates of a vertex
template <class Polygon, class Position = std::identity>
[[nodiscard]] double reference_measure(const Polygon& polygon,
                                       Position position = {})
{
  const auto at = [&](std::size_t i) -> const Vec<2>&
  { return std::invoke(position, polygon[i]); };
  if (polygon.size() == 2)
    return at(1)[0] - at(0)[0];
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    twice += parallelogram(at(i) - at(0), at(i + 1) - at(0));
  return 0.5 * twice;
}
} // namespace raymortar
