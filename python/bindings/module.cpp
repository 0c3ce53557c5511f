#include "bind.h"
#include "bind_system.h"
#include "raymortar/core/error.h"

PYBIND11_MODULE(_cpp, m)
{
  m.doc() = "C++ library of raymortar: plain arrays in, plain arrays out";
  pybind11::register_exception<raymortar::Error>(m, "Error",
                                                 PyExc_RuntimeError);
  raymortar::bindings::bind_geometry(m);
  raymortar::bindings::bind_surface(m);
  raymortar::bindings::bind_rigid(m);
  raymortar::bindings::bind_body(m);
  raymortar::bindings::bind_zone_input(m);
  raymortar::bindings::bind_zone(m);
  raymortar::bindings::bind_assembly(m);
  raymortar::bindings::bind_system(m);
  raymortar::bindings::bind_flux(m);
  raymortar::bindings::bind_adjoint(m);
}
