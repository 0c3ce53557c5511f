// Systems whose rows are spread over the ranks. Tests named ...OnRanks hold on
// any number of ranks, each of which runs them: scripts/test starts several.
#pragma once

#include "zones.h"

namespace raymortar::test
{
inline int rank_of(MPI_Comm comm)
{
  start_petsc();
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

inline int size_of(MPI_Comm comm)
{
  start_petsc();
  int size = 1;
  MPI_Comm_size(comm, &size);
  return size;
}

/// @brief Rows of the zone of one rank where every rank has such a zone, and as
/// many rows as it has: its slave and multiplier are its own, its master is the
/// next rank's.
inline Rows spread_rows(const Zone& zone, int rank, int size, bool by_node)
{
  const GlobalIndex n = num_rows(zone);
  Rows rows = rows_of(zone.input().slave, zone.input().master, by_node);
  for (auto* own : {&rows.slave, &rows.multiplier})
    for (GlobalIndex& row : *own)
      row += n * rank;
  for (GlobalIndex& row : rows.master)
    row += n * ((rank + 1) % size);
  return rows;
}

/// Renumber the zone of a rank like that
inline void spread(Zone& zone, int rank, int size, bool by_node)
{
  const Rows rows = spread_rows(zone, rank, size, by_node);
  zone.set_rows(rows.slave, rows.master, rows.multiplier);
}
} // namespace raymortar::test
