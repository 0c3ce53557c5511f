#include "raymortar/fem/zone.h"
#include "raymortar/core/stopwatch.h"
#include "raymortar/fem/parts.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace raymortar
{
namespace
{
double largest_move(const std::vector<double>& a, const std::vector<double>& b)
{
  if (a.size() != b.size())
    return std::numeric_limits<double>::infinity();
  double m = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    m = std::max(m, std::abs(a[i] - b[i]));
  return m;
}

bool any_rank(MPI_Comm comm, bool here)
{
  int mine = here ? 1 : 0, all = 0;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, comm);
  return all == 1;
}
ZoneInput with_kind_of_master(ZoneInput input)
{
  input.master_kind = input.master.kind();
  return input;
}
} // namespace

Zone::Zone(MPI_Comm comm, ZoneInput input)
    : _comm(comm), _input(with_kind_of_master(std::move(input))),
      _interface(_input)
{
  _input.master.x = _input.master.x_old = _input.master.X;
  find_margin();
  find_extent();
  const auto zeros = [](const Surface& s)
  { return std::vector<double>(s.rows.size(), 0.0); };
  _master_u = _master_old = _master_fixed = zeros(_input.master);
  _fixed_slave = zeros(_input.slave);
}

/// Half of a margin is for the slave side to move, half for the master
void Zone::find_margin()
{
  _halo_margin = std::numeric_limits<double>::infinity();
  for (Index f = 0; f < _input.slave.num_facets(); ++f)
  {
    const SearchDistances& d = _input.distances[f];
    _halo_margin = std::min(_halo_margin, std::max({d.skin, d.depth, d.reach}));
  }
  MPI_Allreduce(MPI_IN_PLACE, &_halo_margin, 1, MPI_DOUBLE, MPI_MIN, _comm);
}

/// Twice the diagonal of the box around both surfaces: bodies may move
void Zone::find_extent()
{
  const auto d = static_cast<std::size_t>(_input.slave.gdim);
  // Of each coordinate and of its negative
  std::array<double, 6> largest;
  largest.fill(-std::numeric_limits<double>::infinity());
  for (const Surface* s : {&_input.slave, &_input.master})
    for (std::size_t k = 0; k < s->X.size(); ++k)
    {
      double* pair = &largest[k % d * 2];
      pair[0] = std::max(pair[0], s->X[k]);
      pair[1] = std::max(pair[1], -s->X[k]);
    }
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), 6, MPI_DOUBLE, MPI_MAX, _comm);
  double squares = 0.0;
  for (std::size_t i = 0; i < d; ++i)
    squares += std::pow(std::max(largest[2 * i] + largest[2 * i + 1], 0.0), 2);
  _extent = 2.0 * std::sqrt(squares);
}

void Zone::set_displacement(std::span<const double> slave,
                            std::span<const double> master)
{
  _has_node_sums = false;
  if (_interface.move_slave(slave))
    _halo_is_checked = false;
  _master_u.assign(master.begin(), master.end());
  std::vector<double> x = displaced(_input.master, master);
  if (x != _input.master.x)
    _halo_is_checked = false;
  _input.master.x = std::move(x);
  if (_halo)
    _interface.move_master(_halo->fetch(_master_u, _input.slave.gdim));
}

void Zone::set_old_displacement(std::span<const double> slave,
                                std::span<const double> master)
{
  _has_node_sums = false;
  _interface.set_old_slave(slave);
  _master_old.assign(master.begin(), master.end());
  if (_halo)
    _interface.set_old_master(_halo->fetch(_master_old, _input.slave.gdim));
  begin_step();
}

void Zone::set_fixed(std::span<const double> slave,
                     std::span<const double> master)
{
  _has_node_sums = false;
  _fixed_slave.assign(slave.begin(), slave.end());
  _master_fixed.assign(master.begin(), master.end());
  if (_halo)
    _fixed_master = _halo->fetch(_master_fixed, _input.slave.gdim);
  begin_step();
}

void Zone::begin_step()
{
  const auto near =
      [this](const Surface& slave, const FacetDistances& distances)
  {
    return _input.slave.gdim == 2 ? masters_near<2>(slave, distances)
                                  : masters_near<3>(slave, distances);
  };
  _interface.begin_step(_fixed_slave, near, _extent);
}

/// Masters near the slave at the start of the step, by a temporary halo: the
/// kept halo is for the present positions
template <int D>
Masters Zone::masters_near(const Surface& slave,
                           const FacetDistances& distances)
{
  if (not any_rank(_comm, slave.num_facets() > 0))
    return {};
  Surface own = _input.master;
  own.x = own.x_old = displaced(own, _master_old);
  const auto rays = ray_boxes<D>(slave, distances);
  KeptBoxes wanted;
  wanted.keep<D>(part_boxes<D>(rays, parts_of<D>(rays)),
                 [](std::size_t) { return 0.0; });
  const Halo halo(_comm, own, _input.master_node_ids, _input.master_dof_ids,
                  wanted.corners());
  Masters masters{halo.surface(), halo.fetch(_master_fixed, D)};
  _past.pairing += halo.facet_traffic();
  _past.values += halo.value_traffic();
  return masters;
}

void Zone::set_rows(std::span<const GlobalIndex> slave,
                    std::span<const GlobalIndex> master,
                    std::span<const GlobalIndex> multiplier)
{
  _input.slave.rows.assign(slave.begin(), slave.end());
  _input.master.rows.assign(master.begin(), master.end());
  _input.multipliers.row.assign(multiplier.begin(), multiplier.end());
  _interface.set_rows(slave, multiplier);
  if (not _halo)
    return;
  // Doubles hold all numbers of rows exactly
  const std::vector<double> own(master.begin(), master.end());
  const auto fetched = _halo->fetch(own, _input.slave.gdim);
  std::vector<GlobalIndex> rows(fetched.size());
  std::transform(fetched.begin(), fetched.end(), rows.begin(),
                 [](double row) { return static_cast<GlobalIndex>(row); });
  _interface.set_master_rows(std::move(rows));
}

void Zone::set_modulus(double modulus)
{
  _has_node_sums = false;
  _interface.damping().set_modulus(modulus);
}

void Zone::set_shear_modulus(double modulus)
{
  _has_node_sums = false;
  _interface.cover().set_shear_modulus(modulus);
}

void Zone::set_covered_nodes(std::span<const std::int8_t> covered)
{
  _interface.cover().set_nodes({covered.begin(), covered.end()});
}

void Zone::set_corner_nodes(std::span<const std::int8_t> corners)
{
  _interface.cover().set_corners({corners.begin(), corners.end()});
}

void Zone::set_crossing(std::span<const std::int8_t> dofs)
{
  _has_node_sums = false;
  _interface.set_crossing(dofs);
  begin_step();
}

void Zone::set_multiplier(std::span<const double> values)
{
  _has_node_sums = false;
  _interface.set_multiplier(values);
}

void Zone::set_gamma(std::span<const double> gamma, double scale,
                     PairFactors factors)
{
  _has_node_sums = false;
  _interface.set_gamma(gamma, scale, std::move(factors));
}

void Zone::set_offset(std::span<const double> offset)
{
  _has_node_sums = false;
  if (_interface.set_offset(offset))
    _halo_is_checked = false;
}

void Zone::set_field(std::string_view name, std::span<const double> values)
{
  _has_node_sums = false;
  _interface.set_field(name, values);
}

void Zone::set_friction_bounds(std::vector<PointBound> bounds)
{
  _interface.set_friction_bounds(std::move(bounds));
}

void Zone::set_node_bounds(std::vector<PointBound> bounds)
{
  _interface.set_node_bounds(std::move(bounds));
}

void Zone::set_node_changes(NodeChanges changes)
{
  _interface.set_node_changes(std::move(changes));
}

void Zone::set_point_changes(std::vector<double> changes)
{
  _interface.set_point_changes(std::move(changes));
}

void Zone::set_node_sums(std::span<const double> sums)
{
  _interface.set_node_sums(sums);
  _has_node_sums = true;
}

Springs Zone::accepted_springs() const { return _interface.accepted_springs(); }

template <int D>
void Zone::update_halo()
{
  const Stopwatch watch(_seconds_halo);
  const double half = 0.5 * _halo_margin;
  const auto rays = ray_boxes<D>(state().slave, distances());
  const bool holds = _halo and
                     _wanted.hold<D>(part_boxes<D>(rays, _part), half) and
                     largest_move(_input.master.x, _master_at) <= half;
  if (not any_rank(_comm, not holds))
    return;
  _part = parts_of<D>(rays);
  _wanted.keep<D>(part_boxes<D>(rays, _part),
                  [this](std::size_t) { return _halo_margin; });
  _master_at = _input.master.x;
  _past = traffic();
  _halo.emplace(_comm, _input.master, _input.master_node_ids,
                _input.master_dof_ids, _wanted.corners());
  ++_halo_builds;
  renew_master();
}

void Zone::renew_master()
{
  Surface master = _halo->surface();
  const int d = _input.slave.gdim;
  master.x = displaced(master, _halo->fetch(_master_u, d));
  master.x_old = displaced(master, _halo->fetch(_master_old, d));
  _fixed_master = _halo->fetch(_master_fixed, d);
  _interface.set_master(std::move(master));
}

void Zone::pair()
{
  _has_node_sums = false;
  if (_interface.has_tied())
    return;
  if (_input.tools.empty() and any_rank(_comm, not _halo_is_checked))
    _input.slave.gdim == 2 ? update_halo<2>() : update_halo<3>();
  _halo_is_checked = true;
  _interface.pair();
}

void Zone::cast()
{
  _has_node_sums = false;
  _interface.cast();
}

ZoneTraffic Zone::traffic() const
{
  ZoneTraffic sum = _past;
  if (_halo)
  {
    sum.pairing += _halo->facet_traffic();
    sum.values += _halo->value_traffic();
  }
  return sum;
}

ZoneStatistics Zone::statistics() const
{
  const ContactState& now = state();
  ZoneStatistics s{_interface.pipeline().statistics()};
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  s.slave_facets = _input.slave.num_facets();
  s.master_facets = now.master.num_facets();
  s.candidates = count(candidates().masters.size());
  s.clipped = now.segmentation.clipped;
  s.segments = count(now.segmentation.segments.size());
  s.degenerate = count(now.segmentation.degenerate.size());
  s.points = count(now.points.size());
  s.hits = std::count(now.hits.status.begin(), now.hits.status.end(),
                      RayStatus::hit);
  s.pairs =
      std::count_if(now.elements.master.begin(), now.elements.master.end(),
                    [](Index m) { return m != no_index; });
  const ZoneTraffic sent = traffic();
  s.bytes_sent = sent.pairing.bytes + sent.values.bytes;
  s.halo_builds = _halo_builds;
  s.seconds_halo = _seconds_halo;
  return s;
}
} // namespace raymortar
