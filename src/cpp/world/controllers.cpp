// Compiled with -fno-builtin: the compiler must not replace functions of the C library, such as
// pow(x, 2) by x * x, which Python calls, too.
#include "world/controllers.h"

#include <math.h>

#include "world/bodies.h"

namespace flatland {
namespace {

// min and max of Python, which return the first one of two equal numbers.
double lesser(double a, double b) { return b < a ? b : a; }
double greater(double a, double b) { return b > a ? b : a; }

// Returns the maximum change of velocity in a step whose target has the opposite sign.
double crossing_change(const SpeedLimits& limits, double speed, double dt) {
  const double acceleration = limits.acceleration;
  const double deceleration = limits.deceleration;
  if (deceleration != 0.0 && speed > deceleration * dt) return deceleration * dt;
  if (acceleration == 0.0) return HUGE_VAL;
  const double time_to_zero = deceleration != 0.0 ? speed / deceleration : 0.0;
  return speed + acceleration * (dt - time_to_zero);
}

void advance_motion(World&, b2Body* body, TwistMotion& motion, double dt) {
  const double forward = motion.velocity[0] =
      motion.linear.step(motion.velocity[0], motion.target[0], dt);
  const double omega = motion.velocity[2] =
      motion.angular.step(motion.velocity[2], motion.target[2], dt);
  const double yaw = pose_of(*body)[2];
  const double c = cos(yaw);
  const double s = sin(yaw);
  if (!motion.is_holonomic) {
    // Without the terms of a sideways velocity of 0, which could change the sign of a zero.
    set_velocity(body, {forward * c, forward * s, omega});
    return;
  }
  const double sideways = motion.velocity[1] =
      motion.linear.step(motion.velocity[1], motion.target[1], dt);
  set_velocity(body, {c * forward - s * sideways, s * forward + c * sideways, omega});
}

}  // namespace

double SpeedLimits::step(double v, double target, double dt) const {
  if (velocity != 0.0) target = lesser(greater(target, -velocity), velocity);
  if (target == v) return target;
  double change = HUGE_VAL;
  if (v * target < 0.0) {
    change = crossing_change(*this, fabs(v), dt);
  } else if (fabs(target) > fabs(v)) {
    if (acceleration != 0.0) change = acceleration * dt;
  } else if (deceleration != 0.0) {
    change = deceleration * dt;
  }
  return v + lesser(greater(target - v, -change), change);
}

void advance(World& world, b2Body* body, Motion& motion, double dt) {
  std::visit([&](auto& kind) { advance_motion(world, body, kind, dt); }, motion);
}

}  // namespace flatland
