// Revolute and weld joints between two bodies.
#pragma once

#include <optional>
#include <utility>

#include "vec.h"
#include "world/world.h"

namespace flatland {

// Two bodies with the anchor points in their local frames.
struct JointBodies {
  Id body_a, body_b;
  Vec anchor_a, anchor_b;
  bool collide_connected;
};

using AngleLimits = std::pair<double, double>;

// Both functions throw std::invalid_argument if a number is invalid or the bodies are identical.
Id create_revolute_joint(World& world, const JointBodies& bodies,
                         const std::optional<AngleLimits>& limits);
// Creates a weld joint: rigid if the frequency is 0, otherwise with an angular spring.
Id create_weld_joint(World& world, const JointBodies& bodies, double reference_angle,
                     double frequency, double damping_ratio);
// Sets the stiffness and the damping of the spring of a weld joint, which result from its frequency
// and from the present moments of inertia of the bodies; has no effect on other joints.
void set_spring(b2Joint* joint, float frequency, float damping_ratio);

// Returns nullopt for a joint without limits and for a weld joint.
std::optional<AngleLimits> limits_of(const World& world, Id joint);
// Throws PhysicsError if the joint is not a revolute joint. Nullopt removes the limits.
void set_limits(World& world, Id joint, const std::optional<AngleLimits>& limits);
void set_limits(b2Joint* joint, const std::optional<AngleLimits>& limits);

double reference_angle_of(const World& world, Id joint);
// Returns the anchor points in the frames of body A and body B.
std::pair<b2Vec2, b2Vec2> anchors_of(const World& world, Id joint);

}  // namespace flatland
