// What moves or measures a body in each step without a call from outside.
//
// Controllers are values that refer to bodies by id, so that a copy of a world can copy them. Their
// numbers are those of the plugins that create them, bit by bit: doubles in the order of the
// formulas, with the functions of the C library that Python uses.
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "world/easing.h"
#include "world/omni_motion.h"
#include "world/path_motion.h"
#include "world/rolling_wheels.h"
#include "world/slot_map.h"
#include "world/speed_limits.h"
#include "world/traction.h"
#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// The origin of a body moves with a velocity (forward, sideways, omega) in the frame of the body
// [m/s, rad/s].
struct TwistMotion {
  SpeedLimits linear, angular;
  bool is_holonomic = false;  // otherwise, the sideways velocity is ignored
  Triple target{};
  Triple velocity{};  // within the limits
  Traction traction;
};

// The angle of a steered wheel.
struct SteeredWheel {
  SpeedLimits angular;           // of the steering angle
  double max_angle = 0.0;        // of the steering [rad], 0 for no limit
  double angle = 0.0;            // counter-clockwise [rad]
  double angle_velocity = 0.0;   // its rate of change [rad/s]
  double target_angle = 0.0;     // that the last twist required
  bool is_displayed = false;     // whether joints have `displayed_angle`
  double displayed_angle = 0.0;  // [rad]
};

// A body with a steered and driven front wheel and two passive rear wheels.
struct TricycleMotion : SteeredWheel {
  SpeedLimits linear;          // of the front wheel
  bool takes_twist = false;    // otherwise, the target is (front speed, 0, steering angle)
  Id joint = 0;                // of the front wheel
  double steering_sign = 1.0;  // of the angle of the joint if the wheel is steered to the left
  double wheelbase = 1.0;      // from the rear center to the front wheel [m]
  double rear_center[2] = {};  // midpoint of the rear wheels in the frame of the body [m]
  Triple target{};
  double speed = 0.0;  // of the front wheel along its heading [m/s]
  Traction traction;
};

// A car, as a single track: one steered wheel in the middle of the front axle, and a driven one in
// the middle of the rear axle.
struct AckermannMotion : SteeredWheel {
  SpeedLimits linear;        // of the centre of the rear axle
  bool takes_twist = false;  // otherwise, the target is (speed, 0, steering angle)
  Id joints[2] = {0, 0};     // of the left and the right front wheel, 0 for none
  double steering_signs[2] = {1.0, 1.0};
  double track = 0.0;          // distance of the front wheels [m]
  double wheelbase = 1.0;      // distance of the axles [m]
  double rear_center[2] = {};  // centre of the rear axle in the frame of the body [m]
  Triple target{};
  double speed = 0.0;  // of the centre of the rear axle [m/s]
  Traction traction;
};

// Returns the angles of the left and the right front wheel whose axes meet on the rear axle, for
// the angle of a wheel between them [rad].
std::array<double, 2> ackermann_angles(double angle, double wheelbase, double track);

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

using Motion = std::variant<TwistMotion, TricycleMotion, TweenMotion, AckermannMotion, OmniMotion,
                            PathMotion, RollingWheels>;

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
// Reverts the effect of the physics step on a body whose motion is prescribed, or measures it.
// Idempotent. Throws as `advance`.
void hold(World& world, b2Body* body, Motion& motion);
// Whether `hold` has an effect.
bool has_hold(const Motion& motion);

}  // namespace flatland
