#include <pybind11/stl.h>

#include "bindings/bindings.h"
#include "bindings/values.h"

namespace py = pybind11;

namespace flatland {

std::optional<PyReport> to_python(const StepReport& report) {
  if (report.empty()) return std::nullopt;
  return PyReport{report.limited, report.invalid};
}

void bind_world(WorldClass& world) {
  world.def(py::init<>());
  world.def("close", &World::close, R"(
Destroys the world and all objects in it; idempotent.

Raises:
    WorldLockedError: The world is stepping.
)");
  world.def_property_readonly("closed", &World::closed, "Whether the world is closed.");
  world.def_property("time_ns", &World::time, &World::set_time,
                     "Simulated time [ns], settable; part of what `become_copy_of` copies.");
  world.def(
      "_step",
      [](World& self, double dt, int velocity_iterations, int position_iterations) {
        // Safe without the GIL: the world is in exclusive use by this thread, and without a hook
        // the step accesses no Python object.
        World::ExclusiveUse use(self, World::kStepping);
        return to_python(without_gil_if(self.last_step_time() > kShortStep, use, [&] {
          return self.step(dt, velocity_iterations, position_iterations, nullptr);
        }));
      },
      py::arg("dt"), py::arg("velocity_iterations"), py::arg("position_iterations"));
  world.def(
      "_share_fans",
      [](World& self, World& source) { self.rays().fans().share(source.rays().fans()); },
      py::arg("source"), "Makes this world use the sorted rays of another one.");
  world.def("become_copy_of", &World::become_copy_of, py::arg("source"), R"(
Replaces all objects by exact copies of those of another world, with the same ids.

Handles of objects whose ids do not exist in the other world become stale, and their ids are not
used again.

Args:
    source: The other world, such as an earlier copy of this one.

Raises:
    StaleHandleError: One of the worlds is closed.
    WorldLockedError: One of the worlds is stepping.
)");
  world.def("clear", &World::clear, R"(
Destroys all objects; the results of the same further calls are those of a new world.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("find_new_contacts", &World::find_new_contacts, R"(
Searches for pairs of fixtures that may touch, which the next step would do otherwise.

The first search takes as long as many steps if there are many edges. The results of the next step
are the same.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("share_walls", &World::share_walls, R"(
Makes all further copies of the world share the walls, which saves memory and time.

Walls are static bodies that have only edges and no joints. Contacts with them end, and the next
step finds them again. The solver may process contacts in another order than without this call, so
that results may differ by rounding. A change of a body or a fixture with shared walls ends the
sharing of this world. Idempotent.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def_property_readonly(
      "shared_fixtures",
      [](const World& self) {
        self.check_readable();
        return self.walls().are_shared() ? self.walls().shared()->fixtures().size() : 0;
      },
      "Number of fixtures that the world shares with its copies; see `share_walls`.");
  world.def(
      "object_counts",
      [](const World& self) {
        const auto [bodies, fixtures, joints, contacts] = self.object_counts();
        return make_value<PyObjectCounts>(bodies, fixtures, joints, contacts);
      },
      R"(
Returns the numbers of objects.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def_property_readonly(
      "newest_objects",
      [](const World& self) {
        const auto [body, joint] = self.newest_objects();
        return py::make_tuple(body, joint);
      },
      "Ids of the newest body and the newest joint, 0 for none; for `objects_since`.");
  world.def(
      "objects_since",
      [](const World& self, const std::pair<Id, Id>& newest) {
        const auto [bodies, joints] = self.objects_since({newest.first, newest.second});
        return py::make_tuple(bodies, joints);
      },
      py::arg("newest"), R"(
Returns the bodies and joints that were created since, by id.

Args:
    newest: Earlier value of `newest_objects`.

Returns:
    Ids of bodies and of joints, the newest first. If an object in `newest` was destroyed
    meanwhile, there are none of its kind, since it is not known which ones are newer.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
}

}  // namespace flatland
