#include "bind.h"
#include "raymortar/geometry/clip.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/reference.h"

namespace raymortar::bindings
{
namespace
{
std::vector<raymortar::Vec<2>> corners(const Array<double>& a)
{
  if (a.ndim() != 2 or a.shape(1) != 2)
    throw py::value_error("a polygon has shape (corners, 2)");
  std::vector<raymortar::Vec<2>> v;
  for (py::ssize_t i = 0; i < a.shape(0); ++i)
    v.emplace_back(a.at(i, 0), a.at(i, 1));
  return v;
}

py::array_t<double> clip(const Array<double>& slave,
                         const Array<double>& master)
{
  const auto s = corners(slave), m = corners(master);
  const ClipPolygon p = clip_convex(s, m);
  return points_to_array(
      std::vector(p.points.begin(), p.points.begin() + p.size), 2);
}

/// Values, (points, nodes), and gradients, (tdim, points, nodes)
py::tuple shape_functions(Shape shape, int degree, const Array<double>& points)
{
  struct Facet
  {
    Shape shape;
    int degree, node_degree;
  };
  return with_facet_type(
      Facet{shape, degree, degree},
      [&]<class F>(F)
      {
        const py::ssize_t n = points.ndim() == 2 ? points.shape(0) : -1;
        if (n < 0 or points.shape(1) != F::tdim)
          throw py::value_error("points have shape (points, tdim)");
        py::array_t<double> values({n, py::ssize_t{F::nodes}});
        py::array_t<double> gradients(
            {py::ssize_t{F::tdim}, n, py::ssize_t{F::nodes}});
        for (py::ssize_t q = 0; q < n; ++q)
        {
          const typename F::RefPoint xi(points.data(q, 0));
          const auto N = F::Node::values(xi);
          const auto dN = F::Node::gradients(xi);
          for (int a = 0; a < F::nodes; ++a)
            values.mutable_at(q, a) = N[a];
          for (int i = 0; i < F::tdim; ++i)
            for (int a = 0; a < F::nodes; ++a)
              gradients.mutable_at(i, q, a) = dN(a, i);
        }
        return py::make_tuple(values, gradients);
      });
}
} // namespace

void bind_geometry(py::module_& m)
{
  py::enum_<Shape>(m, "Shape")
      .value("interval", Shape::interval)
      .value("triangle", Shape::triangle)
      .value("quadrilateral", Shape::quadrilateral);
  m.def("clip_convex", &clip, py::arg("slave"), py::arg("master"),
        "Intersection of two convex counter-clockwise polygons, (n, 2).");
  m.def("shape_functions", &shape_functions, py::arg("shape"),
        py::arg("degree"), py::arg("points"),
        "Lagrange functions on a reference facet, (n, nodes), and gradients.");
}
} // namespace raymortar::bindings
