// Which unknowns a block of a term belongs to.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// @brief Unknowns of up to two facets, in this order; no_index: none of them.
struct Unknowns
{
  Index slave = no_index;      ///< displacements of this slave facet
  Index multiplier = no_index; ///< multipliers of this slave facet
  Index master = no_index;     ///< displacements of this master facet

  [[nodiscard]] bool operator==(const Unknowns&) const = default;
};

/// @brief Those of an element: a slave facet with a master or without.
[[nodiscard]] inline Unknowns element_unknowns(Index slave, Index master)
{
  return {slave, slave, master};
}
} // namespace raymortar
