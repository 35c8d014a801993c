// Compiled with -fno-builtin: the compiler must not replace functions of the C library, such as
// pow(x, 2) by x * x, which Python calls, too.
#include "world/controllers.h"

#include <math.h>

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "world/bodies.h"
#include "world/joined_bodies.h"
#include "world/joints.h"

namespace flatland {
namespace {

// The functions min and max of Python, which return the first one of two equal numbers.
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

// Drives with a velocity (forward, sideways, omega) in the frame of the body.
void drive_in_body_frame(World& world, b2Body* body, Traction& traction, const Triple& velocity,
                         double dt) {
  const auto [forward, sideways, omega] = velocity;
  const double yaw = pose_of(*body)[2];
  const double c = cos(yaw);
  const double s = sin(yaw);
  drive(world, body, traction, {c * forward - s * sideways, s * forward + c * sideways, omega}, dt);
}

void set_target(Motion& motion, const Triple& target) {
  std::visit(
      [&](auto& kind) {
        using Kind = std::decay_t<decltype(kind)>;
        if constexpr (std::is_same_v<Kind, TwistMotion> || std::is_same_v<Kind, OmniMotion> ||
                      std::is_base_of_v<SteeredMotion, Kind>) {
          kind.target = target;
        }
        if constexpr (std::is_same_v<Kind, AckermannMotion>) {
          kind.acceleration = kind.steering_velocity = 0.0;
        }
      },
      motion);
}

void advance_motion(World& world, b2Body* body, TwistMotion& motion, double dt) {
  const double forward = motion.velocity[0] =
      motion.linear.step(motion.velocity[0], motion.target[0], dt);
  const double omega = motion.velocity[2] =
      motion.angular.step(motion.velocity[2], motion.target[2], dt);
  if (!motion.is_holonomic) {
    // The terms of a sideways velocity of 0 are omitted: they could change the sign of a zero.
    const double yaw = pose_of(*body)[2];
    drive(world, body, motion.traction, {forward * cos(yaw), forward * sin(yaw), omega}, dt);
    return;
  }
  const double sideways = motion.velocity[1] =
      motion.linear.step(motion.velocity[1], motion.target[1], dt);
  drive_in_body_frame(world, body, motion.traction, {forward, sideways, omega}, dt);
}

// Returns sqrt(x^2 + y^2), correctly rounded in all but a few cases, like math.hypot of Python. The
// function of the C library has a greater error.
double exact_hypot(double x, double y) {
  x = fabs(x);
  y = fabs(y);
  const double larger = greater(x, y);
  if (!isfinite(x + y) || larger == 0.0) return x + y;
  int exponent = 0;
  frexp(larger, &exponent);
  x = ldexp(x, -exponent);
  y = ldexp(y, -exponent);
  // The sum of squares as high + low.
  const double xx = x * x;
  const double yy = y * y;
  const double high = xx + yy;
  const double rest = xx > yy ? (xx - high) + yy : (yy - high) + xx;
  const double low = rest + fma(x, x, -xx) + fma(y, y, -yy);
  // The rounded root is corrected by one Newton step.
  const double root = sqrt(high);
  return ldexp(root + (fma(-root, root, high) + low) / (2.0 * root), exponent);
}

// Turns a wheel towards an angle within the limits. Returns whether joints have to be set.
bool turn_wheel(SteeredMotion& motion, const SpeedLimits& limits, double target, double dt) {
  const double remaining = target - motion.angle;
  const double acceleration = limits.acceleration;
  double velocity = remaining / dt;
  if (acceleration != 0.0 &&
      fabs(remaining) < pow(motion.angle_velocity, 2.0) / (2.0 * acceleration)) {
    velocity = 0.0;  // Deceleration must start now to stop at the target.
  }
  motion.angle_velocity = limits.step(motion.angle_velocity, velocity, dt);
  double angle = motion.angle + motion.angle_velocity * dt;
  const double limit = motion.max_angle;
  if (limit != 0.0) angle = lesser(greater(angle, -limit), limit);
  motion.angle = angle;
  if (motion.is_displayed && angle == motion.displayed_angle) return false;
  motion.is_displayed = true;
  motion.displayed_angle = angle;
  return true;
}

void set_joint_angle(World& world, Id id, double angle) {
  b2Joint* joint = world.find_joint(id);
  if (joint != nullptr) set_limits(joint, AngleLimits(angle, angle));
}

// Turns the front wheel towards an angle within the limits.
void steer(World& world, TricycleMotion& motion, double target, double dt) {
  if (turn_wheel(motion, motion.angular, target, dt)) {
    set_joint_angle(world, motion.joint, motion.angle * motion.steering_sign);
  }
}

// Turns the front wheel for a velocity of the rear center and a yaw rate. The front wheel moves
// with the forward velocity v of the rear center and, across the wheelbase L, with L * omega to the
// left; its heading is the direction of the sum. Returns its speed.
double steer_for_twist(World& world, TricycleMotion& motion, double dt) {
  const double v = motion.target[0];
  double across = motion.wheelbase * motion.target[2];
  if (v != 0.0 || across != 0.0) {
    // From -90 to 90 degrees; the wheel rolls backwards to reverse.
    double angle = atan2(v < 0.0 ? -across : across, fabs(v));
    const double limit = motion.max_angle;
    if (limit != 0.0 && fabs(angle) > limit) {
      // The narrowest possible curve at the commanded speed of the rear center.
      angle = copysign(limit, angle);
      across = v * tan(angle);
    }
    motion.target_angle = angle;
  }
  // A command to stop keeps the steering angle.
  steer(world, motion, motion.target_angle, dt);
  const double speed = copysign(exact_hypot(v, across), v != 0.0 ? v : 1.0);
  // The robot does not move before the front wheel has turned to the new direction.
  return speed * greater(0.0, cos(motion.target_angle - motion.angle));
}

// Drives with a velocity of the rear center, which moves straight ahead, and a yaw rate. The
// velocity of the origin follows.
void drive_rear_center(World& world, b2Body* body, SteeredMotion& motion, double speed,
                       double omega, double dt) {
  const Vec center = motion.rear_center;
  drive_in_body_frame(world, body, motion.traction,
                      {speed + omega * center.y, -omega * center.x, omega}, dt);
}

void advance_motion(World& world, b2Body* body, TricycleMotion& motion, double dt) {
  double speed = motion.target[0];
  if (motion.takes_twist) {
    speed = steer_for_twist(world, motion, dt);
  } else {
    steer(world, motion, motion.target[2], dt);
  }
  const double v = motion.speed = motion.linear.step(motion.speed, speed, dt);
  const double omega = v * sin(motion.angle) / motion.wheelbase;
  drive_rear_center(world, body, motion, v * cos(motion.angle), omega, dt);
}

// Returns the steering angle for a velocity of the rear center and a yaw rate.
double angle_for_twist(const AckermannMotion& motion) {
  const double v = motion.target[0];
  const double across = motion.wheelbase * motion.target[2];
  if (v == 0.0 && across == 0.0) return motion.target_angle;  // A stop keeps the angle.
  const double angle = atan2(v < 0.0 ? -across : across, fabs(v));
  return lesser(greater(angle, -motion.max_angle), motion.max_angle);
}

// Returns the lesser one of two limits, of which 0 means none.
double lesser_limit(double limit, double other) {
  if (limit == 0.0 || other == 0.0) return limit != 0.0 ? limit : other;
  return lesser(limit, other);
}

void advance_motion(World& world, b2Body* body, AckermannMotion& motion, double dt) {
  motion.target_angle = motion.takes_twist ? angle_for_twist(motion) : motion.target[2];
  SpeedLimits linear = motion.linear;
  linear.acceleration = lesser_limit(linear.acceleration, motion.acceleration);
  linear.deceleration = lesser_limit(linear.deceleration, motion.acceleration);
  SpeedLimits angular = motion.angular;
  angular.velocity = lesser_limit(angular.velocity, motion.steering_velocity);
  if (turn_wheel(motion, angular, motion.target_angle, dt)) {
    const auto angles = ackermann_angles(motion.angle, motion.wheelbase, motion.track);
    for (std::size_t i = 0; i < 2; ++i) {
      set_joint_angle(world, motion.joints[i], angles[i] * motion.steering_signs[i]);
    }
  }
  const double v = motion.speed = linear.step(motion.speed, motion.target[0], dt);
  const double omega = v * tan(motion.angle) / motion.wheelbase;
  drive_rear_center(world, body, motion, v, omega, dt);
}

void set_progress(TweenMotion& motion, double progress) {
  motion.progress = static_cast<float>(progress);
  motion.exact_progress = progress;
}

void advance_progress(TweenMotion& motion, double step) {
  using Mode = TweenMotion::Mode;
  // The difference at which the 32-bit progress is replaced by the exact progress, and the progress
  // below which a backward motion is complete.
  constexpr double kTolerance = 1e-5;
  if (motion.mode == Mode::kTrigger) {
    motion.is_forward = motion.is_triggered;
  } else if (motion.mode == Mode::kLoop && motion.progress == 1.0F) {
    set_progress(motion, 0.0);
  } else if (motion.mode == Mode::kYoyo && (motion.progress == 0.0F || motion.progress == 1.0F)) {
    motion.is_forward = motion.progress == 0.0F;
  }
  const double signed_step = motion.is_forward ? step : -step;
  // The reference accumulates 32-bit floats, whose rounding decides in which of two steps the
  // motion ends. The same sum is used here. Unlike the reference: an additional exact sum corrects
  // the 32-bit sum if the steps are too small or too many for 32 bits.
  motion.progress += static_cast<float>(signed_step);
  motion.exact_progress += signed_step;
  if (fabs(static_cast<double>(motion.progress) - motion.exact_progress) > kTolerance) {
    motion.progress = static_cast<float>(motion.exact_progress);
  }
  if (motion.is_forward && motion.progress >= 1.0F) {
    set_progress(motion, 1.0);
  } else if (!motion.is_forward && static_cast<double>(motion.progress) < kTolerance) {
    set_progress(motion, 0.0);
  }
}

void hold_motion(World& world, b2Body* body, const TweenMotion& motion) {
  // This wakes the body, too. Box2D puts bodies without velocity to sleep, and finds no new
  // contacts of sleeping bodies.
  set_pose(world, body, motion.pose);
  // A dynamic body would keep velocity from contacts, and would act like a conveyor belt.
  if (motion.is_dynamic) set_velocity(body, {0.0, 0.0, 0.0});
}

void set_pose_of_progress(TweenMotion& motion) {
  const double eased = motion.easing(static_cast<double>(motion.progress));
  for (std::size_t i = 0; i < 3; ++i) motion.pose[i] = motion.start[i] + motion.delta[i] * eased;
}

void advance_motion(World& world, b2Body* body, TweenMotion& motion, double dt) {
  advance_progress(motion, lesser(dt / motion.duration, 1.0));
  set_pose_of_progress(motion);
  hold_motion(world, body, motion);
}

void advance_motion(World& world, b2Body* body, OmniMotion& motion, double dt) {
  advance_omni(motion, dt);
  drive_in_body_frame(world, body, motion.traction, motion.velocity, dt);
}

void advance_motion(World&, b2Body* body, PathMotion& motion, double dt) {
  advance_path(body, motion, dt);
}

void advance_motion(World&, b2Body*, RollingWheels&, double) {}

}  // namespace

std::array<double, 2> ackermann_angles(double angle, double wheelbase, double track) {
  // The centre of rotation is to the left of the centre of the rear axle, at the distance
  // L cos(angle) / sin(angle).
  const double across = wheelbase * sin(angle);
  const double along = wheelbase * cos(angle);
  const double shift = 0.5 * track * sin(angle);
  return {atan2(across, along - shift), atan2(across, along + shift)};
}

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

void set_command(Controller& controller, const Triple& target) {
  controller.timeout.age = 0;
  set_target(controller.motion, target);
}

void age_command(Controller& controller, std::int64_t step) {
  CommandTimeout& timeout = controller.timeout;
  if (timeout.age < timeout.limit) {
    timeout.age += std::min(step, timeout.limit - timeout.age);
  } else if (timeout.limit != 0) {
    set_target(controller.motion, {});
  }
}

void advance(World& world, b2Body* body, Motion& motion, double dt) {
  std::visit([&](auto& kind) { advance_motion(world, body, kind, dt); }, motion);
}

void hold(World& world, b2Body* body, Motion& motion) {
  if (const auto* tween = std::get_if<TweenMotion>(&motion)) {
    hold_motion(world, body, *tween);
  } else if (const auto* path = std::get_if<PathMotion>(&motion)) {
    hold_path(world, body, *path);
  } else if (auto* wheels = std::get_if<RollingWheels>(&motion)) {
    measure_wheels(world, *wheels);
  }
}

void place_on_tween(World& world, b2Body* body, TweenMotion& motion, double share) {
  using Mode = TweenMotion::Mode;
  if (motion.mode != Mode::kYoyo && motion.mode != Mode::kLoop) return;
  const double progress = motion.mode == Mode::kYoyo ? 2.0 * share : share;
  motion.is_forward = progress < 1.0;
  set_progress(motion, motion.is_forward ? progress : lesser(2.0 - progress, 1.0));
  set_pose_of_progress(motion);
  place_with_joined(world, body, motion.pose);
}

bool has_hold(const Motion& motion) {
  return std::holds_alternative<TweenMotion>(motion) ||
         std::holds_alternative<PathMotion>(motion) ||
         std::holds_alternative<RollingWheels>(motion);
}

}  // namespace flatland
