#include "world/step_plan.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "world/bodies.h"
#include "world/world.h"

namespace flatland {
namespace {

constexpr std::uint64_t bit(std::size_t clock) { return std::uint64_t{1} << clock; }

}  // namespace

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
    if (!controller.is_automatic) return;
    actions_[0].push_back({controller.order, Kind::kAdvance, id});
  });
  records_.for_each([&](Id id, const Record& record) {
    const std::size_t phase = (after_clocks_ & bit(record.clock)) != 0 ? 1 : 0;
    actions_[phase].push_back({record.order, Kind::kRecord, id});
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
    if (record == nullptr || !record->is_enabled || !clocks_[record->clock].is_due()) return;
    ++record->count;
    record->step = (after_clocks_ & bit(record->clock)) != 0 ? step_ + 1 : step_;
    if (record->touches != 0) {
      TouchCollector* touches = world.contacts().touches.find(record->touches);
      if (touches != nullptr) touches->was_touched = false;
    }
    if (record->body == 0) return;
    const b2Body* body = world.find_body(record->body);
    if (body != nullptr) record->pose = pose_of(*body);
    return;
  }
  Controller* controller = controllers_.find(action.id);
  if (controller == nullptr || !controller->is_automatic || controller->last_step == number_) {
    return;
  }
  controller->last_step = number_;
  b2Body* body = world.find_body(controller->body);
  if (body == nullptr) return;
  const Motion before = controller->motion;
  try {
    advance(world, body, controller->motion, dt);
  } catch (const std::invalid_argument&) {
    controller->motion = before;
    failed_.push_back(action.id);
  }
}

std::vector<Id> StepPlan::take_failed() { return std::exchange(failed_, {}); }

void StepPlan::advance_now(World& world, Controller& controller, double dt) {
  controller.last_step = number_;
  advance(world, world.change_body(controller.body), controller.motion, dt);
}

void StepPlan::clear() { *this = StepPlan(); }

}  // namespace flatland
