#include "bind.h"
#include "raymortar/geometry/clip.h"
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
} // namespace

void bind_geometry(py::module_& m)
{
  py::enum_<Shape>(m, "Shape")
      .value("interval", Shape::interval)
      .value("triangle", Shape::triangle)
      .value("quadrilateral", Shape::quadrilateral);
  m.def("clip_convex", &clip, py::arg("slave"), py::arg("master"),
        "Intersection of two convex counter-clockwise polygons, (n, 2).");
}
} // namespace raymortar::bindings
