// Number and index types shared by every stage.
#pragma once

#include "raymortar/core/small.h"
#include <cstdint>

namespace raymortar
{
/// Local index (facet, node, dof): never leaves the rank
using Index = std::int32_t;

/// Global index (row of the coupled system, mesh entity): int64 everywhere
using GlobalIndex = std::int64_t;

/// Marks "none" in local index arrays
inline constexpr Index no_index = -1;
} // namespace raymortar
