// Points that are within the master, and too deep for it to be contact.
#pragma once

#include "raymortar/mortar/points.h"
#include "raymortar/pairing/pair_filter.h"
#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief Points whose rays were too deep, although they are within the body
/// that the ray comes out of: contact that is lost.
///
/// Depth and thickness are compared with the distance along the master's
/// normal: points beside a sharp corner are deep along their oblique rays only.
/// With a filter, points below facets of their own body are left out: that may
/// be the back of their own wall.
/// @return Numbers of the points, ascending
[[nodiscard]] std::vector<Index>
find_penetrating_points(const Surface& slave, const Surface& master,
                        const IntegrationPoints& points, const Hits& hits,
                        const FacetDistances& range,
                        const PairFilter* filter = nullptr);

/// @brief Points that a tool has passed: those of facets that are inside one
/// throughout, and that no ray of theirs has led there; and those with a tool
/// behind them, within half of their own body's thickness.
/// @param[in] body The slave's surface on all ranks as a solid, where it is
/// now. Rays into it may leave it at its back before they meet a tool. Null:
/// it is not known, and rays count as if they never left it
[[nodiscard]] std::vector<Index> find_points_inside_tools(
    const Surface& slave, std::span<const PlacedTool> tools,
    const IntegrationPoints& points, const Hits& hits,
    const FacetDistances& range, const Tool* body = nullptr);
} // namespace raymortar
