#include "raymortar/system/contact_system.h"
#include "raymortar/system/together.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace raymortar
{
namespace
{
/// Values (n, width) of some dofs
std::vector<double> gathered(std::span<const double> values,
                             const std::vector<Index>& dofs, std::size_t width)
{
  std::vector<double> found(dofs.size() * width);
  double* out = found.data();
  for (const Index dof : dofs)
    out = std::copy_n(values.data() + static_cast<std::size_t>(dof) * width,
                      width, out);
  return found;
}

/// Add rows of a table, (items, width), to those of their numbers in another
void add_rows(std::span<const double> rows, const std::vector<Index>& numbers,
              std::size_t width, std::span<double> table)
{
  for (std::size_t k = 0; k < numbers.size(); ++k)
    for (std::size_t i = 0; i < width; ++i)
      table[static_cast<std::size_t>(numbers[k]) * width + i] +=
          rows[k * width + i];
}

std::size_t dimension(const SystemZone& zone)
{
  return static_cast<std::size_t>(zone.zone->input().slave.gdim);
}

bool all_finite(std::span<const double> values)
{
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value); });
}

/// Calls one for each zone. Other ranks wait for a rank that fails in the next
/// zone, so that all stop here.
template <class Call>
void for_each_zone(MPI_Comm comm, const std::vector<SystemZone>& zones,
                   Call&& call)
{
  for (const SystemZone& zone : zones)
    together(comm, [&] { call(zone); });
}

/// Largest absolute value of each field
void add_largest(std::span<const double> values,
                 const std::vector<std::vector<Index>>& fields,
                 std::vector<double>& largest)
{
  const auto larger = [](double most, double value)
  { return std::abs(value) <= most ? most : std::abs(value); };
  if (fields.empty())
    largest.push_back(
        std::accumulate(values.begin(), values.end(), 0.0, larger));
  for (const std::vector<Index>& field : fields)
  {
    double most = 0.0;
    for (const Index k : field)
      most = larger(most, values[static_cast<std::size_t>(k)]);
    largest.push_back(most);
  }
}
} // namespace

ContactSystem::ContactSystem(std::vector<SystemZone> zones,
                             std::span<const double> u, CoupledValues& values)
    : _comm(values.comm()), _zones(std::move(zones)), _u(u), _values(values)
{
}

bool ContactSystem::set_unknowns(PetscVector x, std::span<const double> scales,
                                 bool anew)
{
  {
    const ReadArray array(x);
    const auto now = array.values();
    const bool same =
        not anew and std::ranges::equal(now, _last) and _values.match(now);
    if (everywhere(_comm, same))
      return false;
    _last.assign(now.begin(), now.end());
  }
  _values.from_vector(x, scales);
  return true;
}

bool ContactSystem::is_finite() const
{
  const auto& multipliers = _values.multipliers();
  return everywhere(_comm,
                    all_finite(_u) and
                        std::all_of(multipliers.begin(), multipliers.end(),
                                    [](const MultiplierValues& one)
                                    { return all_finite(one.local); }));
}

bool ContactSystem::has_moved() const
{
  return not everywhere(_comm, present() == _paired_at);
}

std::vector<double> ContactSystem::present() const
{
  std::vector<double> values(_u.begin(), _u.end());
  for (const MultiplierValues& one : _values.multipliers())
    values.insert(values.end(), one.local.begin(), one.local.end());
  return values;
}

bool ContactSystem::is_at(std::span<const double> u) const
{
  return everywhere(_comm, std::ranges::equal(u, _u));
}

bool ContactSystem::loads_changed()
{
  std::vector<double> loads;
  for (const SystemZone& zone : _zones)
    for (const MovedBody* const body : zone.bodies)
    {
      const auto found = body->loads();
      loads.insert(loads.end(), found.begin(), found.end());
    }
  if (loads.empty() or everywhere(_comm, loads == _loads))
    return false;
  _loads = std::move(loads);
  return true;
}

void ContactSystem::pair(bool rays_only)
{
  _paired_at = present();
  for_each_zone(_comm, _zones,
                [&](const SystemZone& zone)
                {
                  send(zone);
                  if (not zone.zone->interface().has_tied())
                    rays_only ? zone.zone->cast() : zone.zone->pair();
                });
  refresh_nodes();
}

/// Sum what facets give to nodes, where that has changed. Zones and ranks
/// that share a node have one law there
void ContactSystem::refresh_nodes() const
{
  std::vector<int> lacks(_values.multipliers().size(), 0);
  bool any_nodes = false;
  for (const SystemZone& zone : _zones)
  {
    any_nodes = any_nodes or zone.zone->state().has_law_at_nodes();
    if (zone.zone->lacks_node_sums())
      lacks[zone.contact] = 1;
  }
  if (not any_nodes)
    return;
  MPI_Allreduce(MPI_IN_PLACE, lacks.data(), static_cast<int>(lacks.size()),
                MPI_INT, MPI_MAX, _comm);
  for (std::size_t k = 0; k < lacks.size(); ++k)
    if (lacks[k] > 0)
      sum_nodes(k);
}

void ContactSystem::sum_nodes(std::size_t contact) const
{
  const MultiplierValues& one = _values.multipliers()[contact];
  _exchanges.resize(_values.multipliers().size());
  if (_exchanges[contact] == nullptr)
    _exchanges[contact] = std::make_unique<NodeExchange>(
        _comm, one.rows, one.owned, one.components);
  _sums.resize(_values.multipliers().size());
  std::vector<double>& sums = _sums[contact];
  std::size_t width = 0;
  for (const SystemZone& zone : _zones)
    if (zone.contact == contact)
      width = std::max(width, zone.zone->interface().sums_per_node());
  sums.assign(one.rows.size() * width, 0.0);
  for (const SystemZone& zone : _zones)
  {
    if (zone.contact != contact)
      continue;
    together(_comm,
             [&]
             {
               const auto own = zone.zone->interface().own_node_sums();
               add_rows(own, zone.nodes, width, sums);
             });
  }
  _exchanges[contact]->sum(sums, static_cast<int>(width));
  for (const SystemZone& zone : _zones)
    if (zone.contact == contact)
      zone.zone->set_node_sums(gathered(sums, zone.nodes, width));
}

std::span<const double> ContactSystem::node_sums(std::size_t contact) const
{
  refresh_nodes();
  if (contact >= _sums.size())
    return {};
  return _sums[contact];
}

void ContactSystem::send(const SystemZone& zone) const
{
  const std::size_t d = dimension(zone);
  zone.zone->set_displacement(gathered(_u, zone.slave, d),
                              gathered(_u, zone.master, d));
  if (not zone.bodies.empty())
    send_bodies(zone);
  const MultiplierValues& one = _values.multipliers()[zone.contact];
  if (not one.local.empty())
    zone.zone->set_multiplier(gathered(
        one.local, zone.nodes, static_cast<std::size_t>(one.components)));
}

void ContactSystem::send_bodies(const SystemZone& zone) const
{
  std::vector<Pose> poses;
  std::vector<Freedom> freedoms;
  bool any_free = false;
  for (MovedBody* const body : zone.bodies)
  {
    poses.push_back(body->take_pose());
    freedoms.push_back(body->size() ? body->freedom() : Freedom());
    any_free = any_free or body->size() > 0;
    for (const BodyValues& one : _values.bodies())
      if (one.body == body)
        freedoms.back().rows = one.rows;
  }
  zone.zone->set_poses(poses);
  if (any_free)
    zone.zone->set_freedoms(std::move(freedoms));
}

void ContactSystem::add_residual(PetscVector b) const
{
  refresh_nodes();
  for_each_zone(_comm, _zones,
                [&](const SystemZone& zone)
                { raymortar::add_residual(*zone.zone, b, *zone.statistics); });
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  for (const BodyValues& one : _values.bodies())
  {
    if (rank > 0)
      return;
    std::vector<double> forces = one.body->own_forces();
    for (double& force : forces)
      force = -force;
    const std::vector<PetscInt> rows(one.rows.begin(), one.rows.end());
    check(VecSetValues(b, static_cast<PetscInt>(rows.size()), rows.data(),
                       forces.data(), ADD_VALUES),
          "VecSetValues");
  }
}

Norms ContactSystem::residual(PetscVector b, std::span<const double> volume,
                              const Lacking& lacking, bool contact) const
{
  check(VecSet(b, 0.0), "VecSet");
  PetscScalar* array = nullptr;
  check(VecGetArray(b, &array), "VecGetArray");
  // Contact leaves constrained rows out, so that the values set here stay
  for (std::size_t row = 0; row < volume.size(); ++row)
    array[row] = lacking.fixed[row] == 0 ? volume[row] : -lacking.owned[row];
  check(VecRestoreArray(b, &array), "VecRestoreArray");
  if (contact)
    add_residual(b);
  lift(b, lacking.of_u, -1.0);
  check(VecAssemblyBegin(b), "VecAssemblyBegin");
  check(VecAssemblyEnd(b), "VecAssemblyEnd");
  return norms(ReadArray(b).values(), volume, lacking);
}

void ContactSystem::lift(PetscVector b, std::span<const double> increment,
                         double alpha) const
{
  const bool none = std::all_of(increment.begin(), increment.end(),
                                [](double value) { return value == 0.0; });
  if (everywhere(_comm, none))
    return;
  refresh_nodes();
  for_each_zone(_comm, _zones,
                [&](const SystemZone& zone)
                {
                  const std::size_t d = dimension(zone);
                  const auto fetched = zone.zone->to_master(
                      gathered(increment, zone.master, d), static_cast<int>(d));
                  apply_lifting(*zone.zone, b,
                                gathered(increment, zone.slave, d), fetched,
                                alpha, *zone.statistics);
                });
}

void ContactSystem::add_tangent(PetscMatrix A) const
{
  refresh_nodes();
  for_each_zone(_comm, _zones,
                [&](const SystemZone& zone) {
                  raymortar::add_tangent(*zone.zone, A, *zone.positions,
                                         *zone.statistics);
                });
}

Norms ContactSystem::norms(std::span<const double> b,
                           std::span<const double> volume,
                           const Lacking& lacking) const
{
  const std::size_t count = _groups.count;
  std::vector<double> sums(2 * count, 0.0);
  const auto group = [this](std::size_t row)
  { return static_cast<std::size_t>(_groups.of_row[row]); };
  for (std::size_t row = 0; row < b.size(); ++row)
    if (row >= lacking.fixed.size() or lacking.fixed[row] == 0)
      sums[group(row)] += b[row] * b[row];
  std::size_t row = 0;
  const auto add_force = [&](double force)
  { sums[count + group(row++)] += force * force; };
  std::for_each(volume.begin(), volume.end(), add_force);
  const double* mass = _groups.mass.data();
  for (const MultiplierValues& one : _values.multipliers())
    for (const Index node : one.owned)
      for (int c = 0; c < one.components; ++c)
        add_force(
            *mass++ *
            one.local[static_cast<std::size_t>(node * one.components + c)]);
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  for (const BodyValues& one : _values.bodies())
    if (rank == 0)
      for (const double force : one.body->own_forces())
        add_force(force);
  std::vector<double> most;
  add_largest(lacking.increment, _groups.fields, most);
  add_largest(lacking.values, _groups.fields, most);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()),
                MPI_DOUBLE, MPI_SUM, _comm);
  MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(most.size()),
                MPI_DOUBLE, MPI_MAX, _comm);
  for (double& sum : sums)
    sum = std::sqrt(sum);
  const auto fields = static_cast<std::ptrdiff_t>(most.size() / 2);
  const auto groups = static_cast<std::ptrdiff_t>(count);
  return {{sums.begin(), sums.begin() + groups},
          {sums.begin() + groups, sums.end()},
          {most.begin(), most.begin() + fields},
          {most.begin() + fields, most.end()}};
}
} // namespace raymortar
