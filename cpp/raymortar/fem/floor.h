// What assembly cannot do without, for benchmarks: computing alone, and
// writing alone.
#pragma once

#include "raymortar/fem/zone.h"
#include <petscmat.h>

namespace raymortar
{
/// @brief Write blocks of zeros where the tangent's blocks go, by MatSetValues.
///
/// The least that an assembly costs that hands its blocks to PETSc. Assembly
/// of A is the caller's.
/// @return Number of entries written
std::int64_t write_blocks(const Zone& zone, ::Mat A);

/// @brief Compute the blocks of all elements and drop them.
/// @return Sum of all entries, lest they be optimised away
[[nodiscard]] double compute_blocks(const Zone& zone, bool tangent);
} // namespace raymortar
