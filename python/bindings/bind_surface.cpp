#include "bind.h"
#include "raymortar/fem/zone.h"
#include "strategy.h"
#include "structs.h"

namespace raymortar::bindings
{
namespace
{
Surface make_surface(Shape shape, int degree, int node_degree, int gdim,
                     const Array<double>& X, const Array<Index>& facet_nodes,
                     const Array<Index>& facet_dofs,
                     const Array<GlobalIndex>& rows,
                     const Array<GlobalIndex>& facet_id)
{
  Surface s;
  s.shape = shape;
  s.degree = degree;
  s.node_degree = node_degree;
  s.gdim = gdim;
  s.X = s.x = s.x_old = to_vector(X);
  s.facet_nodes = to_vector(facet_nodes);
  s.facet_dofs = to_vector(facet_dofs);
  if (rows.ndim() != 2 or rows.shape(1) != gdim)
    throw Error("rows must have a row for each component of each dof, shape "
                "(dofs, " +
                std::to_string(gdim) + ")");
  s.rows = to_vector(rows);
  s.facet_id = to_vector(facet_id);
  s.neighbours = find_neighbours(s);
  return s;
}

QuadratureRule make_rule(const Array<double>& points,
                         const Array<double>& weights)
{
  QuadratureRule rule;
  rule.weights = to_vector(weights);
  for (py::ssize_t i = 0; i < points.shape(0); ++i)
    rule.points.emplace_back(points.at(i, 0),
                             points.shape(1) > 1 ? points.at(i, 1) : 0.0);
  return rule;
}

} // namespace

void bind_surface(py::module_& m)
{
  py::class_<Surface>(m, "Surface")
      .def(py::init(&make_surface), py::kw_only(), py::arg("shape"),
           py::arg("degree"), py::arg("node_degree"), py::arg("gdim"),
           py::arg("X"), py::arg("facet_nodes"), py::arg("facet_dofs"),
           py::arg("rows"), py::arg("facet_id"))
      .def("diameters",
           [](const Surface& s) { return to_array(diameters(s, s.X)); })
      .def("set_thickness", [](Surface& s, const Array<double>& thickness)
           { s.thickness = to_vector(thickness); })
      .def("set_bodies", [](Surface& s, const Array<Index>& body)
           { s.body = to_vector(body); });
  m.def(
      "find_candidates",
      [](const Surface& slave, const Surface& master,
         const FacetDistances& distances, Strategy strategy) {
        return function_of(strategy)(slave, master, distances).masters.size();
      },
      "Number of candidate pairs of two surfaces as they are.");
  py::class_<QuadratureRule>(m, "QuadratureRule")
      .def(py::init(&make_rule), py::arg("points"), py::arg("weights"));
  py::class_<SegmentRules>(m, "SegmentRules")
      .def(py::init<QuadratureRule, QuadratureRule, QuadratureRule>(),
           py::arg("simplex"), py::arg("quadrilateral") = QuadratureRule(),
           py::arg("fan") = QuadratureRule());
  bind_options<Multipliers>(
      m, "Multipliers", Field{"degree", &Multipliers::degree},
      Field{"components", &Multipliers::components},
      Field{"facet", &Multipliers::facet}, Field{"rows", &Multipliers::row})
      .def(py::init<>());
}
} // namespace raymortar::bindings
