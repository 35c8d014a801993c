#include "world/job_queue.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "crowd/crowd.h"
#include "world/bodies.h"
#include "world/world.h"

namespace flatland {
namespace {

constexpr std::size_t index_of(Phase phase) { return static_cast<std::size_t>(phase); }

}  // namespace

JobQueue::JobQueue() = default;
JobQueue::JobQueue(const JobQueue& other) = default;
JobQueue::JobQueue(JobQueue&& other) noexcept = default;
JobQueue& JobQueue::operator=(const JobQueue& other) = default;
JobQueue& JobQueue::operator=(JobQueue&& other) noexcept = default;
JobQueue::~JobQueue() = default;

Id JobQueue::add_controller(const Controller& controller) {
  is_sorted_ = false;
  return controllers_.insert(controller);
}

void JobQueue::remove_controller(Id id) {
  controllers_.erase(id);
  is_sorted_ = false;
}

void JobQueue::remove_body(Id body) {
  std::vector<Id> removed;
  controllers_.for_each([&](Id id, const Controller& controller) {
    if (controller.body == body) removed.push_back(id);
  });
  for (const Id id : removed) remove_controller(id);
  crowds_.for_each([&](Id, crowd::Crowd& crowd) { crowd.remove_person(body); });
}

crowd::Crowd* JobQueue::find_crowd(Id id) { return crowds_.find(id); }

Id JobQueue::add_crowd(const crowd::Settings& settings) {
  is_sorted_ = false;
  return crowds_.insert(crowd::Crowd(settings));
}

void JobQueue::remove_crowd(Id id) {
  crowds_.erase(id);
  is_sorted_ = false;
}

std::uint32_t JobQueue::use_clock(Phase phase, const RateClock& clock) {
  auto found = std::find_if(clocks_.begin(), clocks_.end(), [&](const SharedClock& shared) {
    return shared.users > 0 && shared.phase == phase && shared.clock == clock;
  });
  if (found == clocks_.end()) {
    found = std::find_if(clocks_.begin(), clocks_.end(),
                         [](const SharedClock& shared) { return shared.users == 0; });
    if (found == clocks_.end()) found = clocks_.insert(found, SharedClock{});
    *found = {clock, phase, 0, 0};
  }
  ++found->users;
  return static_cast<std::uint32_t>(found - clocks_.begin());
}

Id JobQueue::add_callback(Callback callback, const RateClock& clock) {
  is_sorted_ = false;
  callback.clock = use_clock(callback.phase, clock);
  const bool is_called = std::exchange(callback.is_called, false);
  const Id id = callbacks_.insert(std::move(callback));
  set_called(*callbacks_.find(id), is_called);
  return id;
}

void JobQueue::remove_callback(Id id) {
  Callback* callback = callbacks_.find(id);
  if (callback == nullptr) return;
  set_called(*callback, false);
  --clocks_[callback->clock].users;
  callbacks_.erase(id);
  is_sorted_ = false;
}

void JobQueue::set_called(Callback& callback, bool is_called) {
  if (callback.is_called == is_called) return;
  callback.is_called = is_called;
  std::uint32_t& called = clocks_[callback.clock].called;
  called = is_called ? called + 1 : called - 1;
  if (callback.is_at_touches) called_at_touches_ += is_called ? 1 : -1;
}

std::vector<SkippedUpdates> JobQueue::take_skipped() {
  std::vector<SkippedUpdates> skipped;
  callbacks_.for_each([&](Id id, Callback& callback) {
    if (callback.skipped == 0) return;
    skipped.push_back({id, std::exchange(callback.skipped, 0), callback.stamp, callback.poses});
  });
  return skipped;
}

void JobQueue::move_clock(SharedClock& shared) const {
  shared.clock.move_to(shared.phase == Phase::kAfter ? time_ + step_ : time_, step_);
}

void JobQueue::begin(std::int64_t time, std::int64_t step) {
  if (!is_sorted_) sort();
  time_ = time;
  step_ = step;
  next_ = {0, 0};
  may_call_ = {false, called_at_touches_ > 0};
  for (SharedClock& shared : clocks_) {
    if (shared.users == 0) continue;
    move_clock(shared);
    if (shared.clock.is_due()) may_call_[index_of(shared.phase)] = true;
  }
}

bool JobQueue::calls_at(std::int64_t time, std::int64_t step) {
  time_ = time;
  step_ = step;
  return std::any_of(clocks_.begin(), clocks_.end(), [this](SharedClock& shared) {
    if (shared.called == 0) return false;
    move_clock(shared);
    return shared.clock.is_due();
  });
}

void JobQueue::sort() {
  for (auto& jobs : jobs_) jobs.clear();
  std::vector<Job>& before = jobs_[index_of(Phase::kBefore)];
  std::vector<Job>& after = jobs_[index_of(Phase::kAfter)];
  controllers_.for_each([&](Id id, const Controller& controller) {
    before.push_back({controller.place, Kind::kController, id});
    if (has_hold(controller.motion)) after.push_back({controller.place, Kind::kController, id});
  });
  crowds_.for_each([&](Id id, const crowd::Crowd& crowd) {
    before.push_back({crowd.place, Kind::kCrowd, id});
  });
  callbacks_.for_each([&](Id id, const Callback& callback) {
    jobs_[index_of(callback.phase)].push_back({callback.place, Kind::kCallback, id});
  });
  for (std::size_t phase = 0; phase < jobs_.size(); ++phase) {
    std::vector<Job>& jobs = jobs_[phase];
    std::sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) {
      return std::tie(a.place, a.kind, a.id) < std::tie(b.place, b.kind, b.id);
    });
    work_[phase].clear();
    std::copy_if(jobs.begin(), jobs.end(), std::back_inserter(work_[phase]),
                 [](const Job& job) { return job.kind != Kind::kCallback; });
  }
  is_sorted_ = true;
}

const std::vector<JobQueue::Job>& JobQueue::jobs_of(Phase phase) const {
  return may_call_[index_of(phase)] ? jobs_[index_of(phase)] : work_[index_of(phase)];
}

bool JobQueue::is_complete(Phase phase) const {
  return next_[index_of(phase)] >= jobs_of(phase).size();
}

std::vector<Id> JobQueue::carry_out(World& world, Phase phase, double dt) {
  const std::vector<Job>& jobs = jobs_of(phase);
  std::vector<Id> calls;
  std::uint32_t group = 0;  // of all callbacks in `calls`, 0 if they have none in common
  bool has_worked = false;  // whether a job was carried out since the first of them
  for (std::size_t& next = next_[index_of(phase)]; next < jobs.size(); ++next) {
    const Job& job = jobs[next];
    if (job.kind == Kind::kCallback) {
      Callback* callback = callbacks_.find(job.id);
      if (callback == nullptr || !is_due(world, *callback)) continue;
      if (callback->is_called) {
        if (has_worked && callback->group != group) break;
        group = calls.empty() || callback->group == group ? callback->group : 0;
        calls.push_back(job.id);
        continue;
      }
      if (!callback->is_counted) continue;
    }
    if (!calls.empty()) {
      if (group == 0 || !keeps_poses(job)) break;
      has_worked = true;
    }
    carry_out_one(world, phase, job, dt);
  }
  return calls;
}

bool JobQueue::keeps_poses(const Job& job) {
  if (job.kind == Kind::kCallback) return true;
  if (job.kind == Kind::kCrowd) return false;
  const Controller* controller = controllers_.find(job.id);
  return controller == nullptr || !has_hold(controller->motion);
}

bool JobQueue::is_due(World& world, const Callback& callback) const {
  if (clocks_[callback.clock].clock.is_due()) return true;
  if (!callback.is_at_touches || !callback.is_called) return false;
  const TouchCollector* touches = world.contacts().touches.find(callback.touches);
  return touches != nullptr && !touches->touches.empty();
}

void JobQueue::carry_out_one(World& world, Phase phase, const Job& job, double dt) {
  switch (job.kind) {
    case Kind::kController:
      control(world, phase, job.id, dt);
      break;
    case Kind::kCrowd:
      if (crowd::Crowd* crowd = crowds_.find(job.id)) crowd->advance(world, time_ / step_, dt);
      break;
    case Kind::kCallback:
      count(world, *callbacks_.find(job.id));
      break;
  }
}

void JobQueue::control(World& world, Phase phase, Id id, double dt) {
  Controller* controller = controllers_.find(id);
  b2Body* body = controller == nullptr ? nullptr : world.find_body(controller->body);
  if (body == nullptr) return;
  if (phase == Phase::kAfter) {
    try {
      hold(world, body, controller->motion);
    } catch (const std::invalid_argument& error) {
      failed_.push_back({id, error.what()});
    }
    return;
  }
  age_command(*controller, step_);
  const Motion before = controller->motion;
  try {
    advance(world, body, controller->motion, dt);
  } catch (const std::invalid_argument& error) {
    controller->motion = before;
    failed_.push_back({id, error.what()});
  }
}

void JobQueue::count(World& world, Callback& callback) const {
  ++callback.skipped;
  callback.stamp = callback.phase == Phase::kAfter ? time_ + step_ : time_;
  if (callback.touches != 0) {
    TouchCollector* touches = world.contacts().touches.find(callback.touches);
    if (touches != nullptr) touches->was_touched = false;
  }
  callback.poses.resize(callback.bodies.size());
  for (std::size_t i = 0; i < callback.bodies.size(); ++i) {
    const b2Body* body = world.find_body(callback.bodies[i]);
    if (body != nullptr) callback.poses[i] = pose_of(*body);
  }
}

std::vector<FailedJob> JobQueue::take_failed() { return std::exchange(failed_, {}); }

void JobQueue::prefetch() const {
  controllers_.prefetch();
  callbacks_.prefetch();
  flatland::prefetch(clocks_);
}

void JobQueue::clear() {
  JobQueue empty;
  empty.exclude_ids_of(*this);
  *this = std::move(empty);
}

void JobQueue::exclude_ids_of(const JobQueue& other) {
  controllers_.exclude_ids_of(other.controllers_);
  crowds_.exclude_ids_of(other.crowds_);
  callbacks_.exclude_ids_of(other.callbacks_);
}

}  // namespace flatland
