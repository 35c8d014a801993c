// The jobs of a world, and the runs of steps that perform them.
#include <pybind11/stl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/runs.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The interface to the jobs of a world.
struct PyJobs {
  PyWorld world;
  World& core() const { return *world.core; }
  JobQueue& queue() const { return world.core->jobs(); }
};

RateClock clock_of(std::uint64_t weight, const py::int_& cycle) {
  const py::int_ bits(64);
  const auto high = (cycle >> bits).cast<std::uint64_t>();
  const auto low = (cycle & py::int_(UINT64_MAX)).cast<std::uint64_t>();
  if (weight == 0 || weight >> 62U != 0 || high >> 63U != 0 || (high == 0 && low == 0)) {
    throw py::value_error(
        "the weight of a clock must be from 1 to 2^62 - 1, and its cycle from 1 to 2^127 - 1");
  }
  return RateClock(weight, static_cast<RateClock::Wide>(high) << 64U | low);
}

Callback& changed_callback(const PyJobs& jobs, Id id) {
  jobs.core().check_changeable();
  Callback* callback = jobs.queue().find_callback(id);
  if (callback == nullptr) throw StaleHandleError("the callback was removed");
  return *callback;
}

Id add_callback(const PyJobs& jobs, const std::pair<std::int64_t, std::int64_t>& place,
                const std::pair<std::uint64_t, py::int_>& clock, bool is_after, std::uint32_t group,
                bool is_counted, const Bodies& bodies, std::optional<TouchesHandle> touches,
                bool is_at_touches) {
  World& world = jobs.core();
  world.check_changeable();
  Callback callback;
  callback.phase = is_after ? Phase::kAfter : Phase::kBefore;
  callback.place = {place.first, place.second};
  callback.group = group;
  callback.is_counted = is_counted;
  callback.bodies = existing_ids_in(world, bodies);
  callback.touches = touches ? id_in(world, *touches) : 0;
  callback.is_at_touches = is_at_touches;
  return jobs.queue().add_callback(std::move(callback), clock_of(clock.first, clock.second));
}

using PySkipped = std::tuple<Id, std::int64_t, std::int64_t, std::vector<PyTriple>>;

std::vector<PySkipped> take_skipped(const PyJobs& jobs) {
  jobs.core().check_changeable();
  std::vector<PySkipped> rows;
  for (const SkippedUpdates& each : jobs.queue().take_skipped()) {
    std::vector<PyTriple> poses;
    for (const Triple& pose : each.poses) poses.push_back(to_python(pose));
    rows.emplace_back(each.callback, each.count, each.stamp, std::move(poses));
  }
  return rows;
}

using PyPacedResult = std::tuple<PyRunResult, PyWorkTimes>;

RunResult perform(World& world, const Run& run) {
  // Safe without the GIL: the world is in exclusive use by this thread, and the run accesses no
  // Python object.
  World::ExclusiveUse use(world, World::kStepping);
  run.check();
  return without_gil_if(world.expected_time(run) > kShortStep, use, [&] { return world.run(run); });
}

// Wall times of paced steps, and of the waits between them [s].
struct WorkTimes {
  double waited = 0.0;
  double total = 0.0;
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;

  void add(double seconds, std::int64_t steps) {
    const double mean = seconds / static_cast<double>(steps);
    total += seconds;
    least = std::min(least, mean);
    most = std::max(most, mean);
  }
};

// A run whose steps are performed at the times at which they are due. Steps that nothing could
// observe before a later one are performed together with that one, since it costs more to wake up
// than to step.
class PacedRun {
 public:
  PacedRun(World& world, const Run& run, double due, double period)
      : world_(world), run_(run), due_(due), period_(period) {}

  // Performs the first step at once. Between two steps it waits without the GIL and without a use
  // of the world. Ends before a wait if a step was late, or after the time limit, and with an
  // interrupt.
  void perform_all() {
    const double start = now();
    std::int64_t left = run_.n;
    std::int64_t count = 1;
    while (left > 0) {
      if (!perform_due(count)) return;
      const double end = now();
      left -= count;
      if (left == 0) return;
      count = std::min(left, countable(start + kLongest));
      if (end > due_ || count == 0) return;
      const bool is_due = wait(due_ + static_cast<double>(count - 1) * period_);
      times_.waited += now() - end;
      if (!is_due) {
        catch_up(count);
        return;
      }
    }
  }

  PyPacedResult to_python() const {
    return {result_tuple(result_),
            make_value<PyWorkTimes>(times_.waited, times_.total, times_.least, times_.most)};
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;

  // Signals are handled, and the time is read by other threads, after a run [s].
  static constexpr double kLongest = 0.025;
  // Steps are performed together if one of them takes at most this part of the period.
  static constexpr double kShort = 0.01;

  static double now() { return Seconds(Clock::now().time_since_epoch()).count(); }

  // Performs steps that are due. Returns whether all of them are complete.
  bool perform_due(std::int64_t count) {
    const double begin = now();
    run_.n = count;
    RunResult part;
    try {
      part = perform(world_, run_);
    } catch (const std::exception&) {
      // The steps so far must be accounted for. The next run throws again, if the reason remains.
      if (result_.steps == 0) throw;
      return false;
    }
    const bool is_complete = part.steps == count;
    run_.time += part.steps * run_.step;
    due_ += static_cast<double>(part.steps) * period_;
    part.steps += result_.steps;
    result_ = std::move(part);
    if (is_complete) times_.add(now() - begin, count);
    return is_complete;
  }

  // How many of the next steps can be performed when the last one of them is due, not later than
  // the limit: several if no code is called in them, and contacts are not waited for.
  std::int64_t countable(double limit) {
    std::int64_t count = 0;
    JobQueue& jobs = world_.jobs();
    const bool is_observed = world_.contacts().is_recording() || jobs.calls_at_touches() ||
                             world_.last_step_time() > kShort * period_;
    while (due_ + static_cast<double>(count) * period_ <= limit) {
      const bool calls = jobs.calls_at(run_.time + count * run_.step, run_.step);
      if (count > 0 && (is_observed || calls)) break;
      ++count;
      if (calls) break;
    }
    return count;
  }

  bool wait(double time) {
    const py::gil_scoped_release unlocked;
    return world_.wait_until(
        Clock::time_point(std::chrono::duration_cast<Clock::duration>(Seconds(time))));
  }

  // After an interrupt, performs those of the next steps that are due already.
  void catch_up(std::int64_t count) {
    const double late = now() - due_;
    if (late < 0.0) return;
    world_.clear_interrupt();
    perform_due(std::min(count, static_cast<std::int64_t>(late / period_) + 1));
    world_.interrupt();
  }

  World& world_;
  Run run_;     // of the next steps
  double due_;  // when the next step is due [s]
  double period_;
  RunResult result_;
  WorkTimes times_;
};

PyPacedResult run_paced(const PyJobs& jobs, const PyRun& given, double due, double period) {
  if (!std::isfinite(due) || !(period > 0.0)) {
    throw py::value_error("due must be finite and the period positive");
  }
  PacedRun run(jobs.core(), to_run(given), due, period);
  run.perform_all();
  return run.to_python();
}

// Runs of several worlds at the same time, each by one thread.
class Runs {
 public:
  explicit Runs(const std::vector<std::pair<PyWorld, PyRun>>& given)
      : uses_(given.size()), results_(given.size()), errors_(given.size()) {
    for (std::size_t i = 0; i < given.size(); ++i) {
      worlds_.push_back(given[i].first.core);
      runs_.push_back(to_run(given[i].second));
      try {
        uses_[i] = std::make_unique<World::ExclusiveUse>(*worlds_[i], World::kStepping);
        runs_[i].check();
        seconds_ += worlds_[i]->expected_time(runs_[i]);
      } catch (const std::exception&) {
        errors_[i] = std::current_exception();
      }
    }
  }

  std::size_t size() const { return runs_.size(); }
  // Expected wall time on one processor [s].
  double seconds() const { return seconds_; }

  void run(std::size_t i) {
    if (errors_[i]) return;
    try {
      results_[i] = worlds_[i]->run(runs_[i]);
    } catch (const std::exception&) {
      errors_[i] = std::current_exception();
    }
  }

  // To be called before the GIL is acquired: other threads that hold it may wait for the end.
  void end() { uses_.clear(); }

  py::list to_python() const {
    py::list list;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      list.append(errors_[i] ? error_of(errors_[i]) : py::cast(result_tuple(results_[i])));
    }
    return list;
  }

 private:
  std::vector<World*> worlds_;
  std::vector<Run> runs_;
  std::vector<std::unique_ptr<World::ExclusiveUse>> uses_;
  std::vector<RunResult> results_;
  std::vector<std::exception_ptr> errors_;
  double seconds_ = 0.0;
};

py::list run_worlds(const std::vector<std::pair<PyWorld, PyRun>>& given, std::size_t num_threads) {
  Runs runs(given);
  const auto run = [&](std::size_t i) { runs.run(i); };
  if (given.empty() || runs.seconds() <= kShortStep) {
    for (std::size_t i = 0; i < runs.size(); ++i) run(i);
    runs.end();
  } else {
    // The pool of the first world, which exists during the call.
    ThreadPool& threads = given.front().first.core->threads();
    const py::gil_scoped_release unlocked;
    threads.parallel_for(runs.size(), num_threads, run);
    runs.end();
  }
  return runs.to_python();
}

PyJobs copy_jobs(const PyJobs& jobs, const py::dict& memo) {
  const py::object key = py::module_::import("builtins").attr("id")(jobs.world.object);
  return memo.contains(key) ? PyJobs{memo[key].cast<PyWorld>()} : jobs;
}

void bind_callbacks(py::class_<PyJobs>& jobs) {
  jobs.def("add_callback", &add_callback, py::arg("place"), py::arg("clock"), py::kw_only(),
           py::arg("is_after"), py::arg("group") = 0, py::arg("is_counted") = false,
           py::arg("bodies") = py::tuple(), py::arg("touches") = py::none(),
           py::arg("is_at_touches") = false, R"(
Adds a callback.

Args:
    place: The order and the number of the callback.
    clock: When updates are due: weight and cycle, see `flatland.UpdateTimer.clock`.
    is_after: Whether the callback is called after the physics step, at time t + dt.
    group: Successive callbacks of a group are returned together; 0 for no group.
    is_counted: Whether updates that are due without a call are counted.
    bodies: Bodies whose poses are recorded at each counted update.
    touches: Collector of contacts that is cleared at each counted update.
    is_at_touches: Whether to call it also in steps in which that collector has contacts.

Returns:
    The id of the callback.

Raises:
    ValueError: A number of the clock is out of range.
    StaleHandleError: A body was destroyed.
    WorldLockedError: The world is stepping.
)");
  jobs.def(
      "set_called",
      [](const PyJobs& self, Id callback, bool is_called) {
        self.queue().set_called(changed_callback(self, callback), is_called);
      },
      py::arg("callback"), py::arg("is_called"),
      "Sets whether a callback is called when an update is due.");
  jobs.def(
      "remove_callback",
      [](const PyJobs& self, Id callback) {
        changed_callback(self, callback);
        self.queue().remove_callback(callback);
      },
      py::arg("callback"), "Removes a callback, and its clock if no other callback uses it.");
  jobs.def("take_skipped", &take_skipped, R"(
Returns the updates that were counted since the last call.

Returns:
    Id of the callback, number of updates, time of the last one [ns], and the poses of the bodies at
    that time, for each callback with counted updates.
)");
}

void bind_runs(py::class_<PyJobs>& jobs) {
  jobs.def(
      "run",
      [](const PyJobs& self, std::int64_t time, std::int64_t step, std::int64_t n, double dt,
         int velocity_iterations, int position_iterations, bool continues, bool calls_physics) {
        return result_tuple(perform(self.core(), {time, step, n, dt, velocity_iterations,
                                                  position_iterations, continues, calls_physics}));
      },
      py::arg("time"), py::arg("step"), py::arg("n"), py::arg("dt"), py::arg("velocity_iterations"),
      py::arg("position_iterations"), py::arg("continues") = false,
      py::arg("calls_physics") = false, R"(
Performs the steps of a `Run`, of whose members the arguments are; releases the GIL if that takes
long.

Returns when code has to be called, after an interrupt, and after 50 ms of wall time.

Returns:
    Number of complete steps, a `RunEnd`, ids of the callbacks to be called in order, ids of the
    controllers that have failed with their errors, and the ids of limited and of invalid bodies.

Raises:
    ValueError: A number is out of range.
    StaleHandleError: The world is closed.
    WorldLockedError: The world is in use.
)");
  jobs.def("run_paced", &run_paced, py::arg("run"), py::arg("due"), py::arg("period"), R"(
Performs the steps of a `Run` as `run`, the first one at once and then one each period.

Between two steps it waits without the GIL, and other threads may use the world. Short steps in
which no code is due, and for which no contacts are wanted, are performed together when the last one
of them is due. The run ends before a wait after 25 ms, if a step was late, and with an interrupt,
after the steps that were due before it.

Args:
    run: The steps.
    due: When the first step was due [s], on the clock of `time.perf_counter`.
    period: Wall time between two steps [s].

Returns:
    As `run`, and the wall times of the complete steps.

Raises:
    ValueError: A number is out of range.
    StaleHandleError: The world is closed.
    WorldLockedError: The world is in use.
)");
  jobs.def(
      "interrupt", [](const PyJobs& self) { self.core().interrupt(); },
      "Makes a run return after the current step; safe from any thread.");
  jobs.def(
      "clear_interrupt", [](const PyJobs& self) { self.core().clear_interrupt(); },
      "Ends the effect of `interrupt`.");
}

}  // namespace

void bind_jobs(py::module_& module, Classes& classes) {
  py::class_<PyJobs> jobs(module, "JobQueue", R"(
The ordered jobs of a world: controllers, crowds, and callbacks at the rate of a clock.

A job has a place, which consists of an order and a number: the order is that of its plugin, the
number counts the jobs of the plugin. A run of steps performs the jobs before and after each physics
step in the order of their places. It ends whenever callbacks are to be called, and the next run
continues after them.
)");
  jobs.def("__deepcopy__", &copy_jobs, py::arg("memo"),
           "Returns the jobs of the copied world in `memo`, or these jobs if there is none.");
  bind_callbacks(jobs);
  bind_runs(jobs);
  classes.world.def_property_readonly(
      "jobs", [](const PyWorld& world) { return PyJobs{world}; },
      "What the steps of a `flatland.World` do besides the physics; `step` ignores it.");
  module.def("run_worlds", &run_worlds, py::arg("runs"), py::arg("num_threads"), R"(
Performs steps of several worlds in parallel, without the GIL if that takes long.

Args:
    runs: The physics worlds, which are all different, with their steps.
    num_threads: Maximum number of threads; 0 for one per core.

Returns:
    What `JobQueue.run` returns or raises, for each world.
)");
}

}  // namespace flatland
