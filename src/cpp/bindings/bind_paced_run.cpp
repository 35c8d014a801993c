#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bindings/bindings.h"
#include "bindings/runs.h"

namespace py = pybind11;

namespace flatland {
namespace {

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

// Steps at the times at which they are due. Steps that nothing could observe before a later one are
// performed together with that one, since it costs more to wake up than to step.
class PacedRun {
 public:
  PacedRun(World& world, std::int64_t step, double dt, int velocity_iterations,
           int position_iterations, double due, double period)
      : world_(world),
        step_(step),
        dt_(dt),
        velocity_iterations_(velocity_iterations),
        position_iterations_(position_iterations),
        due_(due),
        period_(period) {}

  // Performs up to n steps, the first one at once, as World::run. Between two steps it waits
  // without the GIL and without a use of the world. Ends before a wait if a step was late, or after
  // the time limit, and with an interrupt.
  void run(std::int64_t n) {
    const double start = now();
    std::int64_t count = 1;
    while (n > 0) {
      if (!perform(count)) return;
      result_.end = RunResult::End::kDone;
      const double end = now();
      n -= count;
      if (n == 0) return;
      result_.end = RunResult::End::kStopped;
      count = std::min(n, countable(start + kLongest));
      if (end > due_ || count == 0) return;
      const bool is_due = wait(due_ + static_cast<double>(count - 1) * period_);
      times_.waited += now() - end;
      if (!is_due) {
        catch_up(count);
        return;
      }
    }
  }

  py::tuple to_python() const {
    return py::make_tuple(flatland::to_python(result_), times_.waited, times_.total, times_.least,
                          times_.most);
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;

  // Signals are handled, and the time is read by other threads, after a run [s].
  static constexpr double kLongest = 0.025;
  // Steps are performed together if one of them takes at most this part of the period.
  static constexpr double kShort = 0.01;

  static double now() { return Seconds(Clock::now().time_since_epoch()).count(); }

  // Performs steps that are due. Returns whether the run goes on.
  bool perform(std::int64_t count) {
    const double begin = now();
    RunResult part;
    try {
      World::ExclusiveUse use(world_, World::kStepping);
      const bool is_long = world_.last_step_time() * static_cast<double>(count) > kShortStep;
      part = without_gil_if(is_long, use, [&] {
        return world_.run(step_, count, dt_, velocity_iterations_, position_iterations_, false);
      });
    } catch (const std::exception&) {
      // The steps so far must be accounted for. The next run throws again, if the reason remains.
      if (result_.steps == 0) throw;
      return false;
    }
    step_ += part.steps;
    due_ += static_cast<double>(part.steps) * period_;
    part.steps += result_.steps;
    result_ = part;
    if (part.end != RunResult::End::kDone) return false;
    times_.add(now() - begin, count);
    return true;
  }

  // How many of the next steps can be performed when the last one of them is due, not later than
  // the limit: several if no code is called in them, and contacts are not waited for.
  std::int64_t countable(double limit) {
    std::int64_t count = 0;
    const bool is_observed = world_.contacts().is_recording() ||
                             world_.contacts().touches.can_end_run() ||
                             world_.last_step_time() > kShort * period_;
    StepPlan& plan = world_.plan();
    while (due_ + static_cast<double>(count) * period_ <= limit) {
      const bool calls = plan.calls_due(step_ + count) != 0;
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
    if (perform(std::min(count, static_cast<std::int64_t>(late / period_) + 1))) {
      result_.end = RunResult::End::kStopped;
    }
    world_.interrupt();
  }

  World& world_;
  std::int64_t step_;  // number of the next step
  double dt_;
  int velocity_iterations_, position_iterations_;
  double due_;  // when the next step is due [s]
  double period_;
  RunResult result_;
  WorkTimes times_;
};

py::tuple run_paced(World& world, std::int64_t step, std::int64_t n, double dt,
                    int velocity_iterations, int position_iterations, double due, double period) {
  checked_step(step);
  checked_step(n);
  if (!std::isfinite(due) || !(period > 0.0)) {
    throw py::value_error("due must be finite and the period positive");
  }
  PacedRun run(world, step, dt, velocity_iterations, position_iterations, due, period);
  run.run(n);
  return run.to_python();
}

}  // namespace

void bind_paced_run(WorldClass& world) {
  world.def("run_paced", &run_paced, py::arg("step"), py::arg("n"), py::arg("dt"),
            py::arg("velocity_iterations"), py::arg("position_iterations"), py::arg("due"),
            py::arg("period"));
  world.def("interrupt", &World::interrupt);
  world.def("clear_interrupt", &World::clear_interrupt);
}

}  // namespace flatland
