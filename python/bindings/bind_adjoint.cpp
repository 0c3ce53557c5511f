#include "bind.h"
#include "raymortar/adjoint/parameters.h"
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
  static const std::map<std::string, Kind> kinds{{"fields", Kind::fields},
                                                 {"gamma", Kind::gamma},
                                                 {"old", Kind::old},
                                                 {"reference", Kind::reference},
                                                 {"tool", Kind::tool}};
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
}
} // namespace raymortar::bindings
