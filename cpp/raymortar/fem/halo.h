// Master facets of other ranks that this rank's slave facets may meet.
#pragma once

#include "raymortar/fem/exchange.h"
#include "raymortar/pairing/surface.h"
#include <optional>

namespace raymortar
{
/// @brief Fetched copy of the master facets near this rank's slave facets.
///
/// Ranks tell each other the boxes that parts of their slave surface sweep; a
/// rank sends the facets that overlap one of them, once, as plain data. Later
/// only dof values travel, over the same lists. Collective: every rank of the
/// communicator calls every member.
class Halo
{
public:
  /// @param[in] own Owned master facets with current positions
  /// @param[in] node_ids Global number of each owned node, (nodes,)
  /// @param[in] dof_ids Global number of each owned displacement dof, (dofs,)
  /// @param[in] wanted Boxes of what this rank's slave facets may reach: lower
  /// then upper, (parts, 2 gdim); lower > upper: nothing
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

  /// @brief Values of owned facets to the facets of surface().
  /// @param[in] own (own facets, width)
  /// @return (surface facets, width)
  [[nodiscard]] std::vector<double> fetch_facets(std::span<const double> own,
                                                 int width) const;
  [[nodiscard]] std::vector<std::int64_t>
  fetch_facets(std::span<const std::int64_t> own, int width) const;

  /// Traffic of this rank to find its partners and to send them facets
  [[nodiscard]] const Traffic& facet_traffic() const { return _facet_traffic; }

  /// Traffic of this rank in all other calls so far
  [[nodiscard]] Traffic value_traffic() const;

private:
  Surface _surface;
  std::optional<Exchange> _exchange;
  Traffic _facet_traffic;
  std::vector<Index> _send_facets; ///< owned facets, by destination
  std::vector<Index> _send_dofs;   ///< owned dofs, by destination
  std::vector<Index> _place;       ///< surface dof of each received value
};
} // namespace raymortar
