// Points grouped by the pair of facets they couple: one dense block each.
#pragma once

#include "raymortar/mortar/points.h"

namespace raymortar
{
/// @brief Virtual elements: a slave facet with the master facet that was hit,
/// or with none (master == no_index) for points without a hit.
struct ContactElements
{
  std::vector<Index> slave;
  std::vector<Index> master;
  std::vector<std::int64_t> offsets = {0}; ///< into `point`, (elements + 1,)
  std::vector<Index> point;                ///< integration points by element

  [[nodiscard]] std::size_t size() const { return slave.size(); }
  [[nodiscard]] std::span<const Index> points_of(std::size_t element) const
  {
    return std::span(point).subspan(
        static_cast<std::size_t>(offsets[element]),
        static_cast<std::size_t>(offsets[element + 1] - offsets[element]));
  }
};

/// @brief Group the points of each slave facet by the master they hit.
[[nodiscard]] ContactElements group_points(const IntegrationPoints& points,
                                           const Hits& hits);
} // namespace raymortar
