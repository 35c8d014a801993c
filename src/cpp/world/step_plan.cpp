#include "world/step_plan.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "crowd/crowd.h"
#include "world/bodies.h"
#include "world/world.h"

namespace flatland {
namespace {

constexpr std::uint64_t bit(std::size_t clock) { return std::uint64_t{1} << clock; }

}  // namespace

StepPlan::StepPlan() = default;
StepPlan::StepPlan(const StepPlan& other) = default;
StepPlan::StepPlan(StepPlan&& other) noexcept = default;
StepPlan& StepPlan::operator=(const StepPlan& other) = default;
StepPlan& StepPlan::operator=(StepPlan&& other) noexcept = default;
StepPlan::~StepPlan() = default;

std::uint32_t StepPlan::add_clock(Phase phase, const RateClock& clock) {
  if (clocks_.size() >= kMostClocks) throw std::invalid_argument("there are too many clocks");
  const auto index = static_cast<std::uint32_t>(clocks_.size());
  clocks_.push_back(clock);
  if (phase == Phase::kAfter) after_clocks_ |= bit(index);
  return index;
}

void StepPlan::set_calls(std::uint32_t clock, bool has_calls) {
  if (clock >= clocks_.size()) throw std::invalid_argument("the clock does not exist");
  called_clocks_ = has_calls ? called_clocks_ | bit(clock) : called_clocks_ & ~bit(clock);
}

Id StepPlan::add_controller(const Controller& controller) {
  is_sorted_ = false;
  return controllers_.insert(controller);
}

void StepPlan::remove_controller(Id id) {
  controllers_.erase(id);
  is_sorted_ = false;
}

void StepPlan::remove_body(Id body) {
  std::vector<Id> removed;
  controllers_.for_each([&](Id id, const Controller& controller) {
    if (controller.body == body) removed.push_back(id);
  });
  for (const Id id : removed) remove_controller(id);
}

crowd::Crowd* StepPlan::find_crowd(Id id) { return crowds_.find(id); }

Id StepPlan::add_crowd(const crowd::Settings& settings) {
  is_sorted_ = false;
  return crowds_.insert(crowd::Crowd(settings));
}

void StepPlan::remove_crowd(Id id) {
  crowds_.erase(id);
  is_sorted_ = false;
}

Id StepPlan::add_record(const Record& record) {
  if (record.clock >= clocks_.size()) throw std::invalid_argument("the clock does not exist");
  is_sorted_ = false;
  return records_.insert(record);
}

void StepPlan::remove_record(Id id) {
  records_.erase(id);
  is_sorted_ = false;
}

std::vector<SkippedUpdates> StepPlan::take_skipped() {
  std::vector<SkippedUpdates> skipped;
  records_.for_each([&](Id id, Record& record) {
    if (record.count == 0) return;
    skipped.push_back({id, record.count, record.step, record.pose});
    record.count = 0;
  });
  return skipped;
}

std::uint64_t StepPlan::calls_due(std::int64_t k) {
  std::uint64_t due = 0;
  for (std::size_t i = 0; i < clocks_.size(); ++i) {
    clocks_[i].move_to((after_clocks_ & bit(i)) != 0 ? k + 1 : k);
    if (clocks_[i].is_due()) due |= bit(i);
  }
  return due & called_clocks_;
}

void StepPlan::begin(std::int64_t k) {
  if (!is_sorted_) sort();
  ++number_;
  step_ = k;
  next_[0] = next_[1] = 0;
}

void StepPlan::sort() {
  for (auto& actions : actions_) actions.clear();
  controllers_.for_each([&](Id id, const Controller& controller) {
    if (controller.is_automatic) actions_[0].push_back({controller.order, Kind::kAdvance, id});
    if (controller.holds) actions_[1].push_back({controller.order, Kind::kHold, id});
  });
  records_.for_each([&](Id id, const Record& record) {
    const std::size_t phase = (after_clocks_ & bit(record.clock)) != 0 ? 1 : 0;
    actions_[phase].push_back({record.order, Kind::kRecord, id});
  });
  crowds_.for_each([&](Id id, const crowd::Crowd& crowd) {
    if (crowd.is_automatic) actions_[0].push_back({crowd.order, Kind::kCrowd, id});
  });
  for (auto& actions : actions_) {
    std::sort(actions.begin(), actions.end(), [](const Action& a, const Action& b) {
      return std::tie(a.order, a.kind, a.id) < std::tie(b.order, b.kind, b.id);
    });
  }
  is_sorted_ = true;
}

void StepPlan::carry_out(World& world, Phase phase, std::int64_t until, double dt) {
  const auto which = static_cast<std::size_t>(phase);
  const std::vector<Action>& actions = actions_[which];
  std::size_t& next = next_[which];
  while (next < actions.size() && actions[next].order < until) {
    carry_out_one(world, actions[next++], dt);
  }
}

void StepPlan::carry_out_one(World& world, const Action& action, double dt) {
  if (action.kind == Kind::kRecord) {
    Record* record = records_.find(action.id);
    if (record != nullptr) make_record(world, *record);
    return;
  }
  if (action.kind == Kind::kCrowd) {
    crowd::Crowd* crowd = crowds_.find(action.id);
    if (crowd != nullptr && crowd->is_automatic && crowd->last_step != number_) {
      advance_now(world, *crowd, dt);
    }
    return;
  }
  Controller* controller = controllers_.find(action.id);
  b2Body* body = controller == nullptr ? nullptr : world.find_body(controller->body);
  if (body == nullptr) return;
  if (action.kind == Kind::kHold) {
    try {
      if (controller->holds) hold(world, body, controller->motion);
    } catch (const std::invalid_argument&) {
      failed_.push_back(action.id);
    }
    return;
  }
  if (!controller->is_automatic || controller->last_step == number_) return;
  controller->last_step = number_;
  const Motion before = controller->motion;
  try {
    advance(world, body, controller->motion, dt);
  } catch (const std::invalid_argument&) {
    controller->motion = before;
    failed_.push_back(action.id);
  }
}

void StepPlan::make_record(World& world, Record& record) {
  if (!record.is_enabled || !clocks_[record.clock].is_due()) return;
  ++record.count;
  record.step = (after_clocks_ & bit(record.clock)) != 0 ? step_ + 1 : step_;
  if (record.touches != 0) {
    TouchCollector* touches = world.contacts().touches.find(record.touches);
    if (touches != nullptr) touches->was_touched = false;
  }
  const b2Body* body = record.body == 0 ? nullptr : world.find_body(record.body);
  if (body != nullptr) record.pose = pose_of(*body);
}

std::vector<Id> StepPlan::take_failed() { return std::exchange(failed_, {}); }

void StepPlan::advance_now(World& world, Controller& controller, double dt) {
  controller.last_step = number_;
  advance(world, world.change_body(controller.body), controller.motion, dt);
}

void StepPlan::advance_now(World& world, crowd::Crowd& crowd, double dt) {
  crowd.last_step = number_;
  crowd.advance(world, step_, dt);
}

void StepPlan::remove_all() {
  StepPlan emptied = *this;
  emptied.controllers_.clear();
  emptied.records_.clear();
  emptied.crowds_.clear();
  emptied.exclude_ids_of(*this);
  emptied.failed_.clear();
  emptied.is_sorted_ = false;
  *this = std::move(emptied);
}

void StepPlan::exclude_ids_of(const StepPlan& other) {
  controllers_.exclude_ids_of(other.controllers_);
  records_.exclude_ids_of(other.records_);
  crowds_.exclude_ids_of(other.crowds_);
}

void StepPlan::clear() { *this = StepPlan(); }

}  // namespace flatland
