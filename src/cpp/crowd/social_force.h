// The social force model: accelerations of people towards their goals and away from others.
//
// Sources: D. Helbing and P. Molnár, "Social force model for pedestrian dynamics", Physical Review
// E 51 (1995); M. Moussaïd, N. Perozo, S. Garnier, D. Helbing and G. Theraulaz, "The walking
// behaviour of pedestrian social groups and its impact on crowd dynamics", PLoS ONE 5 (2010).
#pragma once

#include "crowd/vec.h"

namespace flatland::crowd {

struct SocialForces {
  double relaxation_time = 0.5;  // tau [s]
  double strength = 2.1;         // V0 [m²/s²]
  double range = 0.3;            // sigma [m]
  double look_ahead = 2.0;       // delta t of the ellipses [s]
  double relative = 1.0;         // share of the own velocity that is subtracted for the ellipses
  double behind = 0.5;           // weight of what is outside the field of view
  double half_view = 1.7453;     // of the field of view: 100 degrees [rad]
  double wall_strength = 5.0;    // of the acceleration at a wall [m/s²]
  double wall_range = 0.1;       // [m]
  double gaze = 4.0;             // beta 1 of groups [1/s]
  double cohesion = 3.0;         // beta 2 of groups [m/s²]
  double spacing = 1.0;          // beta 3 of groups [m/s²]
};

// (v0 e - v) / tau: the acceleration towards a preferred velocity.
Vec driving_acceleration(const SocialForces& forces, Vec preferred, Vec velocity);

// The repulsion by another person, without the weight of the field of view. `offset` leads from
// the other person to this one; `other_velocity` is that of the other person. The equipotential
// lines are ellipses: the other one needs room for its next steps.
Vec repulsion(const SocialForces& forces, Vec offset, Vec other_velocity);

// The weight of an influence from the direction -`push` for somebody who walks along `heading`.
double view_weight(const SocialForces& forces, Vec heading, Vec push);

// The repulsion by the nearest point of a wall. `offset` leads from that point to the center of
// the person. Unlike in the source, distances are those from the circumference: with those from
// the center, two door posts at a distance of one metre would repel too much to pass between them.
Vec wall_repulsion(const SocialForces& forces, Vec offset, double radius);

// The terms of a group of `size` people: towards the point from which all others are in the field
// of view, and towards their center. `to_center` leads to the center of the others.
Vec group_attraction(const SocialForces& forces, int size, Vec heading, Vec velocity,
                     Vec to_center);
// The repulsion by another member that is too close; `offset` leads from it to this one.
Vec group_repulsion(const SocialForces& forces, Vec offset);

}  // namespace flatland::crowd
