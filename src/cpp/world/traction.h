// How a drive moves a body: by setting the velocity, or by bounded forces on the ground.
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
// In each step, the drive applies the impulse that leads to the required velocity, within the
// limits of the motors and of the grip of the wheels. The grip has an ellipsoidal limit surface (R.
// Howe and M. Cutkosky, Practical force-motion models for sliding manipulation, 1996): a force F
// and a torque M about the point at which the forces act are possible if (F / G)^2 + (M / (G R))^2
// <= 1. This point is the origin of the body, where the axle of the driven wheels is, or the centre
// of mass of a car, whose axles share the load.
struct Traction {
  bool is_enabled = false;  // whether forces act; otherwise, the velocity is set
  bool is_holonomic = false;
  bool acts_at_center = false;
  double max_force = 0.0;   // force of the motors, forwards; in all directions if holonomic [N]
  double max_torque = 0.0;  // torque of the motors [N m]
  double grip = 0.0;        // G divided by the mass: the friction coefficient times gravity [m/s^2]
  double radius = 0.0;      // R [m]; 0 for the radius of gyration
  std::shared_ptr<const std::vector<Id>> bodies;  // the driven body and the connected bodies
  // A braked robot holds a pose against forces within the limits, see `drive`.
  bool is_braked = false;
  Triple brake_pose{};
  // The part of the limits that the last step used, above 1 if the drive slipped or stalled.
  double load = 0.0;
};

// Changes the velocity of the origin of a body to (vx, vy, omega) in the world frame, as far as the
// traction allows. Throws std::invalid_argument if a number is out of range.
void drive(World& world, b2Body* body, Traction& traction, const Triple& velocity, double dt);

}  // namespace flatland
