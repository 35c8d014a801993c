#include "agents/agent_batch.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <type_traits>
#include <variant>

#include "rays/scene_view.h"
#include "world/bodies.h"
#include "world/controllers.h"
#include "world/errors.h"

namespace flatland {
namespace {

// Number of agents that a thread takes at a time.
constexpr std::size_t kAgentsPerJob = 4;

void set_target(Motion& motion, double forward, double omega) {
  std::visit(
      [&](auto& kind) {
        using Kind = std::decay_t<decltype(kind)>;
        if constexpr (std::is_same_v<Kind, TwistMotion> || std::is_same_v<Kind, OmniMotion> ||
                      std::is_base_of_v<SteeredMotion, Kind>) {
          kind.target = {forward, 0.0, omega};
        }
      },
      motion);
}

}  // namespace

AgentBatch::AgentBatch(std::vector<Agent> agents)
    : agents_(std::move(agents)), permitted_(agents_.size(), kNever) {}

void AgentBatch::replace(std::size_t i, Agent agent) {
  agents_[i] = std::move(agent);
  withdraw(i);
}

void AgentBatch::permit(std::size_t i) { permitted_[i] = agents_[i].world->clear_interrupt(); }

std::vector<std::size_t> AgentBatch::not_permitted(const bool* steps) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < agents_.size(); ++i) {
    if (steps[i] && permitted_[i] != agents_[i].world->interrupts()) found.push_back(i);
  }
  return found;
}

bool AgentBatch::takes_longer(double seconds, const AgentCommands& commands, const Run& run) {
  double expected = 0.0;
  for (std::size_t i = 0; i < agents_.size() && expected <= seconds; ++i) {
    Run own = run;
    own.time = agents_[i].world->time();
    if (commands.steps[i]) expected += agents_[i].world->expected_time(own);
  }
  return expected > seconds;
}

std::vector<UnfinishedRun> AgentBatch::perform(const AgentCommands& commands, const Run& run,
                                               const AgentObservations& rows,
                                               std::size_t num_threads) {
  std::vector<std::optional<UnfinishedRun>> unfinished(agents_.size());
  const auto perform_one = [&](std::size_t i) {
    RunResult result;
    try {
      if (commands.steps[i]) {
        World& world = *agents_[i].world;
        Run own = run;
        own.time = world.time();
        const double* velocity = commands.velocities + 2 * i;
        result = step(agents_[i], velocity[0], velocity[1], own);
        if (result.steps < run.n) {
          unfinished[i] = UnfinishedRun{i, std::move(result), nullptr};
          return;
        }
        world.set_time(own.time + run.n * run.step);
      }
      if (commands.observes[i]) observe(i, commands, rows);
    } catch (const std::exception&) {
      unfinished[i] = UnfinishedRun{i, {}, std::current_exception()};
    }
  };
  const std::size_t parts = (agents_.size() + kAgentsPerJob - 1) / kAgentsPerJob;
  agents_.front().world->threads().parallel_for(parts, num_threads, [&](std::size_t part) {
    const std::size_t end = std::min(agents_.size(), (part + 1) * kAgentsPerJob);
    for (std::size_t i = part * kAgentsPerJob; i < end; ++i) perform_one(i);
  });
  std::vector<UnfinishedRun> found;
  for (auto& each : unfinished) {
    if (each) found.push_back(std::move(*each));
  }
  return found;
}

RunResult AgentBatch::step(const Agent& agent, double forward, double omega, const Run& run) {
  World& world = *agent.world;
  Controller* controller = world.jobs().find_controller(agent.controller);
  if (controller == nullptr) throw StaleHandleError("the controller was removed");
  set_target(controller->motion, forward, omega);
  TouchCollector* touches = world.contacts().touches.find(agent.touches);
  if (touches == nullptr) throw StaleHandleError("the collector was removed");
  touches->was_touched = false;
  return world.run(run);
}

void AgentBatch::observe(std::size_t i, const AgentCommands& commands,
                         const AgentObservations& rows) {
  const Agent& agent = agents_[i];
  World& world = *agent.world;
  const b2Body* body = world.find_body(agent.body);
  if (body == nullptr) throw StaleHandleError("the body was destroyed");
  const Triple pose = pose_of(*body);
  const Triple velocity = velocity_of(*body);
  const Triple sensor_pose = agent.finder->pose_of(pose);
  const b2Transform origin = checked_pose(sensor_pose);
  std::copy(pose.begin(), pose.end(), rows.poses + 3 * i);
  std::copy(velocity.begin(), velocity.end(), rows.velocities + 3 * i);
  std::copy(sensor_pose.begin(), sensor_pose.end(), rows.sensor_poses + 3 * i);
  if (commands.steps[i]) {
    const TouchCollector* touches = world.contacts().touches.find(agent.touches);
    rows.touched[i] = touches->was_touched || !touches->touches.empty();
  }
  const Readings readings{rows.ranges + i * agent.finder->readings(), nullptr};
  const NoiseKey key{commands.noises[2 * i], commands.noises[2 * i + 1]};
  ScanMemoryPool& memories = world.rays().memories();
  std::unique_ptr<ScanMemory> memory = memories.take();
  agent.finder->scan(SceneView(world.rays()), origin, key, readings, *memory);
  memories.give_back(std::move(memory));
}

}  // namespace flatland
