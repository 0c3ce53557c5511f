#include "bind_system.h"
#include "raymortar/nodes/node_sums.h"
#include "raymortar/rigid/body.h"
#include "raymortar/system/contact_system.h"
#include "structs.h"

namespace raymortar::bindings
{
namespace
{
/// NumPy arrays whose memory the library reads and writes: never a copy
using Shared = py::array_t<double, py::array::c_style>;

std::span<double> shared(Shared& a)
{
  return {a.mutable_data(), static_cast<std::size_t>(a.size())};
}

std::unique_ptr<CoupledValues> make_values(
    int comm, std::vector<Shared> functions,
    const std::vector<std::size_t>& owned, const Array<GlobalIndex>& rows,
    std::vector<MultiplierValues> multipliers, std::vector<BodyValues> bodies)
{
  std::vector<FunctionValues> values;
  for (std::size_t k = 0; k < functions.size(); ++k)
    values.push_back({shared(functions[k]), owned[k]});
  return std::make_unique<CoupledValues>(MPI_Comm_f2c(comm), std::move(values),
                                         to_span(rows), std::move(multipliers),
                                         std::move(bodies));
}

MultiplierValues make_multiplier(Shared local, const Array<Index>& owned,
                                 const Array<GlobalIndex>& rows, int components)
{
  return {shared(local), to_vector(owned), to_vector(rows), components};
}

SystemZone make_zone(Zone& zone, BlockPositions& positions,
                     AssemblyStatistics& statistics, std::size_t contact,
                     const Array<Index>& slave, const Array<Index>& master,
                     const Array<Index>& nodes,
                     const std::vector<RigidBody*>& bodies)
{
  return {&zone,
          &positions,
          &statistics,
          contact,
          to_vector(slave),
          to_vector(master),
          to_vector(nodes),
          {bodies.begin(), bodies.end()}};
}
/// Residual into b, and its norms
auto residual(const ContactSystem& system, std::uintptr_t b,
              const Array<double>& volume, const Array<std::int8_t>& fixed,
              const Array<double>& owned, const Array<double>& increment,
              const Array<double>& of_u, const Array<double>& values,
              bool contact)
{
  const Lacking lacking{to_span(fixed), to_span(owned), to_span(increment),
                        to_span(of_u), to_span(values)};
  const Norms found = system.residual(from_handle<PetscVector>(b),
                                      to_span(volume), lacking, contact);
  return std::tuple(to_array(found.residual), to_array(found.forces),
                    to_array(found.lacking), to_array(found.sizes));
}
} // namespace

void bind_system(py::module_& m)
{
  py::class_<MultiplierValues>(m, "MultiplierValues")
      .def(py::init<>())
      .def(py::init(&make_multiplier), py::keep_alive<1, 2>(), py::arg("local"),
           py::arg("owned"), py::arg("rows"), py::arg("components"));
  py::class_<BodyValues>(m, "BodyValues")
      .def(py::init(
               [](RigidBody& body, const Array<GlobalIndex>& rows) {
                 return BodyValues{&body, to_vector(rows)};
               }),
           py::keep_alive<1, 2>(), py::arg("body"), py::arg("rows"));
  py::class_<CoupledValues>(m, "CoupledValues")
      .def(py::init(&make_values), py::keep_alive<1, 3>(),
           py::keep_alive<1, 6>(), py::keep_alive<1, 7>(), py::arg("comm"),
           py::arg("functions"), py::arg("owned"), py::arg("rows"),
           py::arg("multipliers"), py::arg("bodies"))
      .def("to_vector", [](const CoupledValues& v, std::uintptr_t x,
                           const std::vector<double>& scales)
           { v.to_vector(from_handle<PetscVector>(x), scales); })
      .def("from_vector", [](CoupledValues& v, std::uintptr_t x,
                             const std::vector<double>& scales)
           { v.from_vector(from_handle<PetscVector>(x), scales); });
  py::class_<SystemZone>(m, "SystemZone")
      .def(py::init(&make_zone), py::keep_alive<1, 2>(), py::keep_alive<1, 3>(),
           py::keep_alive<1, 4>(), py::keep_alive<1, 9>(), py::kw_only(),
           py::arg("zone"), py::arg("positions"), py::arg("statistics"),
           py::arg("contact"), py::arg("slave"), py::arg("master"),
           py::arg("nodes"), py::arg("bodies"));
  py::class_<ContactSystem>(m, "ContactSystem")
      .def(
          py::init(
              [](std::vector<SystemZone> zones, Shared u, CoupledValues& values)
              { return ContactSystem(std::move(zones), shared(u), values); }),
          py::keep_alive<1, 2>(), py::keep_alive<1, 3>(),
          py::keep_alive<1, 4>(), py::arg("zones"), py::arg("u"),
          py::arg("values"))
      .def("set_unknowns",
           [](ContactSystem& s, std::uintptr_t x,
              const std::vector<double>& scales, bool anew) {
             return s.set_unknowns(from_handle<PetscVector>(x), scales, anew);
           })
      .def("is_finite", &ContactSystem::is_finite)
      .def("has_moved", &ContactSystem::has_moved)
      .def("is_at", [](const ContactSystem& s, const Array<double>& u)
           { return s.is_at(to_span(u)); })
      .def("loads_changed", &ContactSystem::loads_changed)
      .def("pair", &ContactSystem::pair)
      .def("add_residual", [](const ContactSystem& s, std::uintptr_t b)
           { s.add_residual(from_handle<PetscVector>(b)); })
      .def("residual", &residual)
      .def("lift", [](const ContactSystem& s, std::uintptr_t b,
                      const Array<double>& increment, double alpha)
           { s.lift(from_handle<PetscVector>(b), to_span(increment), alpha); })
      .def("add_tangent", [](const ContactSystem& s, std::uintptr_t A)
           { s.add_tangent(from_handle<PetscMatrix>(A)); })
      .def("node_weights",
           [](const ContactSystem& s, std::size_t contact)
           {
             const NodeWeights found =
                 node_weights(s.node_sums(contact), s.nodes(contact));
             return std::tuple(to_array(found.area), to_array(found.gamma));
           })
      .def("set_groups",
           [](ContactSystem& s, const Array<Index>& of_row, std::size_t count,
              const Array<double>& mass,
              const std::vector<Array<Index>>& fields)
           {
             RowGroups groups{to_vector(of_row), count, to_vector(mass), {}};
             for (const Array<Index>& field : fields)
               groups.fields.push_back(to_vector(field));
             s.set_groups(std::move(groups));
           });
}
} // namespace raymortar::bindings
