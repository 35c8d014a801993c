// Agents for learning: in each of many worlds, one or several driven bodies with range finders. The
// worlds advance in parallel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "rays/range_finder.h"
#include "rays/scan_memory.h"
#include "world/world.h"

namespace flatland {

// A driven body with a range finder.
struct Agent {
  World* world = nullptr;
  Id body = 0;
  Id controller = 0;  // of the body
  Id touches = 0;     // collector of its contacts
  std::shared_ptr<const RangeFinder> finder;
};

// What agents are to do, with an element for each of them.
struct AgentCommands {
  const bool* acts;             // whether the agent acts; the worlds of agents that act step
  const bool* observes;         // whether the agent is observed, after the steps of its world
  const double* velocities;     // forward, sideways, yaw rate [m/s, rad/s], 3 numbers
  const std::uint64_t* noises;  // key of the random numbers of a scan, and number of the scan
};

// What is observed, with a row for each agent.
struct AgentObservations {
  double* poses;         // of the body (x, y, theta) in the world frame
  double* velocities;    // of the origin of the body (vx, vy, omega) in the world frame
  double* sensor_poses;  // of the range finder in the world frame
  float* ranges;
  bool* touched;  // whether an agent that acts touched anything in the steps
};

// The steps of a world that remain to be done outside of the core, or the exception of the core.
struct UnfinishedRun {
  std::size_t agent = 0;  // the first one in the world
  RunResult result;
  std::exception_ptr error;
};

class AgentBatch {
 public:
  // The agents of a world are neighbours. All have equal numbers of readings.
  explicit AgentBatch(std::vector<Agent> agents);

  const std::vector<Agent>& agents() const { return agents_; }
  // Replaces an agent by one of another world.
  void replace(std::size_t i, Agent agent);

  // Permission to step the world of an agent without code outside of the core. It lasts until the
  // world is interrupted or the permission is withdrawn. All agents of a world that act need it.
  void permit(std::size_t i);
  void withdraw(std::size_t i) { permitted_[i] = kNever; }
  // Returns the agents that are to act and have no permission.
  std::vector<std::size_t> not_permitted(const bool* acts) const;

  // Returns whether the wall time on one processor is expected to exceed a limit [s].
  bool takes_longer(double seconds, const AgentCommands& commands, const Run& run);
  // Begins to perform the steps of worlds at their times, and to observe agents, on several
  // threads. The caller has exclusive use of the worlds of these agents until `finish`; agents of
  // other worlds may be replaced.
  void start(const AgentCommands& commands, const Run& run, const AgentObservations& rows,
             std::size_t num_threads);
  // Whether `start` has begun anything for an agent.
  bool is_chosen(std::size_t i) const { return commands_.acts[i] || commands_.observes[i]; }
  // Observes an agent of another world, between `start` and `finish`, on this thread.
  void observe(std::size_t i);
  // Completes what `start` has begun. Agents whose world has steps that remain are not observed,
  // and its time is that before the steps.
  std::vector<UnfinishedRun> finish();
  // Ends the threads; the next call of `start` starts new ones.
  void stop_threads() { threads_.stop(); }

 private:
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

  // The agents of a world: a range of indices.
  struct Team {
    std::size_t begin, end;
  };

  // Returns the agents of the world of agent i, which must be the first one.
  Team team_at(std::size_t i) const;
  // Returns whether an agent of a team acts.
  static bool is_acting(const Team& team, const AgentCommands& commands);
  // Begins to load the worlds of later teams into the cache.
  void prefetch_after(std::size_t k) const;
  void perform(std::size_t k);
  // Steps the world of a team. Returns false if steps remain.
  bool step(const Team& team, std::optional<UnfinishedRun>& unfinished);
  void set_command(const Agent& agent, const double* velocity);

  std::vector<Agent> agents_;
  std::vector<std::uint64_t> permitted_;  // interrupts of the world at the time of the permission

  ThreadPool threads_;
  ScanMemoryPool memories_;  // of all worlds, so that it remains in the cache

  // What `start` has begun.
  AgentCommands commands_{};
  Run run_;
  AgentObservations rows_{};
  std::vector<Team> chosen_;  // teams of which an agent acts or is observed
  std::vector<std::optional<UnfinishedRun>> unfinished_;  // by team
  std::unique_ptr<ThreadPool::Work> work_;
};

}  // namespace flatland
