// Friction springs: the tangential traction at points that a step hands on.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Tangential traction of the present state as a polynomial on every
/// slave facet, for the next step to start from  [theory (4.13)]; with a
/// multiplier what it has more than this, over gamma  [theory (4.14)].
///
/// The field of the accepted step is turned with the surface, and what the law
/// has changed since then is added: its least squares fit at the closed points.
/// At rest nothing has changed, and nothing is lost. Facets without a closed
/// point hold none.
/// @param[in] results Of the present state
/// @return Nodal values, (facets, dofs per facet, gdim)
[[nodiscard]] std::vector<double> accepted_springs(const ContactState& state,
                                                   const PointResults& results);
} // namespace raymortar
