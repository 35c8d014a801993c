// The angles of wheels that roll with the motion of bodies.
#pragma once

#include <memory>
#include <vector>

#include "vec.h"
#include "world/slot_map.h"
#include "world/triple.h"

namespace flatland {

class World;

// A wheel on the ground.
struct Wheel {
  Id body = 0;
  Vec position;          // in the frame of the body [m]
  double heading = 0.0;  // direction in which the wheel rolls, body frame [rad]
  double radius = 1.0;   // [m]
  double slide = 0.0;    // cotangent of the angle from the heading to the free direction
};

struct RollingWheels {
  struct State {
    double angle = 0.0;  // [rad]
    double speed = 0.0;  // [rad/s]
    bool is_measured = false;
    Triple pose{};  // pose of the body at the last measurement
  };

  std::shared_ptr<const std::vector<Wheel>> wheels;
  std::vector<State> states;
};

// Adds the motion of the bodies since the last measurement to the angles.
void measure_wheels(World& world, RollingWheels& wheels);
// Makes the next measurement start from the current poses.
void skip_motion(World& world, RollingWheels& wheels);

}  // namespace flatland
