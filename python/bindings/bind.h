// One function per file of bindings.
#pragma once

#include "arrays.h"

namespace raymortar::bindings
{
/// PETSc objects come as petsc4py's `handle`: the C pointer as a number
template <class Handle>
Handle from_handle(std::uintptr_t handle)
{
  // NOLINTNEXTLINE(performance-no-int-to-ptr): petsc4py gives nothing else
  return reinterpret_cast<Handle>(handle);
}

void bind_geometry(py::module_& m);
void bind_surface(py::module_& m);
void bind_zone_input(py::module_& m);
void bind_zone(py::module_& m);
void bind_assembly(py::module_& m);
void bind_flux(py::module_& m);
void bind_adjoint(py::module_& m);
void bind_rigid(py::module_& m);
} // namespace raymortar::bindings
