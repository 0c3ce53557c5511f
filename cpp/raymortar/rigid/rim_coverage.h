// Coverage of segments next to the rim of a rigid tool.
#pragma once

#include "raymortar/mortar/points.h"
#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief Add a place of a slave facet whose ray is to be cast.
void add_place(IntegrationPoints& places, Index slave, const Vec<2>& xi);

/// @brief Vertices of a segment.
[[nodiscard]] std::span<const Vec<2>> polygon_of(const Segmentation& s,
                                                 const Segment& one);

/// @brief Whether each segment counts as covered.
///
/// A segment whose middle ray enters no tool does not count: another side of
/// the tool may have cut it. With a multiplier, an open segment of a slave
/// facet along another face of a tool does not count either: beside a punch the
/// slave tilts and sees the punch's sides, but pressure ends at the rim, where
/// it is largest. Open segments beyond would pull the multiplier down.
/// @param[in] facets Facets of the tools, the masters of the segments
/// @param[in] near Tool facets near each slave facet
[[nodiscard]] std::vector<bool>
segments_that_count(const Surface& slave, std::span<const PlacedTool> tools,
                    const Surface& facets, const Candidates& near,
                    const Segmentation& s, const FacetDistances& range,
                    bool has_multiplier);
} // namespace raymortar
