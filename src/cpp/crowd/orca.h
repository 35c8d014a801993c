// Optimal reciprocal collision avoidance: the velocities that avoid collisions for some time.
//
// Source: J. van den Berg, S. Guy, M. Lin and D. Manocha, "Reciprocal n-body collision avoidance",
// Robotics Research (2011).
#pragma once

#include "crowd/half_planes.h"
#include "crowd/vec.h"

namespace flatland::crowd {

struct Disc {
  Vec position, velocity;
  double radius = 0.0;
};

// Returns the velocities of one disc that avoid another one for `horizon` seconds if the other one
// takes the rest of the `share` of the change. `dt` is the time in which an overlap is to be
// resolved [s].
HalfPlane avoid(const Disc& disc, const Disc& other, double horizon, double share, double dt);

// Returns the velocities with which a disc at a distance `gap` from an obstacle does not reach it
// within `horizon` seconds. `away` is the unit vector from the obstacle, which moves with a
// velocity.
HalfPlane keep_off(Vec away, double gap, Vec obstacle_velocity, double horizon);

}  // namespace flatland::crowd
