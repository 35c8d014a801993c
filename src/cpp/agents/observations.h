// The observations and rewards of agents for learning, from arrays with a row for each agent.
#pragma once

#include <cstddef>
#include <vector>

namespace flatland {

// The state of agents relative to their goals.
struct AgentPlaces {
  std::size_t count;         // number of agents
  const double* poses;       // (x, y, theta) in the world frame
  const double* velocities;  // (vx, vy, omega) in the world frame
  const double* goals;       // (x, y) in the world frame
  double* goal_ahead;        // of the goal in the frame of the agent
  double* goal_left;
  double* distance;
  double* speed;  // forward
  double* yaw_rate;
  bool* arrived;
  const double* previous_distance;  // before the step
  const bool* collided;             // whether the agent touched anything in the step
};

// Computes all but the poses, velocities and goals. An agent has arrived within the radius.
void locate(const AgentPlaces& places, double goal_radius);

// Columns of an array of observations.
struct ObservationColumns {
  float* first;        // of the first agent
  std::size_t stride;  // from one agent to the next
  std::size_t count;   // of columns
  float* row(std::size_t i) const { return first + i * stride; }
};

// Writes scans of `beams` ranges, of which `out.count` groups of neighbours are combined to their
// nearest range. A range r is written as r / `length`; with `half` > 0, as r / (r + half). A beam
// without a hit within `length` is 1, and one that is too close is 0.
void write_scans(const float* ranges, std::size_t agents, std::size_t beams, float length,
                 float half, const ObservationColumns& out);

// Writes the distance of the goal divided by `scale`, at most 1, and the cosine and sine of its
// bearing.
void write_goals(const AgentPlaces& places, double scale, const ObservationColumns& out);

// Writes forward speed and yaw rate divided by their limits, from -1 to 1.
void write_velocities(const AgentPlaces& places, double max_speed, double max_yaw_rate,
                      const ObservationColumns& out);

// A quantity that is rewarded.
enum class Rewarded { kProgress, kArrival, kContact, kStep };
constexpr int kRewardedCount = 4;

// A quantity multiplied by a factor.
struct RewardTerm {
  Rewarded what;
  double factor;
};

// Writes the sum of terms, in their order, for each agent.
void write_rewards(const AgentPlaces& places, const std::vector<RewardTerm>& terms, double* out);

}  // namespace flatland
