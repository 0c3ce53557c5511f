#include "bind.h"
#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/shapes.h"
#include <pybind11/functional.h>

namespace raymortar::bindings
{
namespace
{
/// A tool whose rays Python casts, all of a pairing at once
class CalledTool final : public Tool
{
public:
  /// @param[in] cast From positions and directions of rays, (n, 3), to found
  /// (n,), distances (n,), normals (n, 3) and their derivatives (n, 3, 3)
  /// @param[in] distance Of a position, (3,)
  CalledTool(py::function cast, py::function distance)
      : _cast(std::move(cast)), _distance(std::move(distance))
  {
  }

  void cast(std::span<const ToolRay> rays,
            std::span<ToolHit> hits) const override
  {
    const auto n = static_cast<py::ssize_t>(rays.size());
    py::array_t<double> x({n, py::ssize_t{3}}), directions({n, py::ssize_t{3}});
    for (std::size_t k = 0; k < rays.size(); ++k)
    {
      Eigen::Map<Vec<3>>(x.mutable_data() + 3 * k) = rays[k].x;
      Eigen::Map<Vec<3>>(directions.mutable_data() + 3 * k) = rays[k].n;
    }
    const auto found = _cast(x, directions).cast<py::tuple>();
    const auto is_found = found[0].cast<Array<std::int8_t>>();
    const auto g = found[1].cast<Array<double>>();
    const auto normal = found[2].cast<Array<double>>();
    const auto bend = found[3].cast<Array<double>>();
    for (std::size_t k = 0; k < rays.size(); ++k)
      hits[k] = {is_found.data()[k] != 0, g.data()[k],
                 Eigen::Map<const Vec<3>>(normal.data() + 3 * k),
                 Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                     bend.data() + 9 * k)};
  }

  [[nodiscard]] double distance(const Vec<3>& x) const override
  {
    py::array_t<double> at(3);
    Eigen::Map<Vec<3>>(at.mutable_data()) = x;
    return _distance(at).cast<double>();
  }

private:
  py::function _cast, _distance;
};

Vec<3> vector(const Array<double>& v) { return {v.at(0), v.at(1), v.at(2)}; }

using Made = std::shared_ptr<const Tool>;

/// @param[in] x (points, gdim)
/// @param[in] nodes (facets, nodes per facet)
Made facet_tool(Shape shape, int degree, const Array<double>& x,
                const Array<Index>& nodes)
{
  const auto points = to_span(x);
  const auto numbers = to_span(nodes);
  return make_facet_tool({shape,
                          degree,
                          {points.begin(), points.end()},
                          {numbers.begin(), numbers.end()}});
}

/// Distances of points from a tool along directions, (n,); infinite where they
/// do not meet it
/// @param[in] x, n (n, 3), in the coordinates that the tool was made in
py::array_t<double> distances_along(const Tool& tool, const Array<double>& x,
                                    const Array<double>& n)
{
  std::vector<ToolRay> rays;
  for (py::ssize_t k = 0; k < x.size() / 3; ++k)
    rays.push_back({Eigen::Map<const Vec<3>>(x.data() + 3 * k),
                    Eigen::Map<const Vec<3>>(n.data() + 3 * k)});
  std::vector<ToolHit> hits(rays.size());
  tool.cast(rays, hits);
  std::vector<double> found;
  for (const ToolHit& hit : hits)
    found.push_back(hit.found ? hit.g
                              : std::numeric_limits<double>::infinity());
  return to_array(found);
}
} // namespace

void bind_rigid(py::module_& m)
{
  py::class_<Tool, std::shared_ptr<Tool>>(m, "Tool").def(
      "distances_along", &distances_along, py::arg("x"), py::arg("n"));
  m.def("facet_tool", &facet_tool, py::arg("shape"), py::arg("degree"),
        py::arg("x"), py::arg("nodes"));
  m.def(
      "plane",
      [](const Array<double>& point, const Array<double>& normal)
      { return make_plane(vector(point), vector(normal)); },
      py::arg("point"), py::arg("normal"));
  m.def(
      "sphere",
      [](const Array<double>& centre, double radius, bool hollow)
      { return make_sphere(vector(centre), radius, {hollow}); },
      py::arg("centre"), py::arg("radius"), py::arg("hollow"));
  m.def(
      "cylinder",
      [](const Array<double>& point, const Array<double>& axis, double radius,
         bool hollow)
      { return make_cylinder(vector(point), vector(axis), radius, {hollow}); },
      py::arg("point"), py::arg("axis"), py::arg("radius"), py::arg("hollow"));
  m.def(
      "cone",
      [](const Array<double>& tip, const Array<double>& axis, double half_angle,
         bool hollow)
      { return make_cone(vector(tip), vector(axis), half_angle, {hollow}); },
      py::arg("tip"), py::arg("axis"), py::arg("half_angle"),
      py::arg("hollow"));
  m.def(
      "torus",
      [](const Array<double>& centre, const Array<double>& axis, double major,
         double minor, bool hollow) {
        return make_torus(vector(centre), vector(axis), major, minor, {hollow});
      },
      py::arg("centre"), py::arg("axis"), py::arg("major"), py::arg("minor"),
      py::arg("hollow"));
  m.def(
      "called_tool",
      [](py::function cast, py::function distance) -> Made {
        return std::make_shared<CalledTool>(std::move(cast),
                                            std::move(distance));
      },
      py::arg("cast"), py::arg("distance"));
}
} // namespace raymortar::bindings
