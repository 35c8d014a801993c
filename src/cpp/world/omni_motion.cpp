#include "world/omni_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace flatland {
namespace {

double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Returns the target, with all components multiplied by the same factor so that no limit is
// exceeded.
Triple limited_target(const OmniMotion& motion) {
  double share = 1.0;
  const auto reduce = [&](double value, double limit) {
    if (limit != 0.0 && std::abs(value) > limit) share = std::min(share, limit / std::abs(value));
  };
  reduce(std::hypot(motion.target[0], motion.target[1]), motion.linear.velocity);
  reduce(motion.target[2], motion.angular.velocity);
  for (const Triple& wheel : *motion.wheels) reduce(dot(wheel, motion.target), motion.wheel_speed);
  return {share * motion.target[0], share * motion.target[1], share * motion.target[2]};
}

// Returns the part of the way to the target that the limits of acceleration allow in one step.
double share_of_step(const OmniMotion& motion, const Triple& target, double dt) {
  double share = 1.0;
  const auto reduce = [&](double allowed, double wanted) {
    if (std::abs(allowed) < std::abs(wanted)) share = std::min(share, allowed / wanted);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    SpeedLimits limits = i < 2 ? motion.linear : motion.angular;
    limits.velocity = 0.0;  // The target is already within the limits of the velocity.
    reduce(limits.step(motion.velocity[i], target[i], dt) - motion.velocity[i],
           target[i] - motion.velocity[i]);
  }
  if (motion.wheel_acceleration != 0.0) {
    for (const Triple& wheel : *motion.wheels) {
      const double change = dot(wheel, target) - dot(wheel, motion.velocity);
      reduce(std::copysign(motion.wheel_acceleration * dt, change), change);
    }
  }
  return share;
}

}  // namespace

void advance_omni(OmniMotion& motion, double dt) {
  const Triple target = limited_target(motion);
  const double share = share_of_step(motion, target, dt);
  for (std::size_t i = 0; i < 3; ++i) {
    motion.velocity[i] =
        share < 1.0 ? motion.velocity[i] + share * (target[i] - motion.velocity[i]) : target[i];
  }
}

}  // namespace flatland
