// How a drive moves its body: by setting the velocity, or by bounded forces on the ground.
#pragma once

#include <memory>
#include <vector>

#include "world/slot_map.h"
#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// The forces with which a drive moves a group of bodies as if they were rigid.
//
// In each step, the drive applies the impulse that would lead to the velocity that it is to have,
// within its limits. The limits of the wheels' grip on the ground are those of an ellipsoidal limit
// surface (R. Howe and M. Cutkosky, Practical force-motion models for sliding manipulation, 1996):
// a force F and a torque M about the point at which they act are possible if
// (F / G)^2 + (M / (G R))^2 <= 1. That point is the origin of the body, where the axle of the
// driven wheels is, or the centre of mass of a car, whose axles share the load.
struct Traction {
  bool is_enabled = false;  // otherwise, the velocity is set
  bool is_holonomic = false;
  bool acts_at_center = false;
  double max_force = 0.0;   // of the motors, forwards; in all directions if holonomic [N]
  double max_torque = 0.0;  // of the motors [N m]
  double grip = 0.0;        // G divided by the mass: the friction coefficient times gravity [m/s^2]
  double radius = 0.0;      // R [m]; 0 for the radius of gyration
  std::shared_ptr<const std::vector<Id>> bodies;  // the driven body, and those connected to it
  // A braked robot holds its pose against forces within the limits, see `drive`.
  bool is_braked = false;
  Triple brake_pose{};
  // The part of the limits that the last step used, above 1 if the drive slipped or stalled.
  double load = 0.0;
};

// Gives the origin of a body a velocity (vx, vy, omega) in the world frame, as far as the traction
// allows. Throws std::invalid_argument if a number is out of range.
void drive(World& world, b2Body* body, Traction& traction, const Triple& velocity, double dt);

}  // namespace flatland
