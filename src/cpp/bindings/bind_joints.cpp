#include <pybind11/stl.h>

#include <optional>
#include <utility>

#include "bindings/bindings.h"
#include "world/joints.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Point = std::pair<double, double>;

JointBodies joint_bodies(Id body_a, Id body_b, const Point& anchor_a, const Point& anchor_b,
                         bool collide_connected) {
  return {body_a,         body_b,          anchor_a.first,   anchor_a.second,
          anchor_b.first, anchor_b.second, collide_connected};
}

Point to_python(const b2Vec2& v) { return {static_cast<double>(v.x), static_cast<double>(v.y)}; }

}  // namespace

void bind_joints(WorldClass& world) {
  world.def("create_revolute_joint",
            [](World& self, Id body_a, Id body_b, const Point& anchor_a, const Point& anchor_b,
               const std::optional<AngleLimits>& limits, bool collide_connected) {
              return create_revolute_joint(
                  self, joint_bodies(body_a, body_b, anchor_a, anchor_b, collide_connected),
                  limits);
            });
  world.def("create_weld_joint", [](World& self, Id body_a, Id body_b, const Point& anchor_a,
                                    const Point& anchor_b, double reference_angle, double frequency,
                                    double damping, bool collide_connected) {
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
