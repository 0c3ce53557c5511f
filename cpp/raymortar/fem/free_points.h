// Points of contact that can move.
#pragma once

#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Whether any displacement of a point's element is unconstrained.
///
/// Contact between facets that are prescribed on both sides has no equation
/// for its traction.
/// @return 0 or 1, (points,)
[[nodiscard]] std::vector<std::int8_t> free_points(const Zone& zone);
} // namespace raymortar
