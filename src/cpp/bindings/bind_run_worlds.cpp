#include <pybind11/stl.h>

#include <cstddef>
#include <exception>
#include <memory>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/runs.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The steps of one world: World.run with its arguments.
using WorldRun =
    std::tuple<std::shared_ptr<World>, std::int64_t, std::int64_t, double, int, int, bool>;

// A run of several worlds at the same time, each by one thread.
class Runs {
 public:
  explicit Runs(const std::vector<WorldRun>& runs)
      : runs_(runs), uses_(runs.size()), results_(runs.size()), errors_(runs.size()) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      World& world = *std::get<0>(runs_[i]);
      try {
        uses_[i] = std::make_unique<World::ExclusiveUse>(world, World::kStepping);
        seconds_ += world.last_step_time() * static_cast<double>(std::get<2>(runs_[i]));
      } catch (const std::exception&) {
        errors_[i] = std::current_exception();
      }
    }
  }

  // Expected wall time on one processor [s].
  double seconds() const { return seconds_; }

  void run(std::size_t i) {
    if (!uses_[i]) return;
    try {
      const auto& [world, step, n, dt, velocity, position, only_physics] = runs_[i];
      results_[i] = world->run(step, n, dt, velocity, position, only_physics);
    } catch (const std::exception&) {
      errors_[i] = std::current_exception();
    }
  }

  // To be called before the GIL is acquired: other threads that hold it may wait for the end.
  void end() { uses_.clear(); }

  py::list to_python() const {
    py::list list;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      list.append(errors_[i] ? error_of(errors_[i]) : flatland::to_python(results_[i]));
    }
    return list;
  }

 private:
  // Converts an exception to an instance of the Python class that pybind11 would raise.
  static py::object error_of(const std::exception_ptr& error) {
    const auto errors = py::module_::import("flatland.errors");
    try {
      std::rethrow_exception(error);
    } catch (const StaleHandleError& stale) {
      return errors.attr("StaleHandleError")(stale.what());
    } catch (const WorldLockedError& locked) {
      return errors.attr("WorldLockedError")(locked.what());
    } catch (const std::invalid_argument& invalid) {
      return py::module_::import("builtins").attr("ValueError")(invalid.what());
    } catch (const std::exception& other) {
      return py::module_::import("builtins").attr("MemoryError")(other.what());
    }
  }

  const std::vector<WorldRun>& runs_;
  std::vector<std::unique_ptr<World::ExclusiveUse>> uses_;
  std::vector<RunResult> results_;
  std::vector<std::exception_ptr> errors_;
  double seconds_ = 0.0;
};

py::list run_worlds(const std::vector<WorldRun>& given, std::size_t num_threads) {
  for (const WorldRun& run : given) {
    checked_step(std::get<1>(run));
    checked_step(std::get<2>(run));
  }
  Runs runs(given);
  const auto run = [&](std::size_t i) { runs.run(i); };
  if (given.empty() || runs.seconds() <= kShortStep) {
    for (std::size_t i = 0; i < given.size(); ++i) run(i);
    runs.end();
  } else {
    // The pool of the first world, which exists during the call.
    ThreadPool& threads = std::get<0>(given.front())->threads();
    const py::gil_scoped_release unlocked;
    threads.parallel_for(given.size(), num_threads, run);
    runs.end();
  }
  return runs.to_python();
}

}  // namespace

void bind_run_worlds(py::module_& module) {
  module.def("run_worlds", &run_worlds, py::arg("runs"), py::arg("num_threads"));
}

}  // namespace flatland
