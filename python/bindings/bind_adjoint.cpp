#include "bind.h"
#include "raymortar/adjoint/parameters.h"
#include "raymortar/adjoint/springs_back.h"
#include "raymortar/core/error.h"
#include "raymortar/fem/whole_blocks.h"
#include <map>
#include <string>

namespace raymortar::bindings
{
namespace
{
/// Motions as rows of a shift and the rows of a slope
std::vector<AffineRate> motions(const Array<double>& rows)
{
  constexpr py::ssize_t width = 3 + 9;
  std::vector<AffineRate> found(static_cast<std::size_t>(rows.size() / width));
  const double* row = rows.data();
  for (AffineRate& one : found)
  {
    one.shift = Eigen::Map<const Vec<3>>(row);
    one.slope =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row + 3);
    row += width;
  }
  return found;
}

Parameter::Kind kind_of(const std::string& name)
{
  using Kind = Parameter::Kind;
  static const std::map<std::string, Kind> kinds{
      {"fields", Kind::fields},     {"gamma", Kind::gamma},
      {"old", Kind::old},           {"reference", Kind::reference},
      {"unknowns", Kind::unknowns}, {"tool", Kind::tool}};
  const auto found = kinds.find(name);
  if (found == kinds.end())
    throw Error("no parameter is called " + name);
  return found->second;
}
} // namespace

void bind_adjoint(py::module_& m)
{
  m.def(
      "add_by_parameter",
      [](const Zone& z, std::uintptr_t A, const std::string& kind, Index tool,
         const Array<double>& now, const Array<double>& old)
      {
        WholeBlocks blocks(z, from_handle<PetscMatrix>(A));
        by_parameter(z.interface(),
                     {kind_of(kind), tool, motions(now), motions(old)}, blocks);
      },
      py::arg("zone"), py::arg("A"), py::arg("kind"),
      py::arg("tool") = no_index, py::arg("now") = Array<double>(0),
      py::arg("old") = Array<double>(0));
  m.def(
      "add_springs_by_parameter",
      [](const Zone& z, std::uintptr_t b, const Array<double>& weights,
         const std::string& kind, Index tool, const Array<double>& now,
         const Array<double>& old)
      {
        WholeVector vector(z, from_handle<PetscVector>(b));
        springs_by_parameter(z.interface(),
                             {kind_of(kind), tool, motions(now), motions(old)},
                             to_span(weights), vector);
      },
      py::arg("zone"), py::arg("b"), py::arg("weights"), py::arg("kind"),
      py::arg("tool") = no_index, py::arg("now") = Array<double>(0),
      py::arg("old") = Array<double>(0));
  m.def(
      "springs_back",
      [](const Zone& z, const Array<double>& slave, const Array<double>& master,
         const Array<double>& weights)
      {
        const std::vector<double> of_master =
            z.to_master(to_span(master), z.state().slave.gdim);
        return to_array(springs_back(z.interface(), {to_span(slave), of_master},
                                     to_span(weights)));
      },
      py::arg("zone"), py::arg("slave"), py::arg("master"), py::arg("weights"));
}
} // namespace raymortar::bindings
