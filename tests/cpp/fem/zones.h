// Two plates in contact, with rows in any order.
#pragma once

#include "petsc_session.h"
#include "raymortar/fem/zone.h"
#include "rules.h"
#include "surfaces.h"
#include <functional>

namespace raymortar::test
{
/// Rows of the displacements of both sides, then those of the multipliers
struct Rows
{
  std::vector<GlobalIndex> slave, master, multiplier;
};

/// Rows of one node side by side, or all of one component before the next
inline Rows rows_of(const Surface& slave, const Surface& master, bool by_node)
{
  const auto d = static_cast<std::size_t>(slave.gdim);
  const auto dofs =
      static_cast<std::size_t>(slave.num_dofs() + master.num_dofs());
  std::vector<GlobalIndex> all(dofs * d);
  for (std::size_t k = 0; k < all.size(); ++k)
    all[k] = static_cast<GlobalIndex>(by_node ? k : k % d * dofs + k / d);
  const auto end = all.begin() + static_cast<std::ptrdiff_t>(slave.rows.size());
  Rows rows{{all.begin(), end}, {end, all.end()}, {}};
  for (Index a = 0; a < slave.num_dofs(); ++a)
    rows.multiplier.push_back(static_cast<GlobalIndex>(all.size()) +
                              slave.gdim * a);
  return rows;
}

/// Moves the nodes of a surface
using Place = std::function<void(Surface&)>;

/// Stick of a plate on a larger one with other facets, paired
/// @param[in] place What is done to both plates before
template <class F>
std::unique_ptr<Zone> paired_plates(bool by_node, const Place& place = {})
{
  start_petsc();
  ZoneInput in;
  in.slave = make_surface({F::shape, F::degree, F::node_degree, 2, false},
                          plate(0.7, 0.01));
  in.master = make_surface({F::shape, F::degree, F::node_degree, 3, true},
                           plate(1.0, 0.0));
  for (Surface* side : {&in.slave, &in.master})
    if (place)
      place(*side);
  Rows rows = rows_of(in.slave, in.master, by_node);
  in.slave.rows = rows.slave;
  in.master.rows = rows.master;
  for (std::size_t k = 0; k < in.master.X.size() / F::gdim; ++k)
    in.master_node_ids.push_back(static_cast<std::int64_t>(k));
  for (Index k = 0; k < in.master.num_dofs(); ++k)
    in.master_dof_ids.push_back(k);
  // In 3D the multiplier has degree 1: a facet's first dofs are its corners
  const int nodes = F::tdim == 1 ? F::dofs : in.slave.corners();
  in.multipliers.degree = F::tdim == 1 ? F::degree : 1;
  in.multipliers.components = F::gdim;
  for (Index f = 0; f < in.slave.num_facets(); ++f)
    for (int a = 0; a < nodes; ++a)
      in.multipliers.facet.push_back(
          in.slave.facet_dofs[static_cast<std::size_t>(f * F::dofs + a)]);
  in.multipliers.row = rows.multiplier;
  in.multipliers.value.assign(rows.multiplier.size() * F::gdim, 0.0);
  in.distances = {0.5, 0.5, 0.1};
  in.segment_rules = segment_rules(F::shape, 2);
  in.facet_rule = rule_on(F::shape, 2);
  auto zone = std::make_unique<Zone>(MPI_COMM_SELF, std::move(in));
  zone->pair();
  return zone;
}

/// Displace the master and pair anew
inline void move_master(Zone& zone, std::span<const double> displacement)
{
  const std::vector<double> none(zone.input().slave.rows.size(), 0.0);
  zone.set_displacement(none, displacement);
  zone.pair();
}

inline PetscInt num_rows(const Zone& zone)
{
  const ZoneInput& in = zone.input();
  return static_cast<PetscInt>(in.slave.rows.size() + in.master.rows.size() +
                               in.multipliers.value.size());
}
} // namespace raymortar::test
