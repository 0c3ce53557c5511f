// Bindings of what a solver's iterations use: bodies that move, the system.
#pragma once

#include <pybind11/pybind11.h>

namespace raymortar::bindings
{
void bind_body(pybind11::module_& m);
void bind_system(pybind11::module_& m);
} // namespace raymortar::bindings
