#include "agents/observations.h"

#include <algorithm>
#include <cmath>

namespace flatland {
namespace {

float unit_limited(double number) { return std::clamp(static_cast<float>(number), -1.0F, 1.0F); }

// The lesser of two ranges, of which NaN is the greater one.
float nearer(float a, float b) { return b < a || std::isnan(a) ? b : a; }

// Combines groups of neighbours to their nearest range.
void combine(const float* ranges, std::size_t group, std::size_t count, float* out) {
  for (std::size_t k = 0; k < count; ++k, ranges += group) {
    out[k] = ranges[0];
    for (std::size_t j = 1; j < group; ++j) out[k] = nearer(out[k], ranges[j]);
  }
}

double rewarded(const AgentPlaces& places, std::size_t i, Rewarded what) {
  switch (what) {
    case Rewarded::kProgress:
      return places.previous_distance[i] - places.distance[i];
    case Rewarded::kArrival:
      return places.arrived[i] ? 1.0 : 0.0;
    case Rewarded::kContact:
      return places.collided[i] ? 1.0 : 0.0;
    case Rewarded::kStep:
      break;
  }
  return 1.0;
}

}  // namespace

void locate(const AgentPlaces& places, double goal_radius) {
  for (std::size_t i = 0; i < places.count; ++i) {
    const double* pose = places.poses + 3 * i;
    const double* velocity = places.velocities + 3 * i;
    const double c = std::cos(pose[2]);
    const double s = std::sin(pose[2]);
    const double dx = places.goals[2 * i] - pose[0];
    const double dy = places.goals[2 * i + 1] - pose[1];
    places.goal_ahead[i] = dx * c + dy * s;
    places.goal_left[i] = dy * c - dx * s;
    places.distance[i] = std::sqrt(dx * dx + dy * dy);
    places.arrived[i] = places.distance[i] <= goal_radius;
    places.speed[i] = velocity[0] * c + velocity[1] * s;
    places.yaw_rate[i] = velocity[2];
  }
}

void write_scans(const float* ranges, std::size_t agents, std::size_t beams, float length,
                 float half, const ObservationColumns& out) {
  const std::size_t group = out.count == 0 ? 0 : beams / out.count;
  for (std::size_t i = 0; i < agents; ++i) {
    const float* from = ranges + i * beams;
    float* to = out.row(i);
    if (group > 1) {
      combine(from, group, out.count, to);
      from = to;
    }
    if (half > 0.0F) {
      for (std::size_t k = 0; k < out.count; ++k) {
        const float range = std::max(from[k], 0.0F);
        to[k] = from[k] < length ? range / (range + half) : 1.0F;
      }
    } else {
      for (std::size_t k = 0; k < out.count; ++k) {
        to[k] = std::max(from[k] < length ? from[k] : length, 0.0F) / length;
      }
    }
  }
}

void write_goals(const AgentPlaces& places, double scale, const ObservationColumns& out) {
  for (std::size_t i = 0; i < places.count; ++i) {
    const double distance = std::max(places.distance[i], 1e-9);
    float* to = out.row(i);
    to[0] = static_cast<float>(std::min(places.distance[i] / scale, 1.0));
    // A quotient may exceed 1 by a rounding error.
    to[1] = unit_limited(places.goal_ahead[i] / distance);
    to[2] = unit_limited(places.goal_left[i] / distance);
  }
}

void write_velocities(const AgentPlaces& places, double max_speed, double max_yaw_rate,
                      const ObservationColumns& out) {
  for (std::size_t i = 0; i < places.count; ++i) {
    float* to = out.row(i);
    to[0] = unit_limited(places.speed[i] / max_speed);
    to[1] = unit_limited(places.yaw_rate[i] / max_yaw_rate);
  }
}

void write_rewards(const AgentPlaces& places, const std::vector<RewardTerm>& terms, double* out) {
  for (std::size_t i = 0; i < places.count; ++i) {
    double sum = 0.0;
    for (const RewardTerm& term : terms) sum += rewarded(places, i, term.what) * term.factor;
    out[i] = sum;
  }
}

}  // namespace flatland
