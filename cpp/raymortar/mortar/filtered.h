// Segments and rays of surfaces that meet themselves.
#pragma once

#include "raymortar/mortar/points.h"
#include "raymortar/pairing/pair_filter.h"

namespace raymortar
{
/// @brief `make_segments` where a filter decides, too; nullptr: none. The
/// candidates have passed it.
[[nodiscard]] Segmentation make_segments(const Surface& slave,
                                         const Surface& master,
                                         const Candidates& candidates,
                                         const SegmentationOptions& options,
                                         const PairFilter* filter);

/// @brief `cast_rays` with hits that a filter allows; nullptr: none.
[[nodiscard]] Hits cast_rays(const Surface& slave, const Surface& master,
                             const IntegrationPoints& points,
                             const FacetDistances& range,
                             const PairFilter* filter);
} // namespace raymortar
