// Candidate pairs, patch by patch of the slave surface.
#pragma once

#include "raymortar/pairing/candidates.h"

namespace raymortar
{
/// @brief Pairs whose boxes overlap, found by an advancing front.
///
/// Neighbouring facets meet neighbouring masters (Gander & Japhet [theory,
/// References]): the front moves across edges, starting again for each
/// connected part. It moves by patches of neighbours: the tree is
/// asked once for a patch, and its facets are compared with what is found.
/// Walking the master from facet to facet as well, as they do, is pang().
/// @param[in] slaves, masters Boxes of the facets
/// @complexity O(slaves + masters) but for the tree.
/// @see tests/cpp/pairing/test_advancing_front.cpp
template <int D>
[[nodiscard]] Candidates advancing_front(const Surface& slave,
                                         std::span<const Box<D>> slaves,
                                         std::span<const Box<D>> masters);
} // namespace raymortar
