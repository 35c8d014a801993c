#include <pybind11/stl.h>

#include <optional>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "world/joints.h"

namespace py = pybind11;

namespace flatland {
namespace {

JointBodies joint_bodies(Id body_a, Id body_b, const PyPair& anchor_a, const PyPair& anchor_b,
                         bool collide_connected) {
  const auto [x_a, y_a] = anchor_a;
  const auto [x_b, y_b] = anchor_b;
  return {body_a, body_b, x_a, y_a, x_b, y_b, collide_connected};
}

}  // namespace

void bind_joints(WorldClass& world) {
  world.def("create_revolute_joint",
            [](World& self, Id body_a, Id body_b, const PyPair& anchor_a, const PyPair& anchor_b,
               const std::optional<AngleLimits>& limits, bool collide_connected) {
              return create_revolute_joint(
                  self, joint_bodies(body_a, body_b, anchor_a, anchor_b, collide_connected),
                  limits);
            });
  world.def("create_weld_joint", [](World& self, Id body_a, Id body_b, const PyPair& anchor_a,
                                    const PyPair& anchor_b, double reference_angle,
                                    double frequency, double damping, bool collide_connected) {
    return create_weld_joint(self,
                             joint_bodies(body_a, body_b, anchor_a, anchor_b, collide_connected),
                             reference_angle, frequency, damping);
  });
  world.def("joint_type", [](const World& self, Id id) {
    return self.read_joint(id).joint->GetType() == e_revoluteJoint ? "revolute" : "weld";
  });
  world.def("joint_bodies", [](const World& self, Id id) {
    b2Joint* joint = self.read_joint(id).joint;
    return std::make_pair(id_of(joint->GetBodyA()), id_of(joint->GetBodyB()));
  });
  world.def("joint_anchors", [](const World& self, Id id) {
    const auto [anchor_a, anchor_b] = anchors_of(self, id);
    return std::make_pair(to_python(anchor_a), to_python(anchor_b));
  });
  world.def("joint_collide_connected", [](const World& self, Id id) {
    return self.read_joint(id).joint->GetCollideConnected();
  });
  world.def("joint_limits", &limits_of);
  world.def("set_joint_limits", [](World& self, Id id, const std::optional<AngleLimits>& limits) {
    set_limits(self, id, limits);
  });
  world.def("joint_reference_angle", &reference_angle_of);
  world.def("joint_frequency",
            [](const World& self, Id id) { return self.read_joint(id).frequency; });
  world.def("joint_damping",
            [](const World& self, Id id) { return self.read_joint(id).damping_ratio; });
}

}  // namespace flatland
