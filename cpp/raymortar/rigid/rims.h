// Where surfaces of facets end, and where they have sharp edges.
#pragma once

#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/freedom.h"

namespace raymortar
{
/// @brief Boxes of a surface's rim: of edges (in 2D ends) with a single facet,
/// or with two whose normals turn away from each other by more than 30 degrees.
/// Where slave facets lie below, what their rays meet jumps there.
template <int D>
[[nodiscard]] std::vector<Box<D>> rim_boxes(const ToolFacets& facets);

/// @brief The facets of a tool, free or not; null: it has none.
[[nodiscard]] inline const FacetedTool* faceted(const Tool& tool)
{
  const auto* const free = dynamic_cast<const FreeTool*>(&tool);
  return dynamic_cast<const FacetedTool*>(free ? free->shape().get() : &tool);
}
} // namespace raymortar
