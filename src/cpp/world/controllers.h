// What moves a body in each step without a call from outside: velocity commands with limits.
//
// Controllers are values that refer to bodies by id, so that a copy of a world can copy them. Their
// numbers are those of the plugins that create them, bit by bit: doubles in the order of the
// formulas, with the functions of the C library that Python uses.
#pragma once

#include <cstdint>
#include <variant>

#include "world/easing.h"
#include "world/slot_map.h"
#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// Limits of a velocity and of its rate of change; 0 is no limit.
struct SpeedLimits {
  double velocity = 0.0;
  double acceleration = 0.0;  // away from zero
  double deceleration = 0.0;  // towards zero

  // Returns the velocity after one step of dt seconds towards a target.
  double step(double v, double target, double dt) const;
};

// The origin of a body moves with a velocity (forward, sideways, omega) in the frame of the body
// [m/s, rad/s].
struct TwistMotion {
  SpeedLimits linear, angular;
  bool is_holonomic = false;  // otherwise, the sideways velocity is ignored
  Triple target{};
  Triple velocity{};  // within the limits
};

// A body with a steered and driven front wheel and two passive rear wheels.
struct TricycleMotion {
  SpeedLimits linear, angular;  // of the front wheel, and of its steering angle
  double max_angle = 0.0;       // of the steering [rad], 0 for no limit
  bool takes_twist = false;     // otherwise, the target is (front speed, 0, steering angle)
  Id joint = 0;                 // of the front wheel
  double steering_sign = 1.0;   // of the angle of the joint if the wheel is steered to the left
  double wheelbase = 1.0;       // from the rear center to the front wheel [m]
  double rear_center[2] = {};   // midpoint of the rear wheels in the frame of the body [m]
  Triple target{};
  double angle = 0.0;           // of the front wheel, counter-clockwise [rad]
  double angle_velocity = 0.0;  // its rate of change [rad/s]
  double speed = 0.0;           // of the front wheel along its heading [m/s]
  double target_angle = 0.0;    // that the last twist required
  bool is_displayed = false;    // whether the joint has `displayed_angle`
  double displayed_angle = 0.0;
};

// A prescribed motion between two poses.
struct TweenMotion {
  enum class Mode : std::uint8_t { kYoyo, kLoop, kOnce, kTrigger };

  Mode mode = Mode::kYoyo;
  Easing easing;
  double duration = 1.0;  // [s]
  Triple start{}, delta{};
  bool is_dynamic = false;    // whether the body is
  bool is_triggered = false;  // in mode kTrigger
  float progress = 0.0F;
  double exact_progress = 0.0;
  bool is_forward = true;
  Triple pose{};  // of the body
};

using Motion = std::variant<TwistMotion, TricycleMotion, TweenMotion>;

// A motion of a body, carried out once in each step, in the order of `order` and `place`.
struct Controller {
  Id body = 0;
  std::int64_t order = 0;       // of the plugin
  bool is_automatic = false;    // otherwise, it is carried out only by `advance_now`
  bool holds = false;           // whether `hold` is carried out after each step
  std::uint64_t last_step = 0;  // number of the step in which it was carried out last
  Motion motion;
};

// Advances the motion by dt seconds and sets the velocity of the body. Throws std::invalid_argument
// if the velocity is out of range; the motion has advanced all the same.
void advance(World& world, b2Body* body, Motion& motion, double dt);
// Reverts the effect of the physics step on a body whose motion is prescribed. Throws as `advance`.
void hold(World& world, b2Body* body, const Motion& motion);
// Whether `hold` has an effect.
bool has_hold(const Motion& motion);

}  // namespace flatland
