// A surface in parts: what ranks tell each other about where it is.
#pragma once

#include "raymortar/geometry/aabb_tree.h"

namespace raymortar
{
/// @brief Cut boxes into groups that lie together.
///
/// One box around a rank's whole share may be mostly empty (a strip across the
/// other body, two ends of it); one per facet is as much data as the facets.
/// @param[in] boxes One per facet
/// @param[in] most Largest number of parts, a power of 2
/// @param[in] least No part with fewer than this many facets is cut further
/// @return part of each facet, numbered from 0 without holes
/// @complexity O(n log most)
template <int D>
[[nodiscard]] std::vector<Index> parts_of(const std::vector<Box<D>>& boxes,
                                          Index most = 16, Index least = 8);

/// @brief Smallest box around each part.
template <int D>
[[nodiscard]] std::vector<Box<D>> part_boxes(const std::vector<Box<D>>& boxes,
                                             const std::vector<Index>& part);
} // namespace raymortar
