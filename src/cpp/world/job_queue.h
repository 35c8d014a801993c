// The jobs of a world: everything that happens in a step besides the physics.
//
// The queue is one ordered list. Each job belongs to a phase, before or after the physics step, and
// has a place: the order of its plugin, and its number among the jobs of that plugin. There are
// two kinds:
//   - controllers and crowds, which move bodies in every step;
//   - callbacks, which run code outside of the core when an update at their rate is due. A callback
//     whose result is not wanted is not called; the queue then counts the update, and records what
//     the plugin needs to account for it later.
//
// `carry_out` performs the jobs of a phase in order. It returns at each callback that is to be
// called and continues after that callback, so that the code of the callback finds the world as if
// each job had been called in its turn. Jobs are values that refer to objects by id, so that a copy
// of a world contains a copy of its queue.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "world/controllers.h"
#include "world/rate_clock.h"
#include "world/slot_map.h"
#include "world/triple.h"

namespace flatland {

class World;

namespace crowd {
class Crowd;
struct Settings;
}  // namespace crowd

// Before the physics step, at time t, or after it, at time t + dt.
enum class Phase : std::uint8_t { kBefore = 0, kAfter = 1 };

// A function outside of the core that is called when an update is due.
struct Callback {
  Phase phase = Phase::kBefore;
  JobPlace place;
  std::uint32_t clock = 0;  // see JobQueue::add_callback
  // Successive callbacks of a group are called together, also if controllers that only set
  // velocities are between them; 0 for no group.
  std::uint32_t group = 0;
  bool is_called = true;  // otherwise, due updates are counted if `is_counted` is set
  bool is_counted = false;
  Id touches = 0;              // collector of contacts that each counted update clears, 0 for none
  bool is_at_touches = false;  // whether to call it also in steps in which `touches` has contacts
  std::vector<Id> bodies;      // whose poses are recorded at each counted update

  std::int64_t skipped = 0;   // updates that were counted since they were taken
  std::int64_t stamp = 0;     // time of the last one [ns]
  std::vector<Triple> poses;  // of the bodies at that time
};

// The updates of a callback that were due without a call.
struct SkippedUpdates {
  Id callback;
  std::int64_t count;
  std::int64_t stamp;  // of the last one [ns]
  std::vector<Triple> poses;
};

// A controller that could not move its body, because a number was out of range.
struct FailedJob {
  Id controller;
  std::string error;
};

class JobQueue {
 public:
  // Defined where Crowd is complete, so that its headers are not included here.
  JobQueue();
  JobQueue(const JobQueue& other);
  JobQueue(JobQueue&& other) noexcept;
  JobQueue& operator=(const JobQueue& other);
  JobQueue& operator=(JobQueue&& other) noexcept;
  ~JobQueue();

  // Adding, and removing. A job that is added during a step is carried out from the next step on.
  Id add_controller(const Controller& controller);
  // Null if it does not exist.
  Controller* find_controller(Id id) { return controllers_.find(id); }
  void remove_controller(Id id);
  // Removes the controllers of a body that was destroyed, and the person with this body.
  void remove_body(Id body);
  Id add_crowd(const crowd::Settings& settings);
  // Null if it does not exist.
  crowd::Crowd* find_crowd(Id id);
  void remove_crowd(Id id);
  // To be called after a change of the place of a controller or a crowd.
  void place_changed() { is_sorted_ = false; }

  // Adds a callback whose updates are due at the rate of a clock. Callbacks with equal clocks share
  // one, which exists as long as one of them does.
  Id add_callback(Callback callback, const RateClock& clock);
  // Null if it does not exist.
  Callback* find_callback(Id id) { return callbacks_.find(id); }
  void remove_callback(Id id);
  void set_called(Callback& callback, bool is_called);
  // Returns the updates that were counted since the last call, and resets the counts.
  std::vector<SkippedUpdates> take_skipped();

  // Begins a step at a time; both in nanoseconds.
  void begin(std::int64_t time, std::int64_t step);
  // Carries out the jobs of a phase from the current one on, up to the callbacks that are to be
  // called next. Returns these in order, none at the end of the phase.
  std::vector<Id> carry_out(World& world, Phase phase, double dt);
  // Whether all jobs of a phase were carried out in this step.
  bool is_complete(Phase phase) const;
  // Returns the controllers that have failed since the last call. They have not advanced.
  std::vector<FailedJob> take_failed();
  // Whether any update for which code is called is due in the step at a time.
  bool calls_at(std::int64_t time, std::int64_t step);
  // Whether code may be called in steps in which no update is due, because of contacts.
  bool calls_at_touches() const { return called_at_touches_ > 0; }

  // Removes all jobs.
  void clear();
  // Begins to load what a step needs into the cache.
  void prefetch() const;
  // Excludes the ids that another queue has returned, see SlotMap.
  void exclude_ids_of(const JobQueue& other);

 private:
  enum class Kind : std::uint8_t { kController, kCrowd, kCallback };
  struct Job {
    JobPlace place;
    Kind kind;
    Id id;
  };
  struct SharedClock {
    RateClock clock{0, 1};
    Phase phase = Phase::kBefore;
    std::uint32_t users = 0;   // callbacks, 0 for an unused clock
    std::uint32_t called = 0;  // those of them that are called
  };

  // The jobs of a phase in the current step; without callbacks if none can be due.
  const std::vector<Job>& jobs_of(Phase phase) const;
  std::uint32_t use_clock(Phase phase, const RateClock& clock);
  void move_clock(SharedClock& shared) const;
  void sort();
  bool is_due(World& world, const Callback& callback) const;
  void count(World& world, Callback& callback) const;
  void carry_out_one(World& world, Phase phase, const Job& job, double dt);
  void control(World& world, Phase phase, Id id, double dt);
  // Whether a job changes nothing that callbacks of a group depend on.
  bool keeps_poses(const Job& job);

  SlotMap<Controller, IdKind::kController> controllers_;
  SlotMap<crowd::Crowd, IdKind::kCrowd> crowds_;
  SlotMap<Callback, IdKind::kCallback> callbacks_;
  std::vector<SharedClock> clocks_;
  std::int64_t called_at_touches_ = 0;  // callbacks

  bool is_sorted_ = true;
  std::array<std::vector<Job>, 2> work_;         // by phase, without callbacks
  std::array<bool, 2> may_call_ = {true, true};  // by phase, whether any callback may be due
  std::array<std::vector<Job>, 2> jobs_;         // by phase
  std::array<std::size_t, 2> next_ = {0, 0};     // by phase, in the current step
  std::int64_t time_ = 0;                        // of the current step [ns]
  std::int64_t step_ = 1;                        // duration of the current step [ns]
  std::vector<FailedJob> failed_;
};

}  // namespace flatland
