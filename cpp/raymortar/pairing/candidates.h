// Candidate pairs: for each slave facet, the masters it may meet.
#pragma once

#include "raymortar/geometry/aabb_tree.h"
#include "raymortar/pairing/distances.h"
#include "raymortar/pairing/surface.h"

namespace raymortar
{
/// @brief Master candidates of each slave facet, compressed by rows.
struct Candidates
{
  std::vector<std::int64_t> offsets = {0};
  std::vector<Index> masters; ///< ascending within a slave facet

  [[nodiscard]] std::span<const Index> masters_of(Index slave) const
  {
    const auto f = static_cast<std::size_t>(slave);
    return {masters.data() + offsets[f],
            static_cast<std::size_t>(offsets[f + 1] - offsets[f])};
  }
};

/// @brief Boxes swept by the slave facets along their rays.
template <int D>
[[nodiscard]] std::vector<Box<D>> ray_boxes(const Surface& slave,
                                            const FacetDistances& distances);

/// @brief Boxes of the deformed facets.
template <int D>
[[nodiscard]] std::vector<Box<D>> facet_boxes(const Surface& surface);

/// @brief Finds the pairs whose boxes overlap. All ways give the same pairs.
using FindPairs = Candidates (*)(const Surface& slave, const Surface& master,
                                 const FacetDistances& distances);

/// @brief By a tree of the master's boxes.
[[nodiscard]] Candidates find_candidates(const Surface& slave,
                                         const Surface& master,
                                         const FacetDistances& distances);

/// @brief Every pair of boxes is compared: the reference.
[[nodiscard]] Candidates compare_all_boxes(const Surface& slave,
                                           const Surface& master,
                                           const FacetDistances& distances);
} // namespace raymortar
