// Segments of slave facets below tools of facets: cut where a tool ends.
#pragma once

#include "raymortar/mortar/segmentation.h"
#include "raymortar/rigid/tool.h"

namespace raymortar
{
/// @brief What a slave facet has above it.
enum class Above : std::int8_t
{
  nothing, ///< its rays meet no tool
  inside,  ///< a tool that does not end near it: one segment, the whole facet
  rim      ///< segments, one for each facet of a tool that its rays meet
};

/// @brief Segments below tools, and the facets that have cut them.
struct RimSegments
{
  std::vector<Above> above; ///< (slaves,)
  /// Facets of tools near rims, where they are and were; `body`: the tool of
  /// each. They share no nodes
  Surface facets;
  Segmentation segmentation; ///< whole facets are of master 0
};

/// @brief Whether tools cut slave facets: all have facets, of one kind, and
/// some have rims.
[[nodiscard]] bool have_rims(std::span<const PlacedTool> tools);

/// @brief Whether a rim is in the box around a slave and its rays.
[[nodiscard]] bool rims_are_near(const Surface& slave,
                                 std::span<const PlacedTool> tools,
                                 const FacetDistances& range);

/// @brief Cut the slave facets whose rays pass near a rim.
/// @param[in] range Without skin
/// @param[in] has_multiplier See segments_that_count
[[nodiscard]] RimSegments segments_at_rims(const Surface& slave,
                                           std::span<const PlacedTool> tools,
                                           const FacetDistances& range,
                                           bool subdivide, bool has_multiplier);
} // namespace raymortar
