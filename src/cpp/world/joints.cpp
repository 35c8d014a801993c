#include "world/joints.h"

#include <box2d/b2_revolute_joint.h>
#include <box2d/b2_weld_joint.h>

#include <algorithm>
#include <tuple>

#include "world/errors.h"

namespace flatland {
namespace {

// Of the stiffness and the damping of a spring, with which Box2D can compute.
constexpr float kMaxStiffness = 1e30F;

template <typename Definition>
Definition joint_definition(World& world, const JointBodies& bodies) {
  Definition definition;
  definition.bodyA = world.change_body(bodies.body_a);
  definition.bodyB = world.change_body(bodies.body_b);
  if (definition.bodyA == definition.bodyB) {
    throw std::invalid_argument("a joint must connect two different bodies");
  }
  definition.localAnchorA = checked_vector(bodies.anchor_a.x, bodies.anchor_a.y, "anchor_a");
  definition.localAnchorB = checked_vector(bodies.anchor_b.x, bodies.anchor_b.y, "anchor_b");
  definition.collideConnected = bodies.collide_connected;
  return definition;
}

std::pair<float, float> checked_limits(const AngleLimits& limits) {
  const float lower = checked_finite(limits.first, "lower limit");
  const float upper = checked_finite(limits.second, "upper limit");
  if (lower > upper) {
    throw std::invalid_argument("the lower limit must not be greater than the upper limit, got (" +
                                to_text(limits.first) + ", " + to_text(limits.second) + ")");
  }
  return {lower, upper};
}

}  // namespace

Id create_revolute_joint(World& world, const JointBodies& bodies,
                         const std::optional<AngleLimits>& limits) {
  auto definition = joint_definition<b2RevoluteJointDef>(world, bodies);
  if (limits) {
    std::tie(definition.lowerAngle, definition.upperAngle) = checked_limits(*limits);
    definition.enableLimit = true;
  }
  return world.add_joint(definition, 0.0F, 0.0F);
}

Id create_weld_joint(World& world, const JointBodies& bodies, double reference_angle,
                     double frequency, double damping_ratio) {
  auto definition = joint_definition<b2WeldJointDef>(world, bodies);
  definition.referenceAngle = checked_finite(reference_angle, "reference_angle");
  const float checked_frequency = checked_not_negative(frequency, "frequency");
  const float checked_damping = checked_not_negative(damping_ratio, "damping");
  if (checked_frequency > 0.0F) {
    b2AngularStiffness(definition.stiffness, definition.damping, checked_frequency, checked_damping,
                       definition.bodyA, definition.bodyB);
    if (!(definition.stiffness <= kMaxStiffness && definition.damping <= kMaxStiffness)) {
      throw std::invalid_argument(
          "frequency and damping result in a spring that is too stiff for the bodies");
    }
  }
  return world.add_joint(definition, checked_frequency, checked_damping);
}

void set_spring(b2Joint* joint, float frequency, float damping_ratio) {
  if (joint->GetType() != e_weldJoint || frequency == 0.0F) return;
  auto* weld = static_cast<b2WeldJoint*>(joint);
  float stiffness = 0.0F;
  float damping = 0.0F;
  b2AngularStiffness(stiffness, damping, frequency, damping_ratio, weld->GetBodyA(),
                     weld->GetBodyB());
  weld->SetStiffness(std::min(stiffness, kMaxStiffness));
  weld->SetDamping(std::min(damping, kMaxStiffness));
}

std::optional<AngleLimits> limits_of(const World& world, Id joint_id) {
  b2Joint* joint = world.read_joint(joint_id).joint;
  if (joint->GetType() != e_revoluteJoint) return std::nullopt;
  const auto* revolute = static_cast<const b2RevoluteJoint*>(joint);
  if (!revolute->IsLimitEnabled()) return std::nullopt;
  return AngleLimits(revolute->GetLowerLimit(), revolute->GetUpperLimit());
}

void set_limits(World& world, Id joint_id, const std::optional<AngleLimits>& limits) {
  set_limits(world.change_joint(joint_id), limits);
}

void set_limits(b2Joint* joint, const std::optional<AngleLimits>& limits) {
  if (joint->GetType() != e_revoluteJoint) {
    throw PhysicsError("only revolute joints have limits, but the joint is a weld joint");
  }
  auto* revolute = static_cast<b2RevoluteJoint*>(joint);
  if (limits) {
    const auto [lower, upper] = checked_limits(*limits);
    revolute->SetLimits(lower, upper);
  }
  revolute->EnableLimit(limits.has_value());
}

double reference_angle_of(const World& world, Id joint_id) {
  b2Joint* joint = world.read_joint(joint_id).joint;
  const float angle = joint->GetType() == e_revoluteJoint
                          ? static_cast<b2RevoluteJoint*>(joint)->GetReferenceAngle()
                          : static_cast<b2WeldJoint*>(joint)->GetReferenceAngle();
  return static_cast<double>(angle);
}

std::pair<b2Vec2, b2Vec2> anchors_of(const World& world, Id joint_id) {
  b2Joint* joint = world.read_joint(joint_id).joint;
  if (joint->GetType() == e_revoluteJoint) {
    const auto* revolute = static_cast<const b2RevoluteJoint*>(joint);
    return {revolute->GetLocalAnchorA(), revolute->GetLocalAnchorB()};
  }
  const auto* weld = static_cast<const b2WeldJoint*>(joint);
  return {weld->GetLocalAnchorA(), weld->GetLocalAnchorB()};
}

}  // namespace flatland
