// What the core does in each step besides the physics, and when code of plugins is to be called.
//
// A plan contains controllers and crowds, which move bodies, and records of updates that were due
// but for which no code was called, because the result was not wanted. They are carried out in the
// order of the plugins to which they belong, so that code that is called in between finds the world
// as if each plugin had been called in each step. All of it are values that refer to objects by id.
#pragma once

#include <cstdint>
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

// Before the physics step, at the time of step k, or after it, at that of step k + 1.
enum class Phase : std::uint8_t { kBefore = 0, kAfter = 1 };

// Updates that were due without a call, to be reported to the plugin.
struct Record {
  std::uint32_t clock = 0;
  Id body = 0;             // whose pose is recorded, 0 for none
  Id touches = 0;          // the collector of contacts that each update clears, 0 for none
  std::int64_t order = 0;  // of the plugin
  bool is_enabled = false;
  std::int64_t count = 0;  // of updates since the record was taken
  std::int64_t step = 0;   // of the last one
  Triple pose{};           // of the body at that time
};

// A record as it was taken.
struct SkippedUpdates {
  Id record;
  std::int64_t count;
  std::int64_t step;
  Triple pose;
};

class StepPlan {
 public:
  // Clocks above this number do not fit into the set of due clocks.
  static constexpr std::size_t kMostClocks = 62;
  static constexpr std::int64_t kEnd = INT64_MAX;  // after all plugins

  // Defined where Crowd is complete, so that its headers are not included here.
  StepPlan();
  StepPlan(const StepPlan& other);
  StepPlan(StepPlan&& other) noexcept;
  StepPlan& operator=(const StepPlan& other);
  StepPlan& operator=(StepPlan&& other) noexcept;
  ~StepPlan();

  bool empty() const {
    return clocks_.empty() && controllers_.size() == 0 && records_.size() == 0 &&
           crowds_.size() == 0;
  }

  // Throws std::invalid_argument if there are kMostClocks clocks already.
  std::uint32_t add_clock(Phase phase, const RateClock& clock);
  // Whether code is to be called in steps in which a clock is due. Throws std::invalid_argument for
  // an unknown clock.
  void set_calls(std::uint32_t clock, bool has_calls);

  Id add_controller(const Controller& controller);
  // Null if it does not exist.
  Controller* find_controller(Id id) { return controllers_.find(id); }
  void remove_controller(Id id);
  // Removes the controllers of a body that was destroyed.
  void remove_body(Id body);
  // To be called after a change of the order of a controller or of whether it is automatic.
  void order_changed() { is_sorted_ = false; }

  Id add_crowd(const crowd::Settings& settings);
  // Null if it does not exist.
  crowd::Crowd* find_crowd(Id id);
  void remove_crowd(Id id);

  // Throws std::invalid_argument for an unknown clock.
  Id add_record(const Record& record);
  Record* find_record(Id id) { return records_.find(id); }
  void remove_record(Id id);
  // Returns the records of updates since the last call, and resets them.
  std::vector<SkippedUpdates> take_skipped();

  // Returns the set of clocks, as bits, that are due in step k and for which code is to be called.
  std::uint64_t calls_due(std::int64_t k);
  // Starts step k; to be called after `calls_due`.
  void begin(std::int64_t k);
  // Carries out what precedes the plugin with some order and was not carried out in this step yet.
  void carry_out(World& world, Phase phase, std::int64_t until, double dt);
  // Whether a controller has failed since the last call of `take_failed`.
  bool has_failed() const { return !failed_.empty(); }
  // Returns the controllers that failed to move their body: the numbers were out of range. They
  // have not advanced.
  std::vector<Id> take_failed();
  // Advances a controller now, and not again in this step.
  void advance_now(World& world, Controller& controller, double dt);
  // Carries out a crowd now, and not again in this step.
  void advance_now(World& world, crowd::Crowd& crowd, double dt);

  // Removes everything.
  void clear();
  // Removes all controllers and records, but no clocks.
  void remove_all();
  // Excludes the ids that another plan has returned, see SlotMap.
  void exclude_ids_of(const StepPlan& other);

 private:
  enum class Kind : std::uint8_t { kAdvance, kHold, kCrowd, kRecord };
  struct Action {
    std::int64_t order;
    Kind kind;
    Id id;
  };

  void sort();
  void carry_out_one(World& world, const Action& action, double dt);
  void make_record(World& world, Record& record);

  std::vector<RateClock> clocks_;
  std::uint64_t after_clocks_ = 0;  // the clocks of the phase kAfter, as bits
  std::uint64_t called_clocks_ = 0;
  SlotMap<Controller, IdKind::kController> controllers_;
  SlotMap<Record, IdKind::kRecord> records_;
  SlotMap<crowd::Crowd, IdKind::kCrowd> crowds_;

  bool is_sorted_ = true;
  std::vector<Action> actions_[2];  // by phase
  std::size_t next_[2] = {0, 0};
  std::uint64_t number_ = 0;  // of steps begun
  std::int64_t step_ = 0;     // the current one, counted from time 0
  std::vector<Id> failed_;
};

}  // namespace flatland
