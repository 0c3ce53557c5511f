// Contact blocks into PETSc: residual, tangent, Dirichlet lifting.
#pragma once

#include "raymortar/fem/positions.h"
#include "raymortar/fem/zone.h"
#include <petscmat.h>

namespace raymortar
{
/// @brief Blocks of the assemblies so far, seconds of the last ones.
struct AssemblyStatistics
{
  std::int64_t residual_blocks = 0;
  std::int64_t tangent_blocks = 0;
  std::int64_t lifted_blocks = 0;  ///< tangent blocks for Dirichlet increments
  std::int64_t skipped_blocks = 0; ///< left out of tangents: they are zero
  std::int64_t lookups = 0;        ///< blocks whose places had to be found
  double seconds_residual = 0.0;
  double seconds_tangent = 0.0;
};

/// @brief Calls visit(name, value) for every field.
template <class Visit>
constexpr void for_each_field(const AssemblyStatistics& s, Visit&& visit)
{
  visit("residual_blocks", s.residual_blocks);
  visit("tangent_blocks", s.tangent_blocks);
  visit("lifted_blocks", s.lifted_blocks);
  visit("skipped_blocks", s.skipped_blocks);
  visit("lookups", s.lookups);
  visit("seconds_residual", s.seconds_residual);
  visit("seconds_tangent", s.seconds_tangent);
}

/// @brief Add the residual of a zone to a vector over the coupled rows.
///
/// Constrained rows are left out. Entries of other ranks travel with the
/// vector's assembly, which the caller does.
/// @param[in,out] statistics Counts go on, as of the functions below
void add_residual(const Zone& zone, PetscVector b,
                  AssemblyStatistics& statistics);

/// @brief Add the tangent of a zone; constrained rows and columns are left
/// out. Assembly is the caller's.
///
/// Blocks that are zero are not computed: those of points without contact
/// where there is no multiplier.
/// @param[in,out] positions Where the zone's blocks go in A; what is not yet
/// known is looked up. With matrices other than AIJ it is not used.
void add_tangent(const Zone& zone, PetscMatrix A, BlockPositions& positions,
                 AssemblyStatistics& statistics);

/// @brief b <- b - alpha * (tangent's constrained columns) * increment.
///
/// The counterpart of DOLFINx's apply_lifting for the contact tangent.
/// @param[in] slave Dirichlet increment g - u of the slave dofs, 0 where
/// free, (dofs, gdim)
/// @param[in] master Same for the dofs of zone.state().master
void apply_lifting(const Zone& zone, PetscVector b,
                   std::span<const double> slave,
                   std::span<const double> master, double alpha,
                   AssemblyStatistics& statistics);
} // namespace raymortar
