#include <pybind11/stl.h>

#include "bindings/bindings.h"

namespace py = pybind11;

namespace flatland {

py::object to_python(const StepReport& report) {
  if (report.empty()) return py::none();
  return py::make_tuple(report.limited, report.invalid);
}

WorldClass bind_world(py::module_& module) {
  WorldClass world(module, "World", "A Box2D world without gravity; owns all that is in it.");
  world.def(py::init<>());
  world.def("close", &World::close, "Frees everything; all ids are stale from then on.");
  world.def_property_readonly("closed", &World::closed);
  world.def(
      "step",
      [](World& self, double dt, int velocity_iterations, int position_iterations) {
        // Safe without the GIL: the world is held for this thread, and the step touches no Python
        // object as there is no hook.
        World::ExclusiveUse use(self, World::kStepping);
        return to_python(without_gil(
            use, [&] { return self.step(dt, velocity_iterations, position_iterations, nullptr); }));
      },
      py::arg("dt"), py::arg("velocity_iterations"), py::arg("position_iterations"));
  world.def("find_new_contacts", &World::find_new_contacts);
  world.def("destroy_body", &World::destroy_body, py::arg("body"));
  world.def("destroy_joint", &World::destroy_joint, py::arg("joint"));
  world.def("has_body", &World::has_body, py::arg("body"));
  world.def("has_fixture", &World::has_fixture, py::arg("fixture"));
  world.def("has_joint", &World::has_joint, py::arg("joint"));
  return world;
}

}  // namespace flatland
