// Points -> rays on rigid tools.
#pragma once

#include "raymortar/mortar/points.h"
#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief Cast the ray of every covered point on some tools, which count as
/// masters numbered as they come.
///
/// If a ray meets several tools, a tool around the point goes before those
/// ahead, and a near one before a far one.
/// @param[in] range Reach, and the depth if it was given: nothing else limits
/// how far a point may be inside a tool
[[nodiscard]] Hits cast_on_tools(const Surface& slave,
                                 std::span<const PlacedTool> tools,
                                 const IntegrationPoints& points,
                                 const FacetDistances& range);

/// @brief Tools where they were at the accepted step.
[[nodiscard]] std::vector<PlacedTool>
where_they_were(std::span<const PlacedTool> tools);
} // namespace raymortar
