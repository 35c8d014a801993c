#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "bindings/runs.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

Phase phase_of(bool is_after) { return is_after ? Phase::kAfter : Phase::kBefore; }

std::uint32_t add_clock(World& world, bool is_after, const std::string& kind,
                        std::uint64_t half_step, std::uint64_t cycle) {
  world.check_changeable();
  RateClock::Kind checked = RateClock::Kind::kPeriodic;
  if (kind == "always") {
    checked = RateClock::Kind::kAlways;
  } else if (kind == "at_start") {
    checked = RateClock::Kind::kAtStart;
  } else if (kind == "never") {
    checked = RateClock::Kind::kNever;
  } else if (kind != "periodic" || half_step == 0 || cycle >> 63U != 0 || half_step >= cycle / 2) {
    throw py::value_error(
        "a clock must be always, at_start, never, or periodic with a step of less "
        "than its cycle, which must be below 2^63");
  }
  return world.plan().add_clock(phase_of(is_after), RateClock(checked, half_step, cycle));
}

Record& changed_record(World& world, Id id) {
  world.check_changeable();
  Record* record = world.plan().find_record(id);
  if (record == nullptr) throw StaleHandleError("the record was removed");
  return *record;
}

void bind_clocks(WorldClass& world) {
  world.def("add_clock", &add_clock, py::arg("is_after"), py::arg("kind"), py::arg("half_step"),
            py::arg("cycle"));
  world.def("set_clock_calls", [](World& self, std::uint32_t clock, bool has_calls) {
    self.check_changeable();
    self.plan().set_calls(clock, has_calls);
  });
  world.def(
      "add_record",
      [](World& self, std::uint32_t clock, std::int64_t order, std::optional<Id> body,
         std::optional<Id> touches) {
        self.check_changeable();
        Record record;
        record.clock = clock;
        record.order = order;
        record.touches = touches.value_or(0);
        if (body) {
          self.read_body(*body);  // throws if it does not exist
          record.body = *body;
        }
        return self.plan().add_record(record);
      },
      py::arg("clock"), py::arg("order"), py::arg("body"), py::arg("touches"));
  world.def("enable_record", [](World& self, Id id, bool is_enabled) {
    changed_record(self, id).is_enabled = is_enabled;
  });
  world.def("remove_record", [](World& self, Id id) {
    changed_record(self, id);
    self.plan().remove_record(id);
  });
  world.def("take_skipped", [](World& self) {
    self.check_changeable();
    std::vector<std::tuple<Id, std::int64_t, std::int64_t, PyTriple>> rows;
    for (const SkippedUpdates& each : self.plan().take_skipped()) {
      rows.emplace_back(each.record, each.count, each.step, to_python(each.pose));
    }
    return rows;
  });
}

void bind_run(WorldClass& world) {
  world.def("begin_step", [](World& self, std::int64_t step) {
    self.check_changeable();
    const std::uint64_t due = self.plan().calls_due(checked_step(step));
    self.plan().begin(step);
    return due;
  });
  world.def(
      "carry_out",
      [](World& self, bool is_after, std::int64_t until, double dt) {
        self.check_changeable();
        self.plan().carry_out(self, phase_of(is_after), until, dt);
        return self.plan().has_failed();
      },
      py::arg("is_after"), py::arg("until"), py::arg("dt"));
  world.def(
      "run",
      [](World& self, std::int64_t step, std::int64_t n, double dt, int velocity_iterations,
         int position_iterations, bool only_physics) {
        // Safe without the GIL: the world is in exclusive use by this thread, and the run accesses
        // no Python object.
        checked_step(step);
        checked_step(n);
        World::ExclusiveUse use(self, World::kStepping);
        const bool is_long = self.last_step_time() * static_cast<double>(n) > kShortStep;
        return to_python(without_gil_if(is_long, use, [&] {
          return self.run(step, n, dt, velocity_iterations, position_iterations, only_physics);
        }));
      },
      py::arg("step"), py::arg("n"), py::arg("dt"), py::arg("velocity_iterations"),
      py::arg("position_iterations"), py::arg("only_physics"));
}

}  // namespace

void bind_steps(WorldClass& world) {
  bind_clocks(world);
  bind_run(world);
}

}  // namespace flatland
