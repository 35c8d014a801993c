#include "agents/agent_batch.h"

#include <algorithm>
#include <optional>

#include "rays/scene_view.h"
#include "world/bodies.h"
#include "world/controllers.h"
#include "world/errors.h"

namespace flatland {
AgentBatch::AgentBatch(std::vector<Agent> agents)
    : agents_(std::move(agents)), permitted_(agents_.size(), kNever) {}

void AgentBatch::replace(std::size_t i, Agent agent) {
  agents_[i] = std::move(agent);
  withdraw(i);
}

void AgentBatch::permit(std::size_t i) { permitted_[i] = agents_[i].world->clear_interrupt(); }

std::vector<std::size_t> AgentBatch::not_permitted(const bool* acts) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < agents_.size(); ++i) {
    if (acts[i] && permitted_[i] != agents_[i].world->interrupts()) found.push_back(i);
  }
  return found;
}

AgentBatch::Team AgentBatch::team_at(std::size_t i) const {
  Team team{i, i + 1};
  while (team.end < agents_.size() && agents_[team.end].world == agents_[i].world) ++team.end;
  return team;
}

bool AgentBatch::is_acting(const Team& team, const AgentCommands& commands) {
  return std::any_of(commands.acts + team.begin, commands.acts + team.end,
                     [](bool acts) { return acts; });
}

bool AgentBatch::takes_longer(double seconds, const AgentCommands& commands, const Run& run) {
  double expected = 0.0;
  for (std::size_t i = 0; i < agents_.size() && expected <= seconds;) {
    const Team team = team_at(i);
    Run own = run;
    own.time = agents_[i].world->time();
    if (is_acting(team, commands)) expected += agents_[i].world->expected_time(own);
    i = team.end;
  }
  return expected > seconds;
}

void AgentBatch::start(const AgentCommands& commands, const Run& run, const AgentObservations& rows,
                       std::size_t num_threads) {
  commands_ = commands;
  run_ = run;
  rows_ = rows;
  chosen_.clear();
  for (std::size_t i = 0; i < agents_.size();) {
    const Team team = team_at(i);
    while (i < team.end && !is_chosen(i)) ++i;
    if (i < team.end) chosen_.push_back(team);
    i = team.end;
  }
  unfinished_.assign(chosen_.size(), std::nullopt);
  work_ = threads_.start(chosen_.size(), num_threads, [this](std::size_t k) { perform(k); });
}

std::vector<UnfinishedRun> AgentBatch::finish() {
  const std::unique_ptr<ThreadPool::Work> work = std::move(work_);
  work->finish();
  std::vector<UnfinishedRun> found;
  for (auto& each : unfinished_) {
    if (each) found.push_back(std::move(*each));
  }
  return found;
}

void AgentBatch::prefetch_after(std::size_t k) const {
  // With two threads, the team after the next one is usually the next one of this thread.
  constexpr std::size_t kNext = 2;
  for (int stage = 0; stage < World::kPrefetchStages; ++stage) {
    const std::size_t later =
        k + kNext + static_cast<std::size_t>(World::kPrefetchStages - 1 - stage);
    if (later < chosen_.size()) agents_[chosen_[later].begin].world->prefetch(stage);
  }
}

void AgentBatch::perform(std::size_t k) {
  const Team team = chosen_[k];
  prefetch_after(k);
  try {
    if (is_acting(team, commands_) && !step(team, unfinished_[k])) return;
    for (std::size_t i = team.begin; i < team.end; ++i) {
      if (commands_.observes[i]) observe(i);
    }
  } catch (const std::exception&) {
    unfinished_[k] = UnfinishedRun{team.begin, {}, std::current_exception()};
  }
}

bool AgentBatch::step(const Team& team, std::optional<UnfinishedRun>& unfinished) {
  World& world = *agents_[team.begin].world;
  for (std::size_t i = team.begin; i < team.end; ++i) {
    if (commands_.acts[i]) set_command(agents_[i], commands_.velocities + 3 * i);
  }
  Run own = run_;
  own.time = world.time();
  RunResult result = world.run(own);
  if (result.steps < own.n) {
    unfinished = UnfinishedRun{team.begin, std::move(result), nullptr};
    return false;
  }
  world.set_time(own.time + own.n * own.step);
  return true;
}

void AgentBatch::set_command(const Agent& agent, const double* velocity) {
  Controller* controller = agent.world->jobs().find_controller(agent.controller);
  if (controller == nullptr) throw StaleHandleError("the controller was removed");
  flatland::set_command(*controller, {velocity[0], velocity[1], velocity[2]});
  TouchCollector* touches = agent.world->contacts().touches.find(agent.touches);
  if (touches == nullptr) throw StaleHandleError("the collector was removed");
  touches->was_touched = false;
}

void AgentBatch::observe(std::size_t i) {
  const Agent& agent = agents_[i];
  World& world = *agent.world;
  const b2Body* body = world.find_body(agent.body);
  if (body == nullptr) throw StaleHandleError("the body was destroyed");
  const Triple pose = pose_of(*body);
  const Triple velocity = velocity_of(*body);
  const Triple sensor_pose = agent.finder->pose_of(pose);
  const b2Transform origin = checked_pose(sensor_pose);
  std::copy(pose.begin(), pose.end(), rows_.poses + 3 * i);
  std::copy(velocity.begin(), velocity.end(), rows_.velocities + 3 * i);
  std::copy(sensor_pose.begin(), sensor_pose.end(), rows_.sensor_poses + 3 * i);
  if (commands_.acts[i]) {
    const TouchCollector* touches = world.contacts().touches.find(agent.touches);
    rows_.touched[i] = touches->was_touched || !touches->touches.empty();
  }
  const Readings readings{rows_.ranges + i * agent.finder->readings(), nullptr};
  const NoiseKey key{commands_.noises[2 * i], commands_.noises[2 * i + 1]};
  std::unique_ptr<ScanMemory> memory = memories_.take();
  agent.finder->scan(SceneView(world.rays()), origin, key, readings, *memory);
  memories_.give_back(std::move(memory));
}

}  // namespace flatland
