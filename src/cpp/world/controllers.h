// Controllers, which move or measure bodies in each step without a call from outside.
//
// Controllers are values that refer to bodies by id, so that a copy of a world can contain copies
// of the controllers. The formulas are computed in doubles, in a fixed order and with the functions
// of the C library that Python uses, so that the results equal those of the same formulas in Python
// bit by bit.
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "vec.h"
#include "world/easing.h"
#include "world/job_place.h"
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
  Triple velocity{};  // commanded velocity within the limits
  Traction traction;
};

// A vehicle with a steered front wheel, which follows without slip.
struct SteeredMotion {
  SpeedLimits linear;            // limits of `speed`
  SpeedLimits angular;           // limits of the rate of the steering angle
  double max_angle = 0.0;        // greatest steering angle [rad], 0 for no limit
  double angle = 0.0;            // steering angle, counter-clockwise [rad]
  double angle_velocity = 0.0;   // rate of change of the angle [rad/s]
  double target_angle = 0.0;     // angle that the last twist required [rad]
  bool is_displayed = false;     // whether joints are set to `displayed_angle`
  double displayed_angle = 0.0;  // [rad]
  bool takes_twist = false;      // otherwise, the target is (speed, 0, steering angle)
  Triple target{};
  double speed = 0.0;      // speed of the driven wheel along its heading [m/s]
  double wheelbase = 1.0;  // distance from the rear center to the front wheel [m]
  Vec rear_center;         // midpoint of the rear wheels in the frame of the body [m]
  Traction traction;
};

// A body with a steered and driven front wheel and two passive rear wheels.
struct TricycleMotion : SteeredMotion {
  Id joint = 0;                // joint of the front wheel
  double steering_sign = 1.0;  // sign of the angle of the joint for a wheel steered to the left
};

// A car, as a single track: one steered wheel in the middle of the front axle, and a driven one in
// the middle of the rear axle.
struct AckermannMotion : SteeredMotion {
  Id joints[2] = {0, 0};  // joints of the left and the right front wheel, 0 for none
  double steering_signs[2] = {1.0, 1.0};
  double track = 0.0;  // distance of the front wheels [m]
  // Limits of the last command, in addition to those of the car, 0 for none.
  double acceleration = 0.0;       // [m/s^2]
  double steering_velocity = 0.0;  // [rad/s]
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
  bool is_dynamic = false;    // whether the body is dynamic
  bool is_triggered = false;  // direction of the motion in mode kTrigger
  float progress = 0.0F;
  double exact_progress = 0.0;
  bool is_forward = true;
  Triple pose{};  // pose of the body
};

using Motion = std::variant<TwistMotion, TricycleMotion, TweenMotion, AckermannMotion, OmniMotion,
                            PathMotion, RollingWheels>;

// Simulated time without a new command after which a drive stops.
struct CommandTimeout {
  std::int64_t limit = 0;  // [ns], 0 for none
  std::int64_t age = 0;    // time since the last command [ns], up to the limit
};

// A motion of a body, carried out in each step: `advance` before the physics step, and `hold` after
// it.
struct Controller {
  Id body = 0;
  JobPlace place;
  Motion motion;
  CommandTimeout timeout;
};

// Sets the command of a drive: the velocity, or the speed and the steering angle. Has no effect on
// motions that are no drives.
void set_command(Controller& controller, const Triple& target);
// Accounts for a step of the given duration [ns] that is about to begin. Stops a drive whose last
// command is too old, as a command of zeros does.
void age_command(Controller& controller, std::int64_t step);

// Advances the motion by dt seconds and sets the velocity of the body. Throws std::invalid_argument
// if the velocity is out of range. The motion has advanced in this case, too.
void advance(World& world, b2Body* body, Motion& motion, double dt);
// Reverts the effect of the physics step on a body whose motion is prescribed, or measures it.
// Idempotent. Throws as `advance`.
void hold(World& world, b2Body* body, Motion& motion);
// Moves the body to where it is in a period of the motion. Has no effect in the modes kOnce and
// kTrigger. `share` is the time since the start as a share of the period, from 0 to 1.
void place_on_tween(World& world, b2Body* body, TweenMotion& motion, double share);
// Returns whether `hold` has an effect.
bool has_hold(const Motion& motion);

}  // namespace flatland
