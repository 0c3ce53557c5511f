// Contact blocks into PETSc: residual, tangent, Dirichlet lifting, pattern.
#pragma once

#include "raymortar/fem/zone.h"
#include <petscmat.h>

namespace raymortar
{
/// @brief Add the residual of a zone to a vector over the coupled rows.
///
/// Constrained rows are left out. Entries of other ranks travel with the
/// vector's assembly, which the caller does.
void add_residual(const Zone& zone, ::Vec b);

/// @brief Add the tangent of a zone; constrained rows and columns are left
/// out. Assembly is the caller's.
void add_tangent(const Zone& zone, ::Mat A);

/// @brief b <- b - alpha * (tangent's constrained columns) * increment.
///
/// The counterpart of DOLFINx's apply_lifting for the contact tangent.
/// @param[in] slave Dirichlet increment g - u of the slave dofs, 0 where
/// free, (dofs, gdim)
/// @param[in] master Same for the dofs of zone.state().master
void apply_lifting(const Zone& zone, ::Vec b, std::span<const double> slave,
                   std::span<const double> master, double alpha);

/// @brief Pairs of facets whose coupling the matrix has room for.
class Pattern
{
public:
  /// @brief Whether the zone's present pairs all have room.
  [[nodiscard]] bool covers(const Zone& zone) const;

  /// @brief Make room for the present pairs; former ones keep theirs as long
  /// as they are candidates, so that a pair that comes and goes costs nothing.
  void extend(const Zone& zone);

  /// @brief Insert zero blocks for all pairs into a matrix, for instance a
  /// MATPREALLOCATOR.
  void insert(const Zone& zone, ::Mat A) const;

  [[nodiscard]] std::size_t size() const { return _pairs.size(); }

private:
  /// Slave facet (local) and master facet (global), sorted
  std::vector<std::pair<Index, std::int64_t>> _pairs;
};

/// @brief Preallocate A with the volume pattern and the zones' patterns.
///
/// A may have been used before: PETSc drops what was preallocated but not
/// used at the first assembly, so all entries are created, with value zero.
/// @param[in] offsets Compressed rows of the owned volume rows, (n + 1,)
/// @param[in] columns Global columns
/// @param[in] first_row First owned row of A
/// @param[in] rows Position of the volume rows: A's row of volume row i is
/// first_row + i, for i < n
void preallocate(::Mat A, std::span<const std::int32_t> offsets,
                 std::span<const std::int32_t> columns,
                 std::span<const Zone* const> zones,
                 std::span<const Pattern> patterns);
} // namespace raymortar
