#include <pybind11/stl.h>

#include <array>
#include <optional>
#include <stdexcept>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/named.h"
#include "bindings/tuples.h"
#include "world/joints.h"

namespace py = pybind11;

namespace flatland {
namespace {

JointBodies joint_bodies(const PyWorld& world, const BodyHandle& body_a, const BodyHandle& body_b,
                         const Named<PyPoint>& anchor_a, const Named<PyPoint>& anchor_b,
                         Named<bool> collide_connected) {
  const PyPoint a = anchor_a.as("anchor_a"), b = anchor_b.as("anchor_b");
  if (body_a.world.core != world.core || body_b.world.core != world.core) {
    throw std::invalid_argument("a joint must connect bodies of its own world");
  }
  return {
      body_a.id, body_b.id, {a[0], a[1]}, {b[0], b[1]}, collide_connected.as("collide_connected")};
}

void bind_creation(WorldClass& world) {
  world.def(
      "create_revolute_joint",
      [](const PyWorld& self, const BodyHandle& body_a, const BodyHandle& body_b,
         const Named<PyPoint>& anchor_a, const Named<PyPoint>& anchor_b,
         const Named<std::optional<AngleLimits>>& limits, Named<bool> collide_connected) {
        const JointBodies bodies =
            joint_bodies(self, body_a, body_b, anchor_a, anchor_b, collide_connected);
        return JointHandle(self, create_revolute_joint(*self.core, bodies, limits.as("limits")));
      },
      py::arg("body_a"), py::arg("body_b"), py::arg("anchor_a"), py::arg("anchor_b"), py::kw_only(),
      py::arg("limits") = py::none(), py::arg("collide_connected") = false, R"(
Creates a joint that lets two bodies rotate about a common point.

Args:
    body_a: First body.
    body_b: Second body, different from the first one.
    anchor_a: Common point in the frame of body A [m].
    anchor_b: Common point in the frame of body B [m].
    limits: Lower and upper angle of B relative to A, measured from their relative angle at creation
        [rad]; None for no limits.
    collide_connected: Whether the two bodies collide with each other.

Returns:
    The new joint.

Raises:
    ValueError: The bodies are identical or in another world, a number is not finite, or the lower
        limit is greater than the upper limit.
    StaleHandleError: A body was destroyed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "create_weld_joint",
      [](const PyWorld& self, const BodyHandle& body_a, const BodyHandle& body_b,
         const Named<PyPoint>& anchor_a, const Named<PyPoint>& anchor_b,
         Named<double> reference_angle, Named<double> frequency, Named<double> damping,
         Named<bool> collide_connected) {
        const JointBodies bodies =
            joint_bodies(self, body_a, body_b, anchor_a, anchor_b, collide_connected);
        return JointHandle(
            self, create_weld_joint(*self.core, bodies, reference_angle.as("reference_angle"),
                                    frequency.as("frequency"), damping.as("damping")));
      },
      py::arg("body_a"), py::arg("body_b"), py::arg("anchor_a"), py::arg("anchor_b"), py::kw_only(),
      py::arg("reference_angle") = 0.0, py::arg("frequency") = 0.0, py::arg("damping") = 0.0,
      py::arg("collide_connected") = false, R"(
Creates a joint that connects two bodies rigidly or by an angular spring.

Args:
    body_a: First body.
    body_b: Second body, different from the first one.
    anchor_a: Common point in the frame of body A [m].
    anchor_b: Common point in the frame of body B [m].
    reference_angle: Angle of B relative to A at rest [rad].
    frequency: Frequency of the spring, at least 0 [Hz]; 0 for a rigid joint. The stiffness of the
        spring is computed from the moments of inertia of the bodies at this time.
    damping: Damping ratio of the spring, at least 0; 1 for critical damping.
    collide_connected: Whether the two bodies collide with each other.

Returns:
    The new joint.

Raises:
    ValueError: The bodies are identical or in another world, or a number is not finite, or the
        frequency or damping is negative.
    StaleHandleError: A body was destroyed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "joint", [](const PyWorld& self, Id joint_id) { return JointHandle(self, joint_id); },
      py::arg("joint_id"),
      "Returns the handle of a joint by its id, without checking that the joint exists.");
}

void bind_joint(py::class_<JointHandle, Handle>& joint) {
  joint.def(
      "destroy", [](const JointHandle& self) { self.core().destroy_joint(self.id); }, R"(
Destroys the joint and wakes its bodies.

Raises:
    StaleHandleError: The joint has already been destroyed.
    WorldLockedError: The world is stepping.
)");
  joint.def_property_readonly(
      "type",
      [](const JointHandle& self) {
        return read(self).joint->GetType() == e_revoluteJoint ? "revolute" : "weld";
      },
      "Type of the joint, `revolute` or `weld`.");
  joint.def_property_readonly(
      "body_a",
      [](const JointHandle& self) {
        return BodyHandle(self.world, id_of(read(self).joint->GetBodyA()));
      },
      "First body.");
  joint.def_property_readonly(
      "body_b",
      [](const JointHandle& self) {
        return BodyHandle(self.world, id_of(read(self).joint->GetBodyB()));
      },
      "Second body.");
  joint.def_property_readonly(
      "anchors",
      [](const JointHandle& self) {
        const auto [a, b] = anchors_of(self.core(), self.id);
        const b2Vec2 anchors[] = {a, b};
        return to_array(anchors, 2);
      },
      "Anchor points in the frames of the first and second body [m], shape (2, 2).");
  joint.def_property_readonly(
      "collide_connected",
      [](const JointHandle& self) { return read(self).joint->GetCollideConnected(); },
      "Whether the two bodies collide with each other.");
  joint.def_property_readonly(
      "limits", [](const JointHandle& self) { return limits_of(self.core(), self.id); },
      "Lower and upper angle [rad]; None without limits, and for a weld joint.");
  joint.def(
      "set_limits",
      [](const JointHandle& self, Named<double> lower, Named<double> upper) {
        set_limits(self.core(), self.id, AngleLimits{lower.as("lower"), upper.as("upper")});
      },
      py::arg("lower"), py::arg("upper"), R"(
Sets the limits of a revolute joint.

Args:
    lower: Lower angle [rad].
    upper: Upper angle [rad].

Raises:
    ValueError: A number is not finite, or the lower limit is above the upper one.
    PhysicsError: The joint is a weld joint.
    StaleHandleError: The joint was destroyed.
    WorldLockedError: The world is stepping.
)");
  joint.def(
      "clear_limits",
      [](const JointHandle& self) { set_limits(self.core(), self.id, std::nullopt); }, R"(
Removes the limits of a revolute joint.

Raises:
    PhysicsError: The joint is a weld joint.
    StaleHandleError: The joint was destroyed.
    WorldLockedError: The world is stepping.
)");
  joint.def_property_readonly(
      "reference_angle",
      [](const JointHandle& self) { return reference_angle_of(self.core(), self.id); },
      "Angle of the second body relative to the first one at rest [rad].");
  def_reading(joint, "frequency", &JointRecord::frequency,
              "Spring frequency of a weld joint [Hz]; 0 if the joint is rigid.");
  def_reading(joint, "damping", &JointRecord::damping_ratio,
              "Damping ratio of the spring of a weld joint.");
}

}  // namespace

void bind_joints(Classes& classes) {
  bind_creation(classes.world);
  bind_joint(classes.joint);
}

}  // namespace flatland
