// The motion of a holonomic drive, with limits of its wheels.
#pragma once

#include <memory>
#include <vector>

#include "world/speed_limits.h"
#include "world/traction.h"
#include "world/triple.h"

namespace flatland {

// The origin of a body moves with a velocity (forward, sideways, omega) in the frame of the body,
// and changes its velocity along a straight line towards the target.
struct OmniMotion {
  SpeedLimits linear, angular;
  // The speed at which the rim of a wheel rolls is the scalar product of its row and the velocity.
  std::shared_ptr<const std::vector<Triple>> wheels;
  double wheel_speed = 0.0;         // greatest speed of a wheel [m/s], 0 for no limit
  double wheel_acceleration = 0.0;  // greatest acceleration [m/s^2], 0 for no limit
  Triple target{};
  Triple velocity{};  // commanded velocity within the limits
  Traction traction;
};

// Advances the velocity of the motion by dt seconds.
void advance_omni(OmniMotion& motion, double dt);

}  // namespace flatland
