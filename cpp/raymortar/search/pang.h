// Candidate pairs, found by a walk on both surfaces at once.
#pragma once

#include "raymortar/pairing/candidates.h"

namespace raymortar
{
/// @brief Pairs, and how often the walk had to be started.
struct WalkedPairs
{
  Candidates candidates;
  std::int64_t seeds =
      0; ///< pairs that the tree gave; all others were walked to
};

/// @brief Pairs whose boxes overlap, found by the walk of Gander & Japhet
/// [theory, References].
///
/// From a pair that overlaps, the walk goes breadth first over the neighbours
/// of the master, on from those that overlap the slave facet only. What a
/// slave facet found it hands to the neighbours across its edges, where those
/// that overlap are seeds of the same walk. So it finds everything that single
/// steps across an edge of one of the two facets connect with the first pair.
///
/// That is not everything: islands, folds, sheets that leave the reach and
/// come back, and edges of more than two facets cut pairs off. So slave facets
/// are checked, group by group, with what a tree finds around the group. A pair
/// that the walk left out starts it anew. The check costs what finding all
/// pairs by the tree does: this strategy cannot be faster than that one.
/// @param[in] slaves, masters Boxes of the facets
/// @complexity O(slaves + pairs) but for the tree.
/// @see tests/cpp/pairing/test_pang.cpp
template <int D>
[[nodiscard]] WalkedPairs pang(const Surface& slave, const Surface& master,
                               std::span<const Box<D>> slaves,
                               std::span<const Box<D>> masters);

/// @brief The pairs that it finds.
[[nodiscard]] Candidates walk_to_candidates(const Surface& slave,
                                            const Surface& master,
                                            const FacetDistances& distances);
} // namespace raymortar
