#include <pybind11/stl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

Phase phase_of(bool is_after) { return is_after ? Phase::kAfter : Phase::kBefore; }

void bind_tricycle(WorldClass& world) {
  world.def(
      "add_tricycle_controller",
      [](World& self, Id body, Id joint, double steering_sign, double wheelbase,
         const std::pair<double, double>& rear_center, bool takes_twist) {
        if (self.read_joint(joint).joint->GetType() != e_revoluteJoint) {
          throw py::value_error("the joint of the front wheel must be a revolute joint");
        }
        TricycleMotion motion;
        motion.joint = joint;
        motion.steering_sign = steering_sign;
        if (!(wheelbase > 0.0)) throw py::value_error("wheelbase must be positive");
        motion.wheelbase = wheelbase;
        motion.rear_center[0] = rear_center.first;
        motion.rear_center[1] = rear_center.second;
        motion.takes_twist = takes_twist;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("joint"), py::arg("steering_sign"), py::arg("wheelbase"),
      py::arg("rear_center"), py::arg("takes_twist"));
  world.def("set_tricycle_limits",
            [](World& self, Id id, const Limits& linear, const Limits& angular, double max_angle) {
              auto& motion = motion_of<TricycleMotion>(self, id);
              const SpeedLimits checked_linear = to_limits(linear);
              const SpeedLimits checked_angular = to_limits(angular);
              motion.max_angle = checked_limit(max_angle);
              motion.linear = checked_linear;
              motion.angular = checked_angular;
            });
  world.def("set_tricycle_target", [](World& self, Id id, double linear, double angular) {
    motion_of<TricycleMotion>(self, id).target = {linear, 0.0, angular};
  });
  world.def("tricycle_state", [](World& self, Id id) {
    const auto& motion = motion_of<TricycleMotion>(self, id);
    return py::make_tuple(motion.angle, motion.angle_velocity, motion.speed, motion.target_angle);
  });
  world.def("set_tricycle_state", [](World& self, Id id, double angle, double angle_velocity,
                                     double speed, double target_angle) {
    auto& motion = motion_of<TricycleMotion>(self, id);
    motion.angle = angle;
    motion.angle_velocity = angle_velocity;
    motion.speed = speed;
    motion.target_angle = target_angle;
  });
}

TweenMotion::Mode tween_mode(const std::string& name) {
  using Mode = TweenMotion::Mode;
  if (name == "yoyo") return Mode::kYoyo;
  if (name == "loop") return Mode::kLoop;
  if (name == "once") return Mode::kOnce;
  if (name == "trigger") return Mode::kTrigger;
  throw py::value_error("mode must be one of: yoyo, loop, once, trigger, got \"" + name + "\"");
}

void bind_tween(WorldClass& world) {
  world.def(
      "add_tween_controller",
      [](World& self, Id body, const PyTriple& delta, double duration, const std::string& mode,
         const std::string& easing) {
        if (!(duration > 0.0)) throw py::value_error("duration must be positive");
        TweenMotion motion;
        motion.mode = tween_mode(mode);
        motion.easing = easing_of(easing);
        motion.duration = duration;
        motion.start = motion.pose = pose_of(self, body);
        motion.delta = {std::get<0>(delta), std::get<1>(delta), std::get<2>(delta)};
        motion.is_dynamic = self.read_body(body)->GetType() == b2_dynamicBody;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("delta"), py::arg("duration"), py::arg("mode"), py::arg("easing"));
  world.def("set_tween_trigger", [](World& self, Id id, bool is_triggered) {
    motion_of<TweenMotion>(self, id).is_triggered = is_triggered;
  });
  world.def("tween_state", [](World& self, Id id) {
    const auto& motion = motion_of<TweenMotion>(self, id);
    return py::make_tuple(motion.progress, motion.exact_progress, motion.is_forward);
  });
  world.def("hold_controller", [](World& self, Id id) {
    Controller& controller = changed_controller(self, id);
    hold(self, self.change_body(controller.body), controller.motion);
  });
}

void bind_controllers(WorldClass& world) {
  world.def("add_twist_controller", [](World& self, Id body, bool is_holonomic) {
    TwistMotion motion;
    motion.is_holonomic = is_holonomic;
    return add_controller(self, body, motion);
  });
  world.def("set_twist_limits",
            [](World& self, Id id, const Limits& linear, const Limits& angular) {
              auto& motion = motion_of<TwistMotion>(self, id);
              const SpeedLimits checked = to_limits(linear);
              motion.angular = to_limits(angular);
              motion.linear = checked;
            });
  world.def("twist_target",
            [](World& self, Id id) { return to_python(motion_of<TwistMotion>(self, id).target); });
  world.def("set_twist_target",
            [](World& self, Id id, double forward, double sideways, double omega) {
              // A velocity that is out of range is refused when it is applied to the body.
              motion_of<TwistMotion>(self, id).target = {forward, sideways, omega};
            });
  world.def("twist_velocity", [](World& self, Id id) {
    return to_python(motion_of<TwistMotion>(self, id).velocity);
  });
  world.def("set_twist_velocity",
            [](World& self, Id id, double forward, double sideways, double omega) {
              motion_of<TwistMotion>(self, id).velocity = {forward, sideways, omega};
            });
  bind_tricycle(world);
  bind_tween(world);
  bind_motions(world);
  world.def("has_controller",
            [](World& self, Id id) { return self.plan().find_controller(id) != nullptr; });
  world.def("remove_controller", [](World& self, Id id) {
    changed_controller(self, id);
    self.plan().remove_controller(id);
  });
  world.def(
      "schedule_controller",
      [](World& self, Id id, std::int64_t order, bool is_automatic, bool holds) {
        Controller& controller = changed_controller(self, id);
        controller.order = order;
        controller.is_automatic = is_automatic;
        controller.holds = holds && has_hold(controller.motion);
        self.plan().order_changed();
      },
      py::arg("controller"), py::arg("order"), py::arg("is_automatic"), py::arg("holds"));
  world.def("advance_controller", [](World& self, Id id, double dt) {
    self.plan().advance_now(self, changed_controller(self, id), dt);
  });
  world.def("take_failed_controllers", [](World& self) {
    self.check_changeable();
    return self.plan().take_failed();
  });
}

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

py::tuple run_to_python(const RunResult& result) {
  return py::make_tuple(result.steps, static_cast<int>(result.end), to_python(result.report));
}

// Steps are counted in 64 bits with a margin.
std::int64_t checked_step(std::int64_t step) {
  constexpr std::int64_t kMost = std::int64_t{1} << 61;
  if (step < 0 || step > kMost) {
    throw py::value_error("numbers of steps must be from 0 to 2^61, got " + std::to_string(step));
  }
  return step;
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
    return py::make_tuple(run_to_python(result_), times_.waited, times_.total, times_.least,
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
      list.append(errors_[i] ? error_of(errors_[i]) : run_to_python(results_[i]));
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
        return run_to_python(without_gil_if(is_long, use, [&] {
          return self.run(step, n, dt, velocity_iterations, position_iterations, only_physics);
        }));
      },
      py::arg("step"), py::arg("n"), py::arg("dt"), py::arg("velocity_iterations"),
      py::arg("position_iterations"), py::arg("only_physics"));
  world.def("run_paced", &run_paced, py::arg("step"), py::arg("n"), py::arg("dt"),
            py::arg("velocity_iterations"), py::arg("position_iterations"), py::arg("due"),
            py::arg("period"));
  world.def("interrupt", &World::interrupt);
  world.def("clear_interrupt", &World::clear_interrupt);
}

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

}  // namespace

void bind_steps(py::module_& module, WorldClass& world) {
  module.def("ease", [](const std::string& easing, double p) { return easing_of(easing)(p); });
  module.def("easings", &easing_names);
  module.def("run_worlds", &run_worlds, py::arg("runs"), py::arg("num_threads"));
  bind_touches(world);
  bind_controllers(world);
  bind_clocks(world);
  bind_run(world);
}

}  // namespace flatland
