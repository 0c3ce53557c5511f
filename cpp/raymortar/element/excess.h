// Excess of the law over the multiplier at points, which a step hands on.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief The law's tangential traction less the multiplier, over gamma, as a
/// polynomial on every slave facet, for the next step to start from
/// [theory (4.14), (4.42)].
///
/// The field of the accepted step is turned with the surface, and what the law
/// has changed since then is added: its least squares fit at the closed points.
/// At rest nothing has changed, and nothing is lost. Facets without a closed
/// point hold none.
/// @param[in] results Of the present state
/// @return Nodal values, (facets, dofs per facet, gdim)
[[nodiscard]] std::vector<double> accepted_excess(const ContactState& state,
                                                  const PointResults& results);
} // namespace raymortar
