// Poses and velocities.
#pragma once

#include <array>

namespace flatland {

// A pose (x, y, theta) [m, rad] or a velocity (vx, vy, omega) [m/s, rad/s] in the world frame.
using Triple = std::array<double, 3>;

}  // namespace flatland
