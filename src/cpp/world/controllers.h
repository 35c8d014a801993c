// What moves a body in each step without a call from outside: velocity commands with limits.
//
// Controllers are values that refer to bodies by id, so that a copy of a world can copy them. Their
// numbers are those of the plugins that create them, bit by bit: doubles in the order of the
// formulas, with the functions of the C library that Python uses.
#pragma once

#include <cstdint>
#include <variant>

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

using Motion = std::variant<TwistMotion>;

// A motion of a body, carried out once in each step, in the order of `order` and `place`.
struct Controller {
  Id body = 0;
  std::int64_t order = 0;       // of the plugin
  bool is_automatic = false;    // otherwise, it is carried out only by `advance`
  std::uint64_t last_step = 0;  // number of the step in which it was carried out last
  Motion motion;
};

// Advances the motion by dt seconds and sets the velocity of the body. Throws std::invalid_argument
// if the velocity is out of range; the motion has advanced all the same.
void advance(World& world, b2Body* body, Motion& motion, double dt);

}  // namespace flatland
