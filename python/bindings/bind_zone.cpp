#include "bind.h"
#include "raymortar/element/assembler.h"
#include "raymortar/fem/free_points.h"
#include "raymortar/fem/nearest_hits.h"
#include "raymortar/fem/remote_entries.h"
#include "raymortar/mortar/penetrating_points.h"
#include "raymortar/nodes/node_conditions.h"
#include "structs.h"
#include "zone_arguments.h"
#include <numeric>

namespace raymortar::bindings
{
namespace
{
/// What this rank has sent, and the entries it would send at an assembly
py::dict traffic(const Zone& z, const Array<std::int64_t>& ranges, int rank)
{
  py::dict sent = to_dict(z.traffic());
  sent.attr("update")(to_dict(remote_entries(z, to_span(ranges), rank)));
  return sent;
}

/// Global numbers of the slave and master facets that have met, (pairs, 2)
py::array_t<std::int64_t> pairs(const Zone& z)
{
  const ContactState& s = z.state();
  std::vector<std::int64_t> ids;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (const Index m = s.master_of(e); m != no_index)
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
  out["gamma"] = to_array(r.gamma);
  out["contact_normal"] = to_array(r.contact_normal, vector);
  out["master_normal"] = to_array(r.master_normal, vector);
  if (s.friction)
  {
    out["slip"] = to_array(r.slip, vector);
    out["closing"] = to_array(r.closing);
    out["dissipated"] = to_array(r.dissipated);
    if (s.has_elastic_slip())
    {
      out["elastic_slip"] = to_array(r.elastic_slip, vector);
      out["elastic_energy"] = to_array(r.elastic_energy);
    }
  }
  return out;
}

/// The law's results at its nodes, as arrays over the zone's nodes
py::dict nodes(const Zone& z)
{
  const ContactState& s = z.state();
  const NodeResults r = node_results(s);
  const std::vector<py::ssize_t> vector = {
      static_cast<py::ssize_t>(r.status.size()), s.slave.gdim};
  py::dict out;
  out["status"] = enums_to_array(r.status);
  out["gap"] = to_array(r.gap);
  out["gamma"] = to_array(r.gamma);
  out["pressure"] = to_array(r.pressure);
  out["normal"] = to_array(r.normal, vector);
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
py::array_t<Index> penetrating_points(const Zone& z, const Tool* body)
{
  const ContactState& s = z.state();
  return to_array(s.has_tools()
                      ? find_points_inside_tools(s.slave, s.tools, s.points,
                                                 s.hits, z.distances(), body)
                      : find_penetrating_points(
                            s.slave, s.master, s.points, s.hits, z.distances(),
                            z.interface().pipeline().filter()));
}

/// What the points of a segment hit, but for those near its sides
Index tool_or_master(const ContactState& s, const Segment& one)
{
  return s.has_tools() and s.master.num_facets() > 0
             ? s.master.body_of(one.master)
             : one.master;
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
    master.push_back(tool_or_master(z.state(), one));
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
py::array_t<Index> held_facets(const Zone& z)
{
  std::vector<Index> slave;
  for (const FacetBlock& held : z.held_facets())
    slave.push_back(held.slave);
  return to_array(slave);
}

/// A friction law at the points or nodes, (n,) each; its derivative along the
/// facet (n, gdim - 1)
void set_friction_bounds(Zone& z, const Array<double>& s,
                         const Array<double>& s_p, const Array<double>& s_slip,
                         const Array<double>& s_xi, bool at_nodes)
{
  const int width = z.state().slave.gdim - 1;
  std::vector<PointBound> bounds;
  for (py::ssize_t q = 0; q < s.size(); ++q)
    bounds.push_back({s.at(q),
                      s_p.at(q),
                      s_slip.at(q),
                      {s_xi.at(q, 0), width > 1 ? s_xi.at(q, 1) : 0.0}});
  at_nodes ? z.set_node_bounds(std::move(bounds))
           : z.set_friction_bounds(std::move(bounds));
}

template <void (Zone::*set)(std::span<const double>, std::span<const double>)>
void set_both(Zone& z, const Array<double>& slave, const Array<double>& master)
{
  (z.*set)(to_span(slave), to_span(master));
}

/// Points of springs as rows, facet by facet: facet, xi, area and vector
py::array_t<double> rows_of(const SpringPoints& points, py::ssize_t gdim)
{
  std::vector<double> rows;
  for (std::size_t f = 0; f + 1 < points.first.size(); ++f)
    for (std::size_t q = points.first[f]; q < points.first[f + 1]; ++q)
    {
      rows.push_back(static_cast<double>(f));
      for (py::ssize_t i = 0; i < gdim - 1; ++i)
        rows.push_back(points.xi[q][i]);
      rows.push_back(points.area[q]);
      const auto* const rest =
          points.rest.data() + static_cast<py::ssize_t>(q) * gdim;
      rows.insert(rows.end(), rest, rest + gdim);
    }
  return to_array(rows,
                  {static_cast<py::ssize_t>(points.xi.size()), 2 * gdim + 1});
}

SpringPoints spring_points(const Array<double>& rows, Index facets, int gdim)
{
  SpringPoints points;
  points.first.assign(static_cast<std::size_t>(facets) + 1, 0);
  const py::ssize_t width = 2 * gdim + 1;
  for (py::ssize_t q = 0; q < rows.size() / width; ++q)
  {
    const double* const row = rows.data() + q * width;
    ++points.first.at(static_cast<std::size_t>(row[0]) + 1);
    points.xi.emplace_back(row[1], gdim == 3 ? row[2] : 0.0);
    points.area.push_back(row[gdim]);
    points.rest.insert(points.rest.end(), row + gdim + 1, row + width);
  }
  std::partial_sum(points.first.begin(), points.first.end(),
                   points.first.begin());
  return points;
}

/// Poses of the tools: (tools, 3, 3) and (tools, 3)
template <void (Zone::*set)(std::span<const Pose>)>
void set_poses(Zone& z, const Array<double>& rotation,
               const Array<double>& shift)
{
  std::vector<Pose> poses;
  for (py::ssize_t k = 0; k < shift.size() / 3; ++k)
    poses.push_back(
        {Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
             rotation.data() + 9 * k),
         Eigen::Map<const Vec<3>>(shift.data() + 3 * k)});
  (z.*set)(poses);
}
} // namespace

void bind_zone(py::module_& m)
{
  py::class_<Zone>(m, "Zone")
      .def(py::init(
               [](int comm, const ZoneArguments& input) {
                 return std::make_unique<Zone>(MPI_Comm_f2c(comm),
                                               with_terms(input));
               }),
           py::arg("comm"), py::arg("input"))
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
      .def("set_crossing", [](Zone& z, const Array<std::int8_t>& dofs)
           { z.set_crossing(to_span(dofs)); })
      .def("set_multiplier", [](Zone& z, const Array<double>& values)
           { z.set_multiplier(to_span(values)); })
      .def(
          "set_law",
          [](Zone& z, Condition condition, bool dual) {
            z.set_terms(*contact_terms(condition, dual, z.input().multipliers));
          },
          py::arg("condition"), py::arg("dual"))
      .def("set_unfelt",
           [](Zone& z, const Array<double>& parts,
              const Array<double>& accepted, const Array<std::int8_t>& kept)
           { z.set_unfelt(to_span(parts), to_span(accepted), to_span(kept)); })
      .def(
          "set_gamma",
          [](Zone& z, const Array<double>& gamma, double scale,
             const PairFactors& factors)
          { z.set_gamma(to_span(gamma), scale, factors); },
          py::arg("gamma"), py::arg("scale"),
          py::arg("factors") = PairFactors())
      .def("set_offset", [](Zone& z, const Array<double>& offset)
           { z.set_offset(to_span(offset)); })
      .def("set_field",
           [](Zone& z, const std::string& name, const Array<double>& values)
           { z.set_field(name, to_span(values)); })
      .def("set_friction_bounds", &set_friction_bounds, py::arg("s"),
           py::arg("s_p"), py::arg("s_slip"), py::arg("s_xi"),
           py::arg("at_nodes"))
      .def(
          "set_node_changes",
          [](Zone& z, const Array<double>& values, bool measures) {
            z.set_node_changes({to_vector(values), measures});
          },
          py::arg("values"), py::arg("measures") = false)
      .def("set_point_changes", [](Zone& z, const Array<double>& values)
           { z.set_point_changes(to_vector(values)); })
      .def("slips_without_friction",
           [](const Zone& z)
           {
             const ContactState& s = z.state();
             return to_array(slips_without_friction(s),
                             {static_cast<py::ssize_t>(s.points.size()),
                              static_cast<py::ssize_t>(s.slave.gdim)});
           })
      .def("accepted_springs",
           [](const Zone& z)
           {
             const auto springs = z.accepted_springs();
             const Surface& s = z.state().slave;
             const auto d = static_cast<py::ssize_t>(s.gdim);
             return py::make_tuple(
                 to_array(springs.nodal,
                          {s.num_facets(), s.dofs_per_facet(), d}),
                 rows_of(springs.points, d));
           })
      .def("set_couples_over_gaps", &Zone::set_couples_over_gaps,
           py::arg("set"))
      .def("set_spring_points",
           [](Zone& z, const Array<double>& rows)
           {
             const Surface& s = z.state().slave;
             z.set_spring_points(spring_points(rows, s.num_facets(), s.gdim));
           })
      .def("set_poses", &set_poses<&Zone::set_poses>, py::arg("rotation"),
           py::arg("shift"))
      .def("set_old_poses", &set_poses<&Zone::set_old_poses>,
           py::arg("rotation"), py::arg("shift"))
      .def("set_freedoms", &Zone::set_freedoms, py::arg("freedoms"))
      .def("slave_positions",
           [](const Zone& z)
           {
             const Surface& s = z.state().slave;
             return to_array(s.x,
                             {static_cast<py::ssize_t>(s.x.size()) / s.gdim,
                              static_cast<py::ssize_t>(s.gdim)});
           })
      .def("pair", &Zone::pair)
      .def("cast", &Zone::cast)
      .def("points", &points)
      .def("nodes", &nodes)
      .def("faced", &faced)
      .def("master_bodies", &master_bodies)
      .def("penetrating_points", &penetrating_points,
           py::arg("body") = py::none())
      .def("segments", &segments)
      .def("pairs", &pairs)
      .def("free_points",
           [](const Zone& z) { return to_array(free_points(z)); })
      .def("held_facets", &held_facets)
      .def("unfelt", [](const Zone& z) { return to_array(z.unfelt()); })
      .def("traffic", &traffic, py::arg("ranges"), py::arg("rank"))
      .def("statistics", [](const Zone& z) { return to_dict(z.statistics()); });
}
} // namespace raymortar::bindings
