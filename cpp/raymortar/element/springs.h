// Friction springs: the tangential traction at points that a step hands on.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief What springs hold on every slave facet: a polynomial, and what it
/// lacks at the closed points.
struct Springs
{
  std::vector<double> nodal; ///< (facets, dofs per facet, gdim)
  SpringPoints points;
};

/// @brief Tangential traction of the penalty, or its elastic slip, in the
/// present state, for the next step to start from  [theory (4.13)].
///
/// At the same points the next step begins with the same traction. Facets
/// without a closed point hold none.
/// @param[in] results Of the present state
[[nodiscard]] Springs accepted_springs(const ContactState& state,
                                       const PointResults& results);

/// @brief Elastic slip at the closed points, which springs of a multiplier hold
/// besides the excess of the law; of a law without it, nothing.
[[nodiscard]] SpringPoints accepted_elastic_slip(const ContactState& state,
                                                 const PointResults& results);

/// @brief Number of each integration point among those of the springs that the
/// present state hands on; no_index: it is open.
[[nodiscard]] std::vector<Index> spring_numbers(const ContactState& state,
                                                const PointResults& results);
} // namespace raymortar
