#include <pybind11/stl.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

TouchCollector& changed_collector(const TouchesHandle& touches) {
  World& world = touches.core();
  world.check_changeable();
  TouchCollector* collector = world.contacts().touches.find(touches.id);
  if (collector == nullptr) throw StaleHandleError("the collector of contacts was removed");
  return *collector;
}

std::vector<PyTouch> read_touches(const TouchesHandle& touches) {
  const std::uint64_t step = touches.core().contacts().step();
  std::vector<PyTouch> rows;
  for (const Touch& touch : changed_collector(touches).touches) {
    const bool is_solved = touch.solved_in == step && touch.solver_calls > 0;
    py::list normal_impulses, tangent_impulses, points;
    for (std::size_t i = 0; is_solved && i < touch.point_count; ++i) {
      normal_impulses.append(touch.normal_impulses[i]);
      tangent_impulses.append(touch.tangent_impulses[i]);
      points.append(to_python(touch.points[i]));
    }
    rows.push_back(make_value<PyTouch>(touch.contact_id, touch.this_body, touch.other_body,
                                       touch.is_a, is_solved ? touch.solver_calls : 0,
                                       normal_impulses, tangent_impulses, points,
                                       to_python(touch.normal)));
  }
  return rows;
}

TouchesHandle collect_touches(const PyWorld& world, const Bodies& bodies, const Bodies& exclude,
                              bool sensors, bool own) {
  World& core = *world.core;
  TouchCollector collector;
  core.check_changeable();
  collector.bodies = existing_ids_in(core, bodies);
  collector.excluded = ids_in(core, exclude);
  collector.counts_sensors = sensors;
  collector.counts_own = own;
  ContactRecorder& contacts = core.contacts();
  return {world, contacts.touches.add(collector, contacts.touching(core.engine()))};
}

void bind_touches_of(py::class_<TouchesHandle, Handle>& touches) {
  touches.def(
      "remove",
      [](const TouchesHandle& self) {
        changed_collector(self);
        self.core().contacts().touches.remove(self.id);
      },
      R"(
Ends the collection.

Raises:
    StaleHandleError: The collector has already been removed.
    WorldLockedError: The world is stepping.
)");
  touches.def_property_readonly(
      "touched",
      [](const TouchesHandle& self) {
        const TouchCollector& collector = changed_collector(self);
        return collector.was_touched || !collector.touches.empty();
      },
      "Whether there are contacts now, or one began since the last call of `clear`.");
  touches.def_property_readonly(
      "began", [](const TouchesHandle& self) { return changed_collector(self).was_touched; },
      "Whether a contact began since the last call of `clear`.");
  touches.def(
      "clear", [](const TouchesHandle& self) { changed_collector(self).was_touched = false; },
      "Discards the contacts that have ended; those that exist remain.");
  touches.def(
      "__len__", [](const TouchesHandle& self) { return changed_collector(self).touches.size(); },
      "Returns the number of contacts that exist now.");
  touches.def(
      "__bool__", [](const TouchesHandle&) { return true; },
      "Returns True, also without contacts.");
  touches.def("read", &read_touches, "Returns the contacts that exist now, the oldest first.");
}

}  // namespace

void bind_touches(Classes& classes) {
  bind_touches_of(classes.touches);
  classes.world.def("collect_touches", &collect_touches, py::arg("bodies"), py::kw_only(),
                    py::arg("exclude") = py::tuple(), py::arg("sensors") = true,
                    py::arg("own") = true, R"(
Collects the contacts of bodies with bodies of models and layers.

Args:
    bodies: The bodies.
    exclude: Bodies whose contacts are ignored.
    sensors: Whether to collect contacts with sensors, which have no effect on bodies.
    own: Whether to collect contacts between two of the bodies.

Returns:
    The contacts, also those that exist already.

Raises:
    StaleHandleError: A body was destroyed.
    WorldLockedError: The world is stepping.
)");
  classes.world.def(
      "own_bodies",
      [](World& self, const Bodies& bodies, bool are_owned) {
        self.check_changeable();
        for (const Id body : ids_in(self, bodies)) {
          // A destroyed body belongs to nothing.
          if (!are_owned || self.has_body(body)) self.contacts().touches.set_owned(body, are_owned);
        }
      },
      py::arg("bodies"), py::arg("are_owned"),
      "Sets whether bodies belong to a model or a layer; others are ignored by `Touches`.");
}

}  // namespace flatland
