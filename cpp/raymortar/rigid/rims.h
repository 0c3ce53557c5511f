// Rims: ends and sharp edges of surfaces of facets.
#pragma once

#include "raymortar/rigid/facet_tool.h"
#include "raymortar/target/freedom.h"

namespace raymortar
{
/// @brief Boxes of a surface's rim: edges (in 2D ends) with a single facet, or
/// with two whose normals turn away from each other by more than 30 degrees.
/// Rays of slave facets below a rim jump from facet to facet there.
template <int D>
[[nodiscard]] std::vector<Box<D>> rim_boxes(const ToolFacets& facets);

/// @brief The facets of a tool, free or not; null: it has none.
[[nodiscard]] inline const FacetedTool* faceted(const Tool& tool)
{
  const auto* const free = dynamic_cast<const FreeTool*>(&tool);
  return dynamic_cast<const FacetedTool*>(free ? free->shape().get() : &tool);
}
} // namespace raymortar
