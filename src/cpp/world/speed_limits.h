#pragma once

namespace flatland {

// Limits of a velocity and of the rate of change; 0 for no limit.
struct SpeedLimits {
  double velocity = 0.0;
  double acceleration = 0.0;  // limit of changes away from zero
  double deceleration = 0.0;  // limit of changes towards zero

  // Returns the velocity after one step of dt seconds towards a target.
  double step(double v, double target, double dt) const;
};

}  // namespace flatland
