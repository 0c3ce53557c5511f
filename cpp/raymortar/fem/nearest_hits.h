// Nearest hits: for each slave facet, its point that is nearest to the master.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Of each slave facet with a hit, the one with the smallest gap.
struct NearestHits
{
  std::vector<Index> facet;        ///< slave facets, ascending, (n,)
  std::vector<Vec<2>> xi;          ///< of the point, (n,)
  std::vector<Vec<2>> eta;         ///< of what it has hit, (n,)
  std::vector<GlobalIndex> master; ///< facet that was hit, (n,)
  std::vector<double> gap;         ///< of (1), without an offset; length, (n,)
  std::vector<std::int8_t> closed; ///< whether any point of the facet is, (n,)
};

/// @brief Nearest hits of the points as they are paired; none on tools, which
/// no contact with can be lost in silence: see find_penetrating_points.
[[nodiscard]] NearestHits nearest_hits(const ContactState& s,
                                       const Assembler& assembler);
} // namespace raymortar
