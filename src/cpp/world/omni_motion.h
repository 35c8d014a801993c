// The motion of a holonomic drive, with limits of its wheels.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "world/speed_limits.h"
#include "world/traction.h"
#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// The origin of a body moves with a velocity (forward, sideways, omega) in the frame of the body,
// and changes its velocity along a straight line towards the target.
struct OmniMotion {
  SpeedLimits linear, angular;
  // The speed at which the rim of a wheel rolls is the scalar product of its row and the velocity.
  std::shared_ptr<const std::vector<Triple>> wheels;
  double wheel_speed = 0.0;         // largest one [m/s], 0 for no limit
  double wheel_acceleration = 0.0;  // [m/s^2], 0 for no limit
  Triple target{};
  Triple velocity{};  // within the limits
  Traction traction;
};

// Advances the motion by dt seconds and moves the body. Throws as `advance`.
void advance_omni(World& world, b2Body* body, OmniMotion& motion, double dt);

}  // namespace flatland
