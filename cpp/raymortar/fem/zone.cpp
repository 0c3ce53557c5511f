#include "raymortar/fem/zone.h"
#include "raymortar/element/springs.h"
#include "raymortar/fem/parts.h"
#include "raymortar/fem/stopwatch.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace raymortar
{
namespace
{
/// Lower and upper corners, box after box, each made larger by `margin(box)`
template <int D, class Margin>
std::vector<double> flat(const std::vector<Box<D>>& boxes, Margin&& margin)
{
  std::vector<double> f;
  f.reserve(boxes.size() * 2 * D);
  for (std::size_t k = 0; k < boxes.size(); ++k)
  {
    const Box<D> b = boxes[k].inflated(margin(k));
    f.insert(f.end(), b.lower.data(), b.lower.data() + D);
    f.insert(f.end(), b.upper.data(), b.upper.data() + D);
  }
  return f;
}

/// Whether every box, made larger by a margin, lies in its stored one
template <int D>
bool inside(const std::vector<Box<D>>& boxes, const std::vector<double>& stored,
            double margin = 0.0)
{
  if (stored.size() != boxes.size() * 2 * D)
    return false;
  for (std::size_t k = 0; k < boxes.size(); ++k)
    for (int i = 0; i < D; ++i)
    {
      const double* box = stored.data() + k * 2 * D;
      if (not(boxes[k].lower[i] - margin >= box[i] and
              boxes[k].upper[i] + margin <= box[D + i]))
        return false;
    }
  return true;
}

double largest_move(const std::vector<double>& a, const std::vector<double>& b)
{
  if (a.size() != b.size())
    return std::numeric_limits<double>::infinity();
  double m = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    m = std::max(m, std::abs(a[i] - b[i]));
  return m;
}

/// Whether the positions were others before
bool replace(std::vector<double>& positions, std::vector<double> by)
{
  const bool differ = positions != by;
  positions = std::move(by);
  return differ;
}

bool any_rank(MPI_Comm comm, bool here)
{
  int mine = here ? 1 : 0, all = 0;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, comm);
  return all == 1;
}
} // namespace

Zone::Zone(MPI_Comm comm, ZoneInput input)
    : _comm(comm), _input(std::move(input)), _distances(_input.distances),
      _bare(_distances.bare())
{
  find_margins();
  _state.slave = _input.slave;
  _state.multipliers = _input.multipliers;
  _state.current_measure = _input.current_measure;
  _state.moving_segments = _input.moving_segments;
  _state.segment_rules = _input.segment_rules;
  _state.friction = _input.friction;
  _state.slave.neighbours = find_neighbours(_state.slave);
  for (Surface* s : {&_state.slave, &_input.master})
    s->x = s->x_old = s->X;
  _state.master.shape = _input.master.shape;
  _state.master.degree = _input.master.degree;
  _state.master.node_degree = _input.master.node_degree;
  _assembler = make_assembler(_state, _input.law);
  const auto zeros = [](const Surface& s)
  { return std::vector<double>(s.rows.size(), 0.0); };
  _master_u = _master_old = _master_fixed = zeros(_input.master);
  _fixed_slave = zeros(_input.slave);
  _cover.corners.assign(_input.multipliers.row.size(), 0);
  _state.gamma.nodal.assign(_input.slave.facet_dofs.size(), 1.0);
}

/// Half of a margin is for the slave side to move, half for the master
void Zone::find_margins()
{
  _smallest_skin = _halo_margin = std::numeric_limits<double>::infinity();
  for (Index f = 0; f < _input.slave.num_facets(); ++f)
  {
    const SearchDistances& d = _input.distances[f];
    _smallest_skin = std::min(_smallest_skin, d.skin);
    _halo_margin = std::min(_halo_margin, std::max({d.skin, d.depth, d.reach}));
  }
  MPI_Allreduce(MPI_IN_PLACE, &_halo_margin, 1, MPI_DOUBLE, MPI_MIN, _comm);
}

void Zone::set_displacement(std::span<const double> slave,
                            std::span<const double> master)
{
  bool moved = replace(_state.slave.x, displaced(_state.slave, slave));
  _master_u.assign(master.begin(), master.end());
  if (replace(_input.master.x, displaced(_input.master, master)) or moved)
    _halo_is_checked = false;
  if (_halo)
    moved = replace(_state.master.x,
                    displaced(_state.master,
                              _halo->fetch(_master_u, _input.slave.gdim))) or
            moved;
  if (moved)
    _points_are_present = _rays_are_present = false;
}

void Zone::set_old_displacement(std::span<const double> slave,
                                std::span<const double> master)
{
  _state.slave.x_old = displaced(_state.slave, slave);
  _master_old.assign(master.begin(), master.end());
  if (_halo)
    _state.master.x_old =
        displaced(_state.master, _halo->fetch(_master_old, _input.slave.gdim));
  _held = {};
  if (_state.segmentation.hang_on_past or _state.hits.hang_on_past)
    _points_are_present = _rays_are_present = false;
}

void Zone::set_fixed(std::span<const double> slave,
                     std::span<const double> master)
{
  _fixed_slave.assign(slave.begin(), slave.end());
  _master_fixed.assign(master.begin(), master.end());
  if (_halo)
    _fixed_master = _halo->fetch(_master_fixed, _input.slave.gdim);
  _held = {};
}

void Zone::set_rows(std::span<const GlobalIndex> slave,
                    std::span<const GlobalIndex> master,
                    std::span<const GlobalIndex> multiplier)
{
  _input.slave.rows.assign(slave.begin(), slave.end());
  _input.master.rows.assign(master.begin(), master.end());
  _input.multipliers.row.assign(multiplier.begin(), multiplier.end());
  _state.slave.rows = _input.slave.rows;
  _state.multipliers.row = _input.multipliers.row;
  if (not _halo)
    return;
  // Doubles hold all numbers of rows exactly
  const std::vector<double> own(master.begin(), master.end());
  const auto fetched = _halo->fetch(own, _input.slave.gdim);
  std::transform(fetched.begin(), fetched.end(), _state.master.rows.begin(),
                 [](double row) { return static_cast<GlobalIndex>(row); });
}

void Zone::set_modulus(double modulus)
{
  _modulus = modulus;
  _held = {};
}

void Zone::set_shear_modulus(double modulus) { _cover.shear_modulus = modulus; }

void Zone::set_covered_nodes(std::span<const std::int8_t> covered)
{
  _cover.nodes.assign(covered.begin(), covered.end());
}

void Zone::set_corner_nodes(std::span<const std::int8_t> corners)
{
  _cover.corners.assign(corners.begin(), corners.end());
}

void Zone::set_multiplier(std::span<const double> values)
{
  _state.multipliers.value.assign(values.begin(), values.end());
}

void Zone::set_gamma(std::span<const double> gamma, double scale,
                     PairFactors factors)
{
  _state.gamma.nodal.assign(gamma.begin(), gamma.end());
  _state.pair_factors = std::move(factors);
  _state.multipliers.scale = scale;
}

void Zone::set_offset(std::span<const double> offset)
{
  std::vector<double> nodal(offset.begin(), offset.end());
  if (nodal == _state.offset.nodal)
    return;
  _state.offset.nodal = std::move(nodal);
  const auto per_facet =
      static_cast<std::size_t>(_state.slave.dofs_per_facet());
  const auto facets = static_cast<std::size_t>(_state.slave.num_facets());
  std::vector<double> reach(facets, 0.0), depth(facets, 0.0);
  for (std::size_t k = 0; k < offset.size(); ++k)
  {
    const std::size_t f = k / per_facet;
    reach[f] = std::max(reach[f], -offset[k]);
    depth[f] = std::max(depth[f], offset[k]);
  }
  _distances = _input.distances.widened(reach, depth);
  _bare = _distances.bare();
  _halo_is_checked = _points_are_present = _rays_are_present = false;
}

void Zone::set_friction_coefficient(std::span<const double> coefficient)
{
  _state.friction_coefficient.nodal.assign(coefficient.begin(),
                                           coefficient.end());
}

void Zone::set_friction_bounds(std::vector<PointBound> bounds)
{
  _state.friction_bounds = std::move(bounds);
}

void Zone::set_old_traction(std::span<const double> traction)
{
  _state.traction_old.nodal.assign(traction.begin(), traction.end());
}

std::vector<double> Zone::accepted_springs() const
{
  return raymortar::accepted_springs(_state, _assembler->results(_state));
}

template <int D>
void Zone::update_halo()
{
  const Stopwatch watch(_statistics.seconds_halo);
  const double half = 0.5 * _halo_margin;
  const auto rays = ray_boxes<D>(_state.slave, _distances);
  const bool holds = _halo and
                     inside<D>(part_boxes<D>(rays, _part), _wanted, half) and
                     largest_move(_input.master.x, _master_at) <= half;
  if (not any_rank(_comm, not holds))
    return;
  _part = parts_of<D>(rays);
  _wanted = flat<D>(part_boxes<D>(rays, _part),
                    [this](std::size_t) { return _halo_margin; });
  _master_at = _input.master.x;
  _past = traffic();
  _halo.emplace(_comm, _input.master, _input.master_node_ids,
                _input.master_dof_ids, _wanted);
  ++_statistics.halo_builds;
  renew_master();
}

void Zone::renew_master()
{
  _state.master = _halo->surface();
  const int d = _input.slave.gdim;
  _state.master.x = displaced(_state.master, _halo->fetch(_master_u, d));
  _state.master.x_old = displaced(_state.master, _halo->fetch(_master_old, d));
  _fixed_master = _halo->fetch(_master_fixed, d);
  // Of both sides: no boxes at all are inside of none, so that the candidates
  // of facets that have left would stay if the new surface is empty
  _slave_boxes.clear();
  _master_boxes.clear();
  _points_are_present = _rays_are_present = false;
}

template <int D>
void Zone::update_candidates()
{
  const Stopwatch watch(_statistics.seconds_candidates);
  const auto slave = ray_boxes<D>(_state.slave, _bare);
  const auto master = facet_boxes<D>(_state.master);
  if (inside<D>(slave, _slave_boxes) and inside<D>(master, _master_boxes))
    return;
  _slave_boxes =
      flat<D>(slave, [this](std::size_t f)
              { return 0.5 * _distances[static_cast<Index>(f)].skin; });
  _master_boxes =
      flat<D>(master, [this](std::size_t) { return 0.5 * _smallest_skin; });
  _candidates =
      find_candidates(_state.slave, _state.master, _distances, _input.strategy);
  ++_statistics.candidate_builds;
}

void Zone::pair()
{
  const bool flat = _input.slave.gdim == 2;
  if (any_rank(_comm, not _halo_is_checked))
    flat ? update_halo<2>() : update_halo<3>();
  _halo_is_checked = true;
  _state.moving_segments = _input.moving_segments;
  if (_points_are_present and _rays_are_present)
  {
    ++_statistics.pairings_skipped;
    return;
  }
  flat ? update_candidates<2>() : update_candidates<3>();
  make_points_anew();
  renew_rays();
  ++_statistics.pairings;
}

void Zone::make_points_anew()
{
  const Stopwatch watch(_statistics.seconds_segments);
  _state.segmentation = make_segments(_state.slave, _state.master, _candidates,
                                      {_distances, _input.subdivide});
  _state.points =
      make_points(_state.slave, _state.segmentation, _input.segment_rules,
                  _input.facet_rule, _input.multipliers.components > 0);
  _cover.nodes = covered_nodes(_state);
  _state.friction_bounds.clear(); // of points that are gone
  _points_are_present = true;
  _rays_are_present = false;
}

void Zone::cast()
{
  // What moves now is the rays alone, and the tangent is that of this function
  _state.moving_segments = false;
  renew_rays();
}

void Zone::renew_rays()
{
  if (_rays_are_present)
    return;
  const Stopwatch watch(_statistics.seconds_rays);
  _state.hits =
      cast_rays(_state.slave, _state.master, _state.points, _distances);
  _state.elements = group_points(_state.points, _state.hits);
  _rays_are_present = true;
}

const std::vector<FacetBlock>& Zone::held_facets()
{
  find_held_facets(_state, _input.law, _fixed_slave, _fixed_master, _modulus,
                   _held);
  return _held.facets;
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
  ZoneStatistics s = _statistics;
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  s.slave_facets = _input.slave.num_facets();
  s.master_facets = _state.master.num_facets();
  s.candidates = count(_candidates.masters.size());
  s.clipped = _state.segmentation.clipped;
  s.segments = count(_state.segmentation.segments.size());
  s.degenerate = count(_state.segmentation.degenerate.size());
  s.points = count(_state.points.size());
  s.hits = std::count(_state.hits.status.begin(), _state.hits.status.end(),
                      RayStatus::hit);
  s.pairs = std::count_if(_state.elements.master.begin(),
                          _state.elements.master.end(),
                          [](Index m) { return m != no_index; });
  const ZoneTraffic sent = traffic();
  s.bytes_sent = sent.pairing.bytes + sent.values.bytes;
  return s;
}
} // namespace raymortar
