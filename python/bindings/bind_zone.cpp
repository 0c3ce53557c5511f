#include "bind.h"
#include "raymortar/fem/free_points.h"
#include "raymortar/fem/nearest_hits.h"
#include "raymortar/fem/remote_entries.h"
#include "raymortar/mortar/sunk_points.h"

namespace raymortar::bindings
{
namespace
{
FacetDistances make_distances(const Array<double>& reach,
                              const Array<double>& depth,
                              const Array<double>& skin, bool depth_is_default)
{
  std::vector<SearchDistances> each;
  for (py::ssize_t f = 0; f < reach.size(); ++f)
    each.push_back({reach.at(f), depth.at(f), skin.at(f)});
  return {std::move(each), depth_is_default};
}

std::unique_ptr<Zone>
make_zone(int comm, Surface slave, Surface master,
          const Array<std::int64_t>& master_node_ids,
          const Array<std::int64_t>& master_dof_ids, Multipliers multipliers,
          LawKind law, FrictionLaw friction, bool current_measure,
          bool moving_segments, const FacetDistances& distances,
          Strategy strategy, bool subdivide, SegmentRules segment_rules,
          QuadratureRule facet_rule)
{
  return std::make_unique<Zone>(
      MPI_Comm_f2c(comm),
      ZoneInput{std::move(slave), std::move(master), to_vector(master_node_ids),
                to_vector(master_dof_ids), std::move(multipliers), law,
                friction, current_measure, moving_segments, distances, strategy,
                subdivide, std::move(segment_rules), std::move(facet_rule)});
}

py::dict statistics(Zone& z)
{
  const AssemblyStatistics& a = z.assembly();
  const ZoneStatistics s = z.statistics();
  py::dict d;
  d["slave_facets"] = s.slave_facets;
  d["master_facets"] = s.master_facets;
  d["candidates"] = s.candidates;
  d["clipped"] = s.clipped;
  d["pairs"] = s.pairs;
  d["segments"] = s.segments;
  d["points"] = s.points;
  d["hits"] = s.hits;
  d["degenerate"] = s.degenerate;
  d["candidate_builds"] = s.candidate_builds;
  d["pairings"] = s.pairings;
  d["pairings_skipped"] = s.pairings_skipped;
  d["residual_blocks"] = a.residual_blocks;
  d["tangent_blocks"] = a.tangent_blocks;
  d["lifted_blocks"] = a.lifted_blocks;
  d["skipped_blocks"] = a.skipped_blocks;
  d["lookups"] = a.lookups;
  d["halo_builds"] = s.halo_builds;
  d["bytes_sent"] = s.bytes_sent;
  d["seconds_halo"] = s.seconds_halo;
  d["seconds_candidates"] = s.seconds_candidates;
  d["seconds_segments"] = s.seconds_segments;
  d["seconds_rays"] = s.seconds_rays;
  d["seconds_residual"] = a.seconds_residual;
  d["seconds_tangent"] = a.seconds_tangent;
  return d;
}

/// What this rank has sent, and the entries it would send at an assembly
py::dict traffic(const Zone& z, const Array<std::int64_t>& ranges, int rank)
{
  const ZoneTraffic t = z.traffic();
  const RemoteEntries r = remote_entries(z, to_span(ranges), rank);
  py::dict d;
  d["pairing_messages"] = t.pairing.messages;
  d["pairing_bytes"] = t.pairing.bytes;
  d["value_messages"] = t.values.messages;
  d["value_bytes"] = t.values.bytes;
  d["matrix_entries"] = r.matrix;
  d["vector_entries"] = r.vector;
  d["entry_ranks"] = r.ranks;
  return d;
}

/// Global numbers of the slave and master facets that have met, (pairs, 2)
py::array_t<std::int64_t> pairs(const Zone& z)
{
  const ContactState& s = z.state();
  std::vector<std::int64_t> ids;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (const Index m = s.elements.master[e]; m != no_index)
    {
      const Index f = s.elements.slave[e];
      ids.push_back(s.slave.facet_id[static_cast<std::size_t>(f)]);
      ids.push_back(s.master.facet_id[static_cast<std::size_t>(m)]);
    }
  return to_array(ids, {static_cast<py::ssize_t>(ids.size() / 2), 2});
}

/// Points, hits and the law's results, as arrays over the points
py::dict points(const Zone& z)
{
  const ContactState& s = z.state();
  const PointResults r = z.assembler().results(s);
  const int d = s.slave.gdim;
  const auto n = static_cast<py::ssize_t>(s.points.size());
  const std::vector<py::ssize_t> vector = {n, d};
  py::dict out;
  out["xi"] = points_to_array(s.points.xi, d - 1);
  out["seed"] = to_array(s.points.seed);
  out["slave"] = to_array(s.points.slave);
  out["master"] = to_array(s.hits.master);
  out["eta"] = points_to_array(s.hits.eta, d - 1);
  out["gap"] = to_array(r.gap);
  out["distance"] = to_array(s.hits.gap);
  out["ray"] = enums_to_array(s.hits.status);
  out["area"] = to_array(s.points.area);
  out["weight"] = to_array(r.weight);
  out["status"] = enums_to_array(r.status);
  out["pressure"] = to_array(r.pressure);
  out["traction"] = to_array(r.traction, vector);
  out["x"] = to_array(r.x, vector);
  out["normal"] = to_array(r.normal, vector);
  const LawKind law = z.input().law;
  if (law == LawKind::augmented_friction or law == LawKind::penalty_friction)
    out["slip"] = to_array(r.slip, vector);
  return out;
}

/// What slave facets face
py::dict faced(const Zone& z)
{
  const NearestHits n = nearest_hits(z.state(), z.assembler());
  const int width = z.state().slave.gdim - 1;
  py::dict out;
  out["facet"] = to_array(n.facet);
  out["xi"] = points_to_array(n.xi, width);
  out["eta"] = points_to_array(n.eta, width);
  out["master"] = to_array(n.master);
  out["gap"] = to_array(n.gap);
  out["closed"] = to_array(n.closed);
  return out;
}

/// Bodies of the master facets that are here now, by local number
py::array_t<Index> master_bodies(const Zone& z)
{
  return to_array(z.state().master.body);
}

/// Points within the master that are too deep for contact, by number
py::array_t<Index> sunk_points(const Zone& z)
{
  const ContactState& s = z.state();
  return to_array(
      find_sunk_points(s.slave, s.master, s.points, s.hits, z.distances()));
}

/// Segments as polygons in the reference coordinates of their slave facet
py::dict segments(const Zone& z)
{
  const Segmentation& s = z.segmentation();
  std::vector<Index> slave, master, offsets = {0};
  std::vector<Break::Motion> motion;
  for (const Break& one : s.breaks)
    motion.push_back(one.motion);
  for (const Segment& one : s.segments)
  {
    slave.push_back(one.slave);
    master.push_back(one.master);
    offsets.push_back(one.begin + one.size);
  }
  py::dict out;
  out["slave"] = to_array(slave);
  out["master"] = to_array(master);
  out["offsets"] = to_array(offsets);
  out["xi"] = points_to_array(s.vertices, z.state().slave.gdim - 1);
  out["motion"] = enums_to_array(motion);
  out["covered"] = to_array(s.covered);
  out["whole_area"] = to_array(z.state().points.whole);
  out["covered_area"] = to_array(z.state().points.covered);
  return out;
}

/// Slave facets whose multiplier is smoothed next to held nodes
py::array_t<Index> held_facets(Zone& z)
{
  std::vector<Index> slave;
  for (const FacetBlock& held : z.held_facets())
    slave.push_back(held.slave);
  return to_array(slave);
}

/// A friction law at the points, (points,) each
void set_friction_bounds(Zone& z, const Array<double>& s,
                         const Array<double>& s_p, const Array<double>& s_slip)
{
  std::vector<PointBound> bounds;
  for (py::ssize_t q = 0; q < s.size(); ++q)
    bounds.push_back({s.at(q), s_p.at(q), s_slip.at(q)});
  z.set_friction_bounds(std::move(bounds));
}

template <void (Zone::*set)(std::span<const double>, std::span<const double>)>
void set_both(Zone& z, const Array<double>& slave, const Array<double>& master)
{
  (z.*set)(to_span(slave), to_span(master));
}
} // namespace

void bind_zone(py::module_& m)
{
  py::enum_<LawKind>(m, "LawKind")
      .value("augmented_normal", LawKind::augmented_normal)
      .value("augmented_vector", LawKind::augmented_vector)
      .value("penalty", LawKind::penalty)
      .value("augmented_friction", LawKind::augmented_friction)
      .value("penalty_friction", LawKind::penalty_friction);
  py::class_<Coulomb>(m, "Coulomb").def(py::init<double>(), py::arg("mu"));
  py::class_<Tresca>(m, "Tresca").def(py::init<double>(), py::arg("bound"));
  py::class_<Stick>(m, "Stick").def(py::init<>());
  py::class_<PointBound>(m, "PointBound").def(py::init<>());
  py::enum_<Strategy>(m, "Strategy")
      .value("brute_force", Strategy::brute_force)
      .value("bvh", Strategy::bvh)
      .value("advancing_front", Strategy::advancing_front)
      .value("pang", Strategy::pang);
  py::class_<FacetDistances>(m, "SearchDistances")
      .def(py::init<double, double, double>(), py::arg("reach"),
           py::arg("depth"), py::arg("skin"))
      .def(py::init(&make_distances), py::kw_only(), py::arg("reach"),
           py::arg("depth"), py::arg("skin"), py::arg("depth_is_default"));
  py::class_<Zone>(m, "Zone")
      .def(py::init(&make_zone), py::kw_only(), py::arg("comm"),
           py::arg("slave"), py::arg("master"), py::arg("master_node_ids"),
           py::arg("master_dof_ids"), py::arg("multipliers"), py::arg("law"),
           py::arg("friction"), py::arg("current_measure"),
           py::arg("moving_segments"), py::arg("distances"),
           py::arg("strategy"), py::arg("subdivide"), py::arg("segment_rules"),
           py::arg("facet_rule"))
      .def("set_displacement", &set_both<&Zone::set_displacement>)
      .def("set_old_displacement", &set_both<&Zone::set_old_displacement>)
      .def("set_fixed", &set_both<&Zone::set_fixed>)
      .def("set_rows",
           [](Zone& z, const Array<GlobalIndex>& slave,
              const Array<GlobalIndex>& master,
              const Array<GlobalIndex>& multiplier) {
             z.set_rows(to_span(slave), to_span(master), to_span(multiplier));
           })
      .def("set_modulus", &Zone::set_modulus)
      .def("set_shear_modulus", &Zone::set_shear_modulus)
      .def("covered_nodes",
           [](const Zone& z) { return to_array(covered_nodes(z.state())); })
      .def("set_covered_nodes", [](Zone& z, const Array<std::int8_t>& covered)
           { z.set_covered_nodes(to_span(covered)); })
      .def("set_corner_nodes", [](Zone& z, const Array<std::int8_t>& corners)
           { z.set_corner_nodes(to_span(corners)); })
      .def("set_multiplier", [](Zone& z, const Array<double>& values)
           { z.set_multiplier(to_span(values)); })
      .def(
          "set_gamma",
          [](Zone& z, const Array<double>& gamma, double scale,
             const Array<Index>& slaves, const Array<Index>& masters,
             const Array<double>& factors)
          {
            z.set_gamma(
                to_span(gamma), scale,
                {to_vector(slaves), to_vector(masters), to_vector(factors)});
          },
          py::arg("gamma"), py::arg("scale"),
          py::arg("slaves") = Array<Index>(),
          py::arg("masters") = Array<Index>(),
          py::arg("factors") = Array<double>())
      .def("set_offset", [](Zone& z, const Array<double>& offset)
           { z.set_offset(to_span(offset)); })
      .def("set_friction_coefficient",
           [](Zone& z, const Array<double>& coefficient)
           { z.set_friction_coefficient(to_span(coefficient)); })
      .def("set_friction_bounds", &set_friction_bounds, py::arg("s"),
           py::arg("s_p"), py::arg("s_slip"))
      .def("set_old_traction", [](Zone& z, const Array<double>& traction)
           { z.set_old_traction(to_span(traction)); })
      .def("accepted_springs",
           [](const Zone& z)
           {
             const auto field = z.accepted_springs();
             const Surface& s = z.state().slave;
             return to_array(field, {s.num_facets(), s.dofs_per_facet(),
                                     static_cast<py::ssize_t>(s.gdim)});
           })
      .def("pair", &Zone::pair)
      .def("cast", &Zone::cast)
      .def("points", &points)
      .def("faced", &faced)
      .def("master_bodies", &master_bodies)
      .def("sunk_points", &sunk_points)
      .def("segments", &segments)
      .def("pairs", &pairs)
      .def("free_points",
           [](const Zone& z) { return to_array(free_points(z)); })
      .def("held_facets", &held_facets)
      .def("traffic", &traffic, py::arg("ranges"), py::arg("rank"))
      .def("statistics", &statistics);
}
} // namespace raymortar::bindings
