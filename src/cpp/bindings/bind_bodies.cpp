#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstring>
#include <string>
#include <tuple>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "world/bodies.h"
#include "world/motions.h"

namespace py = pybind11;

namespace flatland {
namespace {

struct SavedMotions {
  std::vector<SavedMotion> motions;
};

b2BodyType body_type(const std::string& name) {
  if (name == "static") return b2_staticBody;
  if (name == "kinematic") return b2_kinematicBody;
  if (name == "dynamic") return b2_dynamicBody;
  throw py::value_error("body_type must be one of: static, kinematic, dynamic, got \"" + name +
                        "\"");
}

const char* type_name(b2BodyType type) {
  if (type == b2_staticBody) return "static";
  return type == b2_kinematicBody ? "kinematic" : "dynamic";
}

}  // namespace

void bind_bodies(WorldClass& world) {
  world.def(
      "create_body",
      [](World& self, const std::string& type, double x, double y, double theta,
         double linear_damping, double angular_damping) {
        return create_body(self, body_type(type), {x, y, theta}, linear_damping, angular_damping);
      },
      py::arg("body_type"), py::arg("x"), py::arg("y"), py::arg("theta"), py::arg("linear_damping"),
      py::arg("angular_damping"));
  world.def("pose", [](const World& self, Id body) { return to_python(pose_of(self, body)); });
  world.def("set_pose", [](World& self, Id body, double x, double y, double theta) {
    set_pose(self, body, {x, y, theta});
  });
  world.def("velocity",
            [](const World& self, Id body) { return to_python(velocity_of(self, body)); });
  world.def("set_velocity", [](World& self, Id body, double vx, double vy, double omega) {
    set_velocity(self, body, {vx, vy, omega});
  });
  world.def("apply_force", &apply_force);
  world.def("apply_torque", &apply_torque);
  world.def("body_type",
            [](const World& self, Id body) { return type_name(self.read_body(body)->GetType()); });
  world.def("awake", [](const World& self, Id body) { return self.read_body(body)->IsAwake(); });
  world.def("set_awake",
            [](World& self, Id body, bool awake) { self.change_body(body)->SetAwake(awake); });
  world.def("mass", [](const World& self, Id body) { return self.read_body(body)->GetMass(); });
  world.def("inertia",
            [](const World& self, Id body) { return self.read_body(body)->GetInertia(); });
  world.def("local_center", [](const World& self, Id body) {
    return to_python(self.read_body(body)->GetLocalCenter());
  });
  world.def("world_center", [](const World& self, Id body) {
    return to_python(self.read_body(body)->GetWorldCenter());
  });
  world.def("linear_damping",
            [](const World& self, Id body) { return self.read_body(body)->GetLinearDamping(); });
  world.def("angular_damping",
            [](const World& self, Id body) { return self.read_body(body)->GetAngularDamping(); });
  world.def("body_states", [](const World& self) {
    const std::vector<BodyState> states = states_of(self);
    constexpr auto kColumns = std::tuple_size_v<BodyState>;
    py::array_t<float> rows({states.size(), kColumns});
    if (!states.empty()) std::memcpy(rows.mutable_data(), states.data(), rows.nbytes());
    return rows;
  });
  // Opaque to Python, hence a class instead of a list.
  py::class_<SavedMotions>(world, "SavedMotions");
  world.def("saved_motions", [](const World& self) { return SavedMotions{saved_motions(self)}; });
  world.def("restore_motions",
            [](World& self, const SavedMotions& saved) { restore_motions(self, saved.motions); });
  world.def(
      "motions",
      [](const World& self, const std::vector<Id>& bodies) {
        py::array_t<double> rows({bodies.size(), std::size_t{6}});
        motions_of(self, bodies.data(), bodies.size(), rows.mutable_data());
        return rows;
      },
      py::arg("bodies"));
  world.def("fixtures", &fixtures_of);
  world.def("joints", &joints_of);
}

}  // namespace flatland
