// Agents for learning: in each of many worlds, a driven body with a range finder. Their worlds
// advance in parallel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "rays/range_finder.h"
#include "world/world.h"

namespace flatland {

// A driven body with a range finder; its world belongs to it alone.
struct Agent {
  World* world = nullptr;
  Id body = 0;
  Id controller = 0;  // of the body
  Id touches = 0;     // collector of its contacts
  std::shared_ptr<const RangeFinder> finder;
};

// What agents are to do, with an element for each of them.
struct AgentCommands {
  const bool* steps;            // whether the world of the agent steps
  const bool* observes;         // whether the agent is observed, after its steps
  const double* velocities;     // forward, sideways, yaw rate [m/s, rad/s], 3 numbers
  const std::uint64_t* noises;  // key of the random numbers of a scan, and number of the scan
};

// What is observed, with a row for each agent.
struct AgentObservations {
  double* poses;         // of the body (x, y, theta) in the world frame
  double* velocities;    // of the origin of the body (vx, vy, omega) in the world frame
  double* sensor_poses;  // of the range finder in the world frame
  float* ranges;
  bool* touched;  // whether the agent touched anything in its steps
};

// The steps of an agent that remain to be done outside of the core, or the exception of the core.
struct UnfinishedRun {
  std::size_t agent = 0;
  RunResult result;
  std::exception_ptr error;
};

class AgentBatch {
 public:
  // The agents have different worlds and equal numbers of readings.
  explicit AgentBatch(std::vector<Agent> agents);

  const std::vector<Agent>& agents() const { return agents_; }
  // Replaces an agent by one of another world.
  void replace(std::size_t i, Agent agent);

  // Permission to step a world without code outside of the core. It lasts until the world is
  // interrupted or the permission is withdrawn.
  void permit(std::size_t i);
  void withdraw(std::size_t i) { permitted_[i] = kNever; }
  // Returns the agents that are to step and have no permission.
  std::vector<std::size_t> not_permitted(const bool* steps) const;

  // Returns whether the wall time on one processor is expected to exceed a limit [s].
  bool takes_longer(double seconds, const AgentCommands& commands, const Run& run);
  // Begins to perform the steps of agents at the times of their worlds, and to observe agents, on
  // several threads. The caller has exclusive use of the worlds of these agents until `finish`;
  // other agents may be replaced.
  void start(const AgentCommands& commands, const Run& run, const AgentObservations& rows,
             std::size_t num_threads);
  // Whether `start` has begun anything for an agent.
  bool is_chosen(std::size_t i) const { return commands_.steps[i] || commands_.observes[i]; }
  // Observes another agent, between `start` and `finish`, on this thread.
  void observe(std::size_t i);
  // Completes what `start` has begun. An agent with steps that remain is not observed, and the time
  // of its world is that before the steps.
  std::vector<UnfinishedRun> finish();
  // Ends the threads; the next call of `start` starts new ones.
  void stop_threads() { threads_.stop(); }

 private:
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

  void perform(std::size_t i);
  RunResult step(const Agent& agent, const double* velocity, const Run& run);

  std::vector<Agent> agents_;
  std::vector<std::uint64_t> permitted_;  // interrupts of the world at the time of the permission

  ThreadPool threads_;

  // What `start` has begun.
  AgentCommands commands_{};
  Run run_;
  AgentObservations rows_{};
  std::vector<std::size_t> chosen_;  // agents that step or are observed
  std::vector<std::optional<UnfinishedRun>> unfinished_;
  std::unique_ptr<ThreadPool::Work> work_;
};

}  // namespace flatland
