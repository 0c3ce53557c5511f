// The displacement dofs of a facet, one number per component.
#pragma once

#include "raymortar/pairing/surface.h"

namespace raymortar
{
/// @brief Call visit(k) for each unrolled displacement dof of a facet,
/// k = gdim * dof + component.
template <class Visit>
void for_facet_dofs(const Surface& s, Index facet, Visit&& visit)
{
  const std::size_t n = s.dofs_per_facet();
  const std::size_t d = s.gdim;
  for (std::size_t a = 0; a < n; ++a)
  {
    const std::size_t dof = s.facet_dofs[facet * n + a];
    for (std::size_t i = 0; i < d; ++i)
      visit(dof * d + i);
  }
}

/// @brief Append the values (dofs, gdim) of a facet's dofs.
inline void append_values(const Surface& s, Index facet,
                          std::span<const double> values,
                          std::vector<double>& out)
{
  for_facet_dofs(s, facet, [&](std::size_t k) { out.push_back(values[k]); });
}
} // namespace raymortar
