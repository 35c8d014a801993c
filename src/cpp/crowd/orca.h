// Optimal reciprocal collision avoidance: the velocities that avoid collisions for some time.
//
// Source: J. van den Berg, S. Guy, M. Lin and D. Manocha, "Reciprocal n-body collision avoidance",
// Robotics Research (2011).
#pragma once

#include "crowd/half_planes.h"
#include "vec.h"

namespace flatland::crowd {

struct Disc {
  Vec position, velocity;
  double radius = 0.0;
};

// Returns the velocities of a disc that avoid another disc for `horizon` seconds. The disc makes
// `share` of the necessary change of the relative velocity, the other disc the rest. An overlap is
// resolved in the time `dt` [s].
HalfPlane avoid(const Disc& disc, const Disc& other, double horizon, double share, double dt);

// Returns the velocities with which a disc does not reach an obstacle within `horizon` seconds. The
// gap is the distance of the disc from the obstacle [m]; `away` is the unit vector from the
// obstacle to the disc.
HalfPlane keep_off(Vec away, double gap, Vec obstacle_velocity, double horizon);

}  // namespace flatland::crowd
