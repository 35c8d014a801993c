#include <pybind11/stl.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

TouchCollector& changed_collector(World& world, Id id) {
  world.check_changeable();
  TouchCollector* collector = world.contacts().touches.find(id);
  if (collector == nullptr) throw StaleHandleError("the collector of contacts was removed");
  return *collector;
}

// Contact id, this body, other body, whether this body is body A, solver calls in the last step,
// sums of normal and of tangent impulses, points, normal; the last three are those of the points.
py::list to_rows(const World& world, const TouchCollector& collector) {
  py::list rows;
  for (const Touch& touch : collector.touches) {
    const bool is_solved = touch.solved_in == world.contacts().step() && touch.solver_calls > 0;
    py::list normal_impulses, tangent_impulses, points;
    for (std::size_t i = 0; is_solved && i < touch.point_count; ++i) {
      normal_impulses.append(touch.normal_impulses[i]);
      tangent_impulses.append(touch.tangent_impulses[i]);
      points.append(py::make_tuple(touch.points[i][0], touch.points[i][1]));
    }
    rows.append(py::make_tuple(touch.contact_id, touch.this_body, touch.other_body, touch.is_a,
                               is_solved ? touch.solver_calls : 0, normal_impulses,
                               tangent_impulses, points,
                               py::make_tuple(touch.normal[0], touch.normal[1])));
  }
  return rows;
}

}  // namespace

void bind_touches(WorldClass& world) {
  world.def(
      "add_touches",
      [](World& self, std::vector<Id> bodies, std::vector<Id> excluded, bool counts_sensors,
         bool counts_own) {
        for (const Id body : bodies) self.change_body(body);  // throws if it does not exist
        TouchCollector collector;
        collector.bodies = std::move(bodies);
        collector.excluded = std::move(excluded);
        collector.counts_sensors = counts_sensors;
        collector.counts_own = counts_own;
        return self.contacts().touches.add(collector, self.contacts().touching(self.engine()));
      },
      py::arg("bodies"), py::arg("excluded"), py::arg("counts_sensors"), py::arg("counts_own"));
  world.def("has_touches",
            [](World& self, Id id) { return self.contacts().touches.find(id) != nullptr; });
  world.def("remove_touches", [](World& self, Id id) {
    changed_collector(self, id);
    self.contacts().touches.remove(id);
  });
  world.def("is_touched", [](World& self, Id id) {
    const TouchCollector& collector = changed_collector(self, id);
    return collector.was_touched || !collector.touches.empty();
  });
  world.def("was_touched",
            [](World& self, Id id) { return changed_collector(self, id).was_touched; });
  world.def("clear_touches",
            [](World& self, Id id) { changed_collector(self, id).was_touched = false; });
  world.def("count_touches",
            [](World& self, Id id) { return changed_collector(self, id).touches.size(); });
  world.def("touch_rows",
            [](World& self, Id id) { return to_rows(self, changed_collector(self, id)); });
  world.def("end_runs_at_touches", [](World& self, Id id, bool ends_runs) {
    self.contacts().touches.set_ends_runs(changed_collector(self, id), ends_runs);
  });
  world.def("has_ending_touches",
            [](const World& self) { return self.contacts().touches.end_run(); });
  world.def("own_bodies", [](World& self, const std::vector<Id>& bodies, bool are_owned) {
    self.check_changeable();
    for (const Id body : bodies) {
      // Those of destroyed bodies are forgotten with them.
      if (!are_owned || self.has_body(body)) self.contacts().touches.set_owned(body, are_owned);
    }
  });
  world.def("record_body_contacts", [](World& self, Id body, std::uint8_t kinds) {
    self.change_body(body);
    self.contacts().record_body(body, kinds);
  });
  world.def("record_all_contacts", [](World& self, std::uint8_t kinds) {
    self.check_changeable();
    self.contacts().record_all(kinds);
  });
}

}  // namespace flatland
