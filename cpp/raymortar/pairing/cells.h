// Boxes sorted into the cells of a grid: groups that lie close together.
#pragma once

#include "raymortar/geometry/aabb_tree.h"

namespace raymortar
{
/// @brief Indices of boxes, group by group.
struct BoxGroups
{
  std::vector<Index> order;
  std::vector<std::size_t> offsets = {0};

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
  [[nodiscard]] std::span<const Index> operator[](std::size_t k) const
  {
    return std::span(order).subspan(offsets[k], offsets[k + 1] - offsets[k]);
  }
};

/// @brief Boxes whose centres share a cell, cells along a Morton curve.
///
/// Cells are cubes, sized for a surface of even boxes to have a few in each. A
/// fuller cell is divided by number, so that no group is large. A box with
/// infinite bounds, or bounds that are not numbers, may be in any group.
/// @complexity O(n): a radix sort
template <int D>
[[nodiscard]] BoxGroups group_by_cells(std::span<const Box<D>> boxes);

extern template BoxGroups group_by_cells<2>(std::span<const Box<2>>);
extern template BoxGroups group_by_cells<3>(std::span<const Box<3>>);
} // namespace raymortar
