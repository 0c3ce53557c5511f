// Solids of revolution: coordinates (r, z) of a half plane, about the axis r =
// 0.
#pragma once

#include <numbers>

namespace raymortar
{
/// @brief Length of the circle on which a point (r, z) turns about the axis:
/// area per length of a line in the half plane.
template <class Point>
[[nodiscard]] double circumference(const Point& x)
{
  return 2.0 * std::numbers::pi * x[0];
}
} // namespace raymortar
