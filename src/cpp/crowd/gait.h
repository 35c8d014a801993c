// The motion of legs: one leg stands while the other one swings.
#pragma once

#include "vec.h"

namespace flatland::crowd {

// Returns the length of one step at a walking speed [m]. Source: M. Seitz and G. Köster, "Natural
// discretization of pedestrian movement in continuous space", Physical Review E 86 (2012).
double step_length(double speed);

// Returns the phase of the gait after walking a distance [m] at a speed [m/s]. A phase is in [0,
// 1): the left leg stands in the first half, the right leg in the second half.
double advance_phase(double phase, double distance, double speed);

// Returns the position of the left leg along the heading, relative to the body [m]. The position of
// the right leg is the negative. A standing leg does not move over the ground.
double leg_offset(double phase, double speed);

}  // namespace flatland::crowd
