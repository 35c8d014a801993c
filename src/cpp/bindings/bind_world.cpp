#include <pybind11/stl.h>

#include "bindings/bindings.h"

namespace py = pybind11;

namespace flatland {

py::object to_python(const StepReport& report) {
  if (report.empty()) return py::none();
  return py::make_tuple(report.limited, report.invalid);
}

WorldClass bind_world(py::module_& module) {
  WorldClass world(module, "World", "A Box2D world without gravity; owns all objects in it.");
  world.def(py::init<>());
  world.def("close", &World::close, "Destroys all objects; all ids become stale.");
  world.def_property_readonly("closed", &World::closed);
  world.def(
      "step",
      [](World& self, double dt, int velocity_iterations, int position_iterations) {
        // Safe without the GIL: the world is in exclusive use by this thread, and without a hook
        // the step accesses no Python object.
        World::ExclusiveUse use(self, World::kStepping);
        return to_python(without_gil_if(self.last_step_time() > kShortStep, use, [&] {
          return self.step(dt, velocity_iterations, position_iterations, nullptr);
        }));
      },
      py::arg("dt"), py::arg("velocity_iterations"), py::arg("position_iterations"));
  world.def("copy", [](World& self) {
    auto copy = std::make_shared<World>();
    copy->become_copy_of(self);
    copy->rays().fans().share(self.rays().fans());
    return copy;
  });
  world.def("become_copy_of", &World::become_copy_of, py::arg("source"));
  world.def("clear", &World::clear, "Destroys all objects; unlike a new world, ids go on.");
  world.def("find_new_contacts", &World::find_new_contacts);
  world.def("destroy_body", &World::destroy_body, py::arg("body"));
  world.def("destroy_joint", &World::destroy_joint, py::arg("joint"));
  world.def("object_counts", [](const World& self) {
    const auto counts = self.object_counts();
    return py::make_tuple(counts[0], counts[1], counts[2], counts[3]);
  });
  world.def("has_body", &World::has_body, py::arg("body"));
  world.def("has_fixture", &World::has_fixture, py::arg("fixture"));
  world.def("has_joint", &World::has_joint, py::arg("joint"));
  return world;
}

}  // namespace flatland
