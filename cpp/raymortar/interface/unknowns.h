// Unknowns of a block of a term.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// @brief Unknowns of up to two facets, or of a facet and a free tool, in this
/// order; no_index: none of them.
struct Unknowns
{
  Index slave = no_index;      ///< displacements of this slave facet
  Index multiplier = no_index; ///< multipliers of this slave facet
  Index master = no_index;     ///< displacements of this master facet
  Index tool = no_index;       ///< of this free tool

  [[nodiscard]] bool operator==(const Unknowns&) const = default;
};

/// @brief Those of an element: a slave facet with a master or a free tool, or
/// without.
[[nodiscard]] inline Unknowns element_unknowns(Index slave, Index master,
                                               Index tool = no_index)
{
  return {slave, slave, master, tool};
}
} // namespace raymortar
