// How candidate pairs are found, by name.
#pragma once

#include "raymortar/search/pang.h"

namespace raymortar::bindings
{
enum class Strategy
{
  brute_force, ///< every pair of boxes is compared: the reference
  bvh,         ///< tree over the master's boxes
  pang         ///< walk on both surfaces, from facet to facet
};

[[nodiscard]] inline FindPairs function_of(Strategy strategy)
{
  if (strategy == Strategy::brute_force)
    return compare_all_boxes;
  return strategy == Strategy::pang ? walk_to_candidates : find_candidates;
}
} // namespace raymortar::bindings
