// Points that are within the master, and too deep for it to be contact.
#pragma once

#include "raymortar/mortar/points.h"

namespace raymortar
{
/// @brief Points whose rays were too deep, although they are within the body
/// that the ray comes out of: contact that is lost.
///
/// Depth and thickness are compared with the distance along the master's
/// normal: points beside a sharp corner are deep along their oblique rays only.
/// @return Numbers of the points, ascending
[[nodiscard]] std::vector<Index>
find_sunk_points(const Surface& slave, const Surface& master,
                 const IntegrationPoints& points, const Hits& hits,
                 const FacetDistances& range);
} // namespace raymortar
