#include "arrays.h"
#include "bind_system.h"
#include "raymortar/rigid/body.h"
#include "raymortar/rigid/turning.h"

namespace raymortar::bindings
{
namespace
{
/// A view of numbers of a body, which it outlives
py::array_t<double> view(const py::object& body, double* values, std::size_t n)
{
  return py::array_t<double>(static_cast<py::ssize_t>(n), values, body);
}

void assign(double* values, std::size_t n, const Array<double>& given)
{
  if (static_cast<std::size_t>(given.size()) != n)
    throw py::value_error("this takes " + std::to_string(n) + " numbers, not " +
                          std::to_string(given.size()));
  std::copy_n(given.data(), n, values);
}

/// An attribute that is a view of three numbers and is set to copies
template <Vec<3> RigidBody::*Member>
void bind_vector(py::class_<RigidBody>& c, const char* name)
{
  c.def_property(
      name,
      [](const py::object& self)
      { return view(self, (self.cast<RigidBody&>().*Member).data(), 3); },
      [](RigidBody& body, const Array<double>& given)
      { assign((body.*Member).data(), 3, given); });
}

/// The same of a number for each unknown
template <std::vector<double> RigidBody::*Member>
void bind_list(py::class_<RigidBody>& c, const char* name)
{
  c.def_property(
      name,
      [](const py::object& self)
      {
        auto& values = self.cast<RigidBody&>().*Member;
        return view(self, values.data(), values.size());
      },
      [](RigidBody& body, const Array<double>& given)
      { assign((body.*Member).data(), body.size(), given); });
}

py::array_t<double> matrix(const Mat<3, 3>& m)
{
  py::array_t<double> a({3, 3});
  Eigen::Map<RigidBody::Matrix>(a.mutable_data()) = m;
  return a;
}

Vec<3> vector3(const Array<double>& a)
{
  return Eigen::Map<const Vec<3>>(a.data());
}

py::array_t<double> numbers(const Motion& motion)
{
  return py::array_t<double>(static_cast<py::ssize_t>(motion.size()),
                             motion.data());
}

RigidBody make_body(const Array<double>& centre, std::vector<int> axis,
                    std::vector<bool> turns, std::vector<double> stiffness,
                    std::vector<double> damping)
{
  RigidBody body;
  body.centre = vector3(centre);
  body.values = body.accepted = std::vector<double>(axis.size(), 0.0);
  body.axis = std::move(axis);
  body.turns = std::move(turns);
  body.stiffness = std::move(stiffness);
  body.damping = std::move(damping);
  body.seen = body.motion();
  return body;
}

void set_spin(RigidBody& body, const Array<double>& J, double whole,
              double factor, double rate, const Array<double>& start,
              const Array<double>& kept)
{
  body.spin = SpinInertia{Eigen::Map<const RigidBody::Matrix>(J.data()),
                          whole,
                          factor,
                          rate,
                          vector3(start),
                          vector3(kept)};
}

/// Drift (n, 3), spin (n, 3, 3) and bends (n, n, 3, 3)
py::tuple rates(const RigidBody& body)
{
  const Freedom free = body.freedom();
  const auto n = static_cast<py::ssize_t>(body.size());
  py::array_t<double> drift({n, py::ssize_t{3}});
  py::array_t<double> spin({n, py::ssize_t{3}, py::ssize_t{3}});
  py::array_t<double> bend({n, n, py::ssize_t{3}, py::ssize_t{3}});
  double* to_drift = drift.mutable_data();
  double* to_spin = spin.mutable_data();
  double* to_bend = bend.mutable_data();
  for (const Freedom::Rate& rate : free.rates)
  {
    to_drift = std::copy_n(rate.drift.data(), 3, to_drift);
    Eigen::Map<RigidBody::Matrix>{to_spin} = rate.spin;
    to_spin += 9;
  }
  for (const Mat<3, 3>& one : free.bends)
  {
    Eigen::Map<RigidBody::Matrix>{to_bend} = one;
    to_bend += 9;
  }
  return py::make_tuple(drift, spin, bend);
}

py::tuple forces(const RigidBody& body)
{
  const BodyForces found = body.forces();
  const auto n = static_cast<py::ssize_t>(body.size());
  py::array_t<double> pushed(n, found.forces.data());
  py::array_t<double> slope({n, n});
  Eigen::Map<Eigen::MatrixXd>(slope.mutable_data(), n, n) =
      found.slope.transpose();
  return py::make_tuple(pushed, slope);
}

/// (3, 3), (3, 3, 3), (3, 3, 3, 3)
py::tuple turning_arrays(const Array<double>& rotation)
{
  const Turning found = turning(vector3(rotation));
  py::array_t<double> first({3, 3, 3}), second({3, 3, 3, 3});
  double* to_first = first.mutable_data();
  double* to_second = second.mutable_data();
  for (std::size_t i = 0; i < 3; ++i)
  {
    Eigen::Map<RigidBody::Matrix>{to_first + 9 * i} = found.first[i];
    for (std::size_t j = 0; j < 3; ++j)
      Eigen::Map<RigidBody::Matrix>{to_second + 9 * (3 * i + j)} =
          found.second[i][j];
  }
  return py::make_tuple(matrix(found.R), first, second);
}
} // namespace

void bind_body(py::module_& m)
{
  m.def("rotation_matrix", [](const Array<double>& rotation)
        { return matrix(rotation_matrix(vector3(rotation))); });
  m.def("turning", &turning_arrays);
  py::class_<RigidBody> body(m, "RigidBody");
  body.def(py::init(&make_body), py::arg("centre"), py::arg("axis"),
           py::arg("turns"), py::arg("stiffness"), py::arg("damping"));
  bind_vector<&RigidBody::moved>(body, "moved");
  bind_vector<&RigidBody::turned>(body, "turned");
  bind_vector<&RigidBody::force>(body, "force");
  bind_vector<&RigidBody::moment>(body, "moment");
  bind_list<&RigidBody::stiffness>(body, "stiffness");
  bind_list<&RigidBody::damping>(body, "damping");
  bind_list<&RigidBody::values>(body, "values");
  bind_list<&RigidBody::accepted>(body, "accepted");
  body.def_property(
          "accepted_turn",
          [](const RigidBody& b) { return matrix(b.accepted_turn); },
          [](RigidBody& b, const Array<double>& given)
          { assign(b.accepted_turn.data(), 9, given); })
      .def_readwrite("lever", &RigidBody::lever)
      .def_readwrite("dt", &RigidBody::dt)
      .def_property_readonly("seen",
                             [](const RigidBody& b) { return numbers(b.seen); })
      .def("see", [](RigidBody& b) { b.seen = b.motion(); })
      .def("theta", [](const RigidBody& b)
           { return py::array_t<double>(3, b.theta().data()); })
      .def("translation", [](const RigidBody& b)
           { return py::array_t<double>(3, b.translation().data()); })
      .def("turn", [](const RigidBody& b) { return matrix(b.turn()); })
      .def("motion", [](const RigidBody& b) { return numbers(b.motion()); })
      .def("pose_of",
           [](const RigidBody& b, const Array<double>& given)
           {
             Motion motion;
             assign(motion.data(), motion.size(), given);
             const Pose pose = pose_of(b.centre, motion);
             return py::make_tuple(matrix(pose.rotation),
                                   py::array_t<double>(3, pose.shift.data()));
           })
      .def("rates", &rates)
      .def("forces", &forces)
      .def("accept", &RigidBody::accept)
      .def("set_spin", &set_spin, py::kw_only(), py::arg("J"), py::arg("whole"),
           py::arg("factor"), py::arg("rate"), py::arg("start"),
           py::arg("kept"))
      .def("clear_spin", [](RigidBody& b) { b.spin.reset(); });
}
} // namespace raymortar::bindings
