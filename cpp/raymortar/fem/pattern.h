// Room for contact in the coupled matrix.
#pragma once

#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"
#include <tuple>

namespace raymortar
{
/// @brief Pairs of facets whose coupling the matrix has room for.
class Pattern
{
public:
  using Pair = std::pair<Index, std::int64_t>; ///< slave local, master global
  /// A slave facet and two masters, the smaller number first: one is hit by
  /// points of a segment on the other
  using Coupling = std::tuple<Index, std::int64_t, std::int64_t>;

  /// @brief Whether the zone's present pairs all have room.
  [[nodiscard]] bool covers(const Zone& zone) const;

  /// @brief Make room for the present pairs.
  ///
  /// Former pairs keep theirs as long as they are candidates. Slave facets that
  /// have met a new master before get room for the neighbours of their present
  /// ones too, all at once: facets that slide do not ask again at every step,
  /// one after the other, and those that do not slide cost no fill.
  void extend(const Zone& zone);

  [[nodiscard]] const std::vector<Pair>& pairs() const { return _pairs; }
  [[nodiscard]] const std::vector<Coupling>& couplings() const
  {
    return _couplings;
  }

private:
  void extend_couplings(const Surface& master, std::vector<Coupling> now);

  std::vector<Pair> _pairs;         ///< sorted
  std::vector<Coupling> _couplings; ///< sorted
  std::vector<Index> _sliding; ///< slave facets that met new masters, sorted
};

/// @brief Rows of a field on the facets of a zone, which meet all unknowns of
/// the pairs of facets: those of a flux.
struct FieldRows
{
  std::size_t zone = 0;            ///< index among the zones
  std::vector<GlobalIndex> slave;  ///< (slave facets, per_slave)
  std::vector<GlobalIndex> master; ///< (facets of state().master, per_master)
  int per_slave = 0;
  int per_master = 0;
};

/// @brief Preallocate A for the volume's rows, the zones' patterns and fields,
/// and set all entries to zero.
///
/// A may have been used before: it keeps its sizes, maps, prefix and null
/// spaces, and loses what else the user has attached. All entries are created,
/// because PETSc drops at the first assembly what was preallocated but not
/// used.
/// @param[in] offsets Compressed rows of the owned volume rows, which are the
/// first of A's owned rows, (n + 1,)
/// @param[in] columns Global columns
void preallocate(PetscMatrix A, std::span<const std::int32_t> offsets,
                 std::span<const std::int32_t> columns,
                 std::span<const Zone* const> zones,
                 std::span<const Pattern* const> patterns,
                 std::span<const FieldRows> fields = {});
} // namespace raymortar
