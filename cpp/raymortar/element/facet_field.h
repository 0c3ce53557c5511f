// Point values as a polynomial on each slave facet.
#pragma once

#include "raymortar/mortar/points.h"

namespace raymortar
{
/// @brief L2 projection of point values on every slave facet by itself.
///
/// Exact where the values are a polynomial of the displacement's degree, so
/// that a field that is projected again does not change. Zero counts where no
/// point is.
/// @param[in] values (points, gdim)
/// @param[in] facet_rule Rule of the whole facet
/// @return Nodal values, (facets, dofs per facet, gdim)
[[nodiscard]] std::vector<double>
project_on_facets(const Surface& slave, const IntegrationPoints& points,
                  std::span<const double> values,
                  const QuadratureRule& facet_rule);
} // namespace raymortar
