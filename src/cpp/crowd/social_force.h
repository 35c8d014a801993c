// The social force model: accelerations of people towards their goals and away from others.
//
// Sources: D. Helbing and P. Molnár, "Social force model for pedestrian dynamics", Physical Review
// E 51 (1995); M. Moussaïd, N. Perozo, S. Garnier, D. Helbing and G. Theraulaz, "The walking
// behaviour of pedestrian social groups and its impact on crowd dynamics", PLoS ONE 5 (2010).
#pragma once

#include "vec.h"

namespace flatland::crowd {

inline constexpr double kNegligible = 0.01;  // acceleration that is ignored [m/s²]

struct SocialForces {
  SocialForces() { derive(); }

  double relaxation_time = 0.5;  // tau [s]
  double strength = 2.1;         // V0 [m²/s²]
  double range = 0.3;            // sigma [m]
  double look_ahead = 2.0;       // delta t of the ellipses [s]
  double relative = 1.0;         // share of the own velocity that is subtracted for the ellipses
  double behind = 0.5;           // weight of influences outside the field of view
  double half_view = 1.7453;     // half of the field of view: 100 degrees [rad]
  double wall_strength = 5.0;    // acceleration at a wall [m/s²]
  double wall_range = 0.1;       // distance over which the acceleration falls by the factor e [m]
  double gaze = 4.0;             // beta 1 of groups [1/s]
  double cohesion = 3.0;         // beta 2 of groups [m/s²]
  double spacing = 1.0;          // beta 3 of groups [m/s²]

  // Computes the members below from those above; to be called after changes.
  void derive();

  double person_sight;  // semi-minor axis of the ellipse beyond which people do not repel [m]
  double wall_sight;    // gap beyond which walls do not repel [m]
  double view_cosine;   // cosine of half of the field of view
};

// Returns the acceleration towards a preferred velocity, (v0 e - v) / tau.
Vec driving_acceleration(const SocialForces& forces, Vec preferred, Vec velocity);

// Returns the repulsion by another person, without the weight of the field of view. `offset` leads
// from the other person to this person. The equipotential lines are ellipses along
// `other_velocity`, because a walking person needs room for the next steps. Negligible repulsions
// are zero.
Vec repulsion(const SocialForces& forces, Vec offset, Vec other_velocity);

// Returns the weight of an influence from the direction -`push` on a person who walks along
// `heading`.
double view_weight(const SocialForces& forces, Vec heading, Vec push);

// Returns the repulsion by the nearest point of a wall. `offset` leads from this point to the
// center of the person. Unlike in the source, the distance is measured from the circumference of
// the person. Measured from the center, the posts of a door of one metre would repel too strongly
// to let anybody pass.
Vec wall_repulsion(const SocialForces& forces, Vec offset, double radius);

// Returns the accelerations in a group of `size` people that turn the gaze and hold the group
// together. The first one slows a person down until all other members are in the field of view; the
// second one leads towards their center. `to_center` leads to the center of the other members.
Vec group_attraction(const SocialForces& forces, int size, Vec heading, Vec velocity,
                     Vec to_center);
// Returns the repulsion by another member of the group who is too close. `offset` leads from the
// other member to this member.
Vec group_repulsion(const SocialForces& forces, Vec offset);

}  // namespace flatland::crowd
