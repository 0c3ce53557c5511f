// Entries that assembly has to send: their rows belong to other ranks.
#pragma once

#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Entries of a zone's blocks in rows of other ranks, which PETSc sends
/// to their owners when a matrix or vector is assembled.
struct RemoteEntries
{
  std::int64_t matrix = 0;
  std::int64_t vector = 0;
  std::int64_t ranks = 0; ///< owners, without this rank
};

/// @brief Calls visit(name, value) for every field.
template <class Visit>
constexpr void for_each_field(const RemoteEntries& r, Visit&& visit)
{
  visit("matrix_entries", r.matrix);
  visit("vector_entries", r.vector);
  visit("entry_ranks", r.ranks);
}

/// @brief Counts of the present pairs, as if all rows were assembled.
/// @param[in] ranges First row of each rank and the number of rows, (ranks + 1)
[[nodiscard]] RemoteEntries remote_entries(const Zone& zone,
                                           std::span<const std::int64_t> ranges,
                                           int rank);
} // namespace raymortar
