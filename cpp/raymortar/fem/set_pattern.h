// The nonzero pattern of a PETSc matrix, replaced so that solvers notice.
#pragma once

#include "raymortar/fem/petsc.h"
#include <span>

namespace raymortar
{
/// @brief Preallocate A with exactly this pattern, and assemble it with zeros.
/// Collective.
///
/// A may have had another pattern, and be the matrix of a KSP: its nonzero
/// state grows, by which PETSc finds out that factors have to be made anew.
/// What is attached to A from Python is lost.
/// @param A Matrix of type "aij", with its sizes
/// @param offsets Begin of each owned row in `columns`, and the end
/// @param columns Global columns, sorted in each row
void set_pattern(PetscMatrix A, std::span<const PetscInt> offsets,
                 std::span<const PetscInt> columns);
} // namespace raymortar
