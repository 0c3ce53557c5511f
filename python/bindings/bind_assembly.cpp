#include "bind.h"
#include "raymortar/fem/assembly.h"
#include "raymortar/fem/pattern.h"
#include "raymortar/fem/set_pattern.h"
#include "structs.h"
#include <petscpc.h>

namespace raymortar::bindings
{
namespace
{
void preallocate_zones(std::uintptr_t A, const Array<std::int32_t>& offsets,
                       const Array<std::int32_t>& columns,
                       const std::vector<const Zone*>& zones,
                       const std::vector<const Pattern*>& patterns,
                       const std::vector<FieldRows>& fields)
{
  preallocate(from_handle<PetscMatrix>(A), to_span(offsets), to_span(columns),
              zones, patterns, fields);
}

/// Whether a preconditioner is to stay while the matrix changes, as SNES asks
/// by its lag
bool is_reused(std::uintptr_t pc)
{
  PetscBool reused = PETSC_FALSE;
  check(PCGetReusePreconditioner(from_handle<PC>(pc), &reused),
        "PCGetReusePreconditioner");
  return reused == PETSC_TRUE;
}
} // namespace

void bind_assembly(py::module_& m)
{
  py::class_<Pattern>(m, "Pattern")
      .def(py::init<>())
      .def("covers", &Pattern::covers)
      .def("extend", &Pattern::extend)
      .def("__len__", [](const Pattern& p) { return p.pairs().size(); });
  py::class_<AssemblyStatistics>(m, "AssemblyStatistics")
      .def(py::init<>())
      .def("as_dict", &to_dict<AssemblyStatistics>);
  m.def("add_residual",
        [](const Zone& z, std::uintptr_t b, AssemblyStatistics& statistics)
        { add_residual(z, from_handle<PetscVector>(b), statistics); });
  py::class_<BlockPositions>(m, "BlockPositions")
      .def(py::init<>())
      .def("lookups", &BlockPositions::lookups)
      .def("forget", &BlockPositions::forget);
  m.def("add_tangent",
        [](const Zone& z, std::uintptr_t A, BlockPositions& positions,
           AssemblyStatistics& statistics) {
          add_tangent(z, from_handle<PetscMatrix>(A), positions, statistics);
        });
  m.def("apply_lifting",
        [](const Zone& z, std::uintptr_t b, const Array<double>& slave,
           const Array<double>& master, double alpha,
           AssemblyStatistics& statistics)
        {
          const auto fetched =
              z.to_master(to_span(master), z.input().slave.gdim);
          apply_lifting(z, from_handle<PetscVector>(b), to_span(slave), fetched,
                        alpha, statistics);
        });
  bind_options<FieldRows>(m, "FieldRows", Field{"zone", &FieldRows::zone},
                          Field{"slave", &FieldRows::slave},
                          Field{"master", &FieldRows::master},
                          Field{"per_slave", &FieldRows::per_slave},
                          Field{"per_master", &FieldRows::per_master});
  m.def("is_reused", &is_reused);
  m.def("set_pattern",
        [](std::uintptr_t A, const Array<std::int32_t>& offsets,
           const Array<std::int32_t>& columns)
        {
          set_pattern(from_handle<PetscMatrix>(A), to_span(offsets),
                      to_span(columns));
        });
  m.def("preallocate", &preallocate_zones, py::arg("A"), py::arg("offsets"),
        py::arg("columns"), py::arg("zones"), py::arg("patterns"),
        py::arg("fields") = std::vector<FieldRows>());
}
} // namespace raymortar::bindings
