// Pairs of facets of one surface that may meet.
#pragma once

#include "raymortar/pairing/candidates.h"

namespace raymortar
{
/// @brief Keeps smooth neighbours, and the back of a wall, from being contact.
///
/// It is for surfaces that meet themselves, or share vertices: facets with a
/// wedge of material between them never pair, and other hits count if both
/// sides face each other well  [theory (3.14)].
struct PairFilter
{
  std::vector<std::int64_t> offsets = {0}; ///< (slave facets + 1,)
  /// Global numbers of the master facets that each slave facet never meets,
  /// ascending
  std::vector<GlobalIndex> neighbours;
  double facing = 0.2; ///< least -n . n_m of a hit

  /// @param[in] master Global number
  [[nodiscard]] bool allows(Index slave, GlobalIndex master) const;
};

/// @brief The thickness that limits a depth where both facets are of one body:
/// half of the thinner side. The ray through a wall comes out of its back,
/// which faces the slave as another fold does.
[[nodiscard]] double half_thickness(const Surface& slave, Index facet,
                                    const Surface& master, Index hit);

/// @brief Leave out the pairs that a filter does not allow.
void erase_neighbours(Candidates& candidates, const Surface& master,
                      const PairFilter& filter);
} // namespace raymortar
