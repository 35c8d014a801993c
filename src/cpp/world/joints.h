// Revolute and weld joints between two bodies.
#pragma once

#include <optional>
#include <utility>

#include "world/world.h"

namespace flatland {

// Two bodies, each with its anchor in its own frame.
struct JointBodies {
  Id body_a, body_b;
  double anchor_a_x, anchor_a_y, anchor_b_x, anchor_b_y;
  bool collide_connected;
};

using AngleLimits = std::pair<double, double>;

// All throw std::invalid_argument on bad numbers or when the two bodies are one.
Id create_revolute_joint(World& world, const JointBodies& bodies,
                         const std::optional<AngleLimits>& limits);
// A frequency of 0 makes a rigid joint, else an angular spring.
Id create_weld_joint(World& world, const JointBodies& bodies, double reference_angle,
                     double frequency, double damping_ratio);

// None for a joint without limits, and for a weld.
std::optional<AngleLimits> limits_of(const World& world, Id joint);
// Throws PhysicsError when the joint is no revolute joint. None takes the limits away.
void set_limits(World& world, Id joint, const std::optional<AngleLimits>& limits);

double reference_angle_of(const World& world, Id joint);
// Anchors in the frames of body A and body B.
std::pair<b2Vec2, b2Vec2> anchors_of(const World& world, Id joint);

}  // namespace flatland
