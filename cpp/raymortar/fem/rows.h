// Rows of the coupled system that a contact element touches.
#pragma once

#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Whether constrained rows are left out (-1, which PETSc ignores: how
/// constraints drop out of an assembly) or kept (a pattern serves whatever
/// constraints come later).
enum class Constrained
{
  left_out,
  kept
};

/// @brief Global rows of some unknowns: displacements node by node,
/// multipliers, those of a free tool.
/// @param[out] rows Resized; reused between calls to save the allocation
void global_rows(const Zone& zone, const Unknowns& unknowns,
                 Constrained constrained, std::vector<PetscInt>& rows);

/// @brief Global rows of an element in the order of ElementLayout.
/// @param[in] master Fetched master facet, or no_index
/// @param[out] rows Resized; reused between calls to save the allocation
void element_rows(const Zone& zone, Index slave, Index master,
                  Constrained constrained, std::vector<PetscInt>& rows);

/// @brief Global rows of a fetched master facet's displacement.
/// @param[out] rows As for element_rows
void master_rows(const Zone& zone, Index master, Constrained constrained,
                 std::vector<PetscInt>& rows);
} // namespace raymortar
