// Segments of slave facets below tools: cut where a tool ends.
#pragma once

#include "raymortar/mortar/segmentation.h"
#include "raymortar/target/tool.h"

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
struct ToolSegments
{
  std::vector<Above> above; ///< (slaves,)
  /// Facets of tools near rims, where they are and were; `body`: the tool of
  /// each. They share no nodes
  Surface facets;
  Segmentation segmentation; ///< whole facets are of master 0
};

/// @brief How tools of one kind cut slave facets.
class ToolCutter
{
public:
  ToolCutter() = default;
  ToolCutter(const ToolCutter&) = delete;
  ToolCutter& operator=(const ToolCutter&) = delete;
  virtual ~ToolCutter() = default;

  /// @brief Whether some of the tools cut, and all are of its kind.
  [[nodiscard]] virtual bool
  serves(std::span<const PlacedTool> tools) const = 0;

  /// @brief Whether what cuts is in the box around a slave and its rays.
  [[nodiscard]] virtual bool is_near(const Surface& slave,
                                     std::span<const PlacedTool> tools,
                                     const FacetDistances& range) const = 0;

  /// @brief Cut the slave facets whose rays pass near.
  /// @param[in] range Without skin
  /// @param[in] has_multiplier See segments_that_count
  [[nodiscard]] virtual ToolSegments cut(const Surface& slave,
                                         std::span<const PlacedTool> tools,
                                         const FacetDistances& range,
                                         bool subdivide,
                                         bool has_multiplier) const = 0;
};

/// @brief The cutter of some tools; null: they cut nothing.
[[nodiscard]] inline const ToolCutter*
cutter_of(std::span<const PlacedTool> tools)
{
  const ToolCutter* const cutter =
      tools.empty() ? nullptr : tools.front().tool->cutter();
  return cutter and cutter->serves(tools) ? cutter : nullptr;
}
} // namespace raymortar
