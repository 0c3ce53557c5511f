// Blocks of one slave facet that act on its multiplier besides the law.
#pragma once

#include "raymortar/core/types.h"
#include <vector>

namespace raymortar
{
/// @brief A term - lam . B mu of equation (4) on one slave facet.
struct FacetBlock
{
  Index slave;
  /// B, (unknowns, unknowns) row-major, the unknowns node after node:
  /// length^d / stress
  std::vector<double> block;
};
} // namespace raymortar
