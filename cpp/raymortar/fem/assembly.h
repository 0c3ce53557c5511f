// Contact blocks into PETSc: residual, tangent, Dirichlet lifting.
#pragma once

#include "raymortar/fem/positions.h"
#include "raymortar/fem/zone.h"
#include <petscmat.h>

namespace raymortar
{
/// @brief Add the residual of a zone to a vector over the coupled rows.
///
/// Constrained rows are left out. Entries of other ranks travel with the
/// vector's assembly, which the caller does.
void add_residual(Zone& zone, ::Vec b);

/// @brief Add the tangent of a zone; constrained rows and columns are left
/// out. Assembly is the caller's.
///
/// Blocks that are zero are not computed: those of points without contact
/// where there is no multiplier.
/// @param[in,out] positions Where the zone's blocks go in A; what is not yet
/// known is looked up. With matrices other than AIJ it is not used.
void add_tangent(Zone& zone, ::Mat A, BlockPositions& positions);

/// @brief b <- b - alpha * (tangent's constrained columns) * increment.
///
/// The counterpart of DOLFINx's apply_lifting for the contact tangent.
/// @param[in] slave Dirichlet increment g - u of the slave dofs, 0 where
/// free, (dofs, gdim)
/// @param[in] master Same for the dofs of zone.state().master
void apply_lifting(Zone& zone, ::Vec b, std::span<const double> slave,
                   std::span<const double> master, double alpha);
} // namespace raymortar
