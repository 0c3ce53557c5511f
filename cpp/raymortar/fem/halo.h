// Master facets of other ranks that this rank's slave facets may meet.
#pragma once

#include "raymortar/geometry/aabb_tree.h"
#include "raymortar/pairing/surface.h"
#include <mpi.h>

namespace raymortar
{
/// @brief Fetched copy of the master facets near this rank's slave facets.
///
/// Ranks tell each other the box their slave facets sweep; a rank sends the
/// facets that overlap it, once, as plain data. Later only dof values travel,
/// over the same lists. Collective: every rank of the communicator calls
/// every member.
class Halo
{
public:
  /// @param[in] own Owned master facets with current positions
  /// @param[in] node_ids Global number of each owned node, (nodes,)
  /// @param[in] dof_ids Global number of each owned displacement dof, (dofs,)
  /// @param[in] wanted Box of what this rank's slave facets may reach: lower
  /// then upper, (2 gdim,); lower > upper: nothing
  Halo(MPI_Comm comm, const Surface& own,
       std::span<const std::int64_t> node_ids,
       std::span<const std::int64_t> dof_ids, std::span<const double> wanted);

  /// Facets of this rank and of the others; positions as given by their owners
  [[nodiscard]] const Surface& surface() const { return _surface; }

  /// @brief Values of owned dofs to the dofs of surface().
  /// @param[in] own (own dofs, width)
  /// @return (surface dofs, width)
  [[nodiscard]] std::vector<double> fetch(std::span<const double> own,
                                          int width) const;

  /// Bytes this rank has sent so far
  [[nodiscard]] std::int64_t bytes_sent() const { return _bytes_sent; }

private:
  MPI_Comm _comm;
  Surface _surface;
  std::vector<int> _send_counts; ///< dofs to each rank
  std::vector<int> _recv_counts; ///< dofs from each rank
  std::vector<Index> _send_dofs; ///< owned dofs, by destination
  std::vector<Index> _place;     ///< surface dof of each received value
  mutable std::int64_t _bytes_sent = 0;
};
} // namespace raymortar
