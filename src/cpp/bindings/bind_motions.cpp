#include <pybind11/stl.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "world/bodies.h"

namespace py = pybind11;

namespace flatland {
namespace {

void bind_ackermann(WorldClass& world) {
  world.def(
      "add_ackermann_controller",
      [](World& self, Id body, double wheelbase, double track,
         const std::pair<double, double>& rear, const std::vector<std::pair<Id, double>>& joints,
         bool takes_twist) {
        AckermannMotion motion;
        if (!(wheelbase > 0.0)) throw py::value_error("wheelbase must be positive");
        if (!joints.empty() && joints.size() != 2) throw py::value_error("a car has two joints");
        for (std::size_t i = 0; i < joints.size(); ++i) {
          if (self.read_joint(joints[i].first).joint->GetType() != e_revoluteJoint) {
            throw py::value_error("the joints of the front wheels must be revolute joints");
          }
          motion.joints[i] = joints[i].first;
          motion.steering_signs[i] = joints[i].second;
        }
        motion.wheelbase = wheelbase;
        motion.track = track;
        motion.rear_center[0] = rear.first;
        motion.rear_center[1] = rear.second;
        motion.takes_twist = takes_twist;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("wheelbase"), py::arg("track"), py::arg("rear_center"),
      py::arg("joints"), py::arg("takes_twist"));
  world.def("set_ackermann_limits",
            [](World& self, Id id, const Limits& linear, const Limits& angular, double max_angle) {
              auto& motion = motion_of<AckermannMotion>(self, id);
              const SpeedLimits checked_linear = to_limits(linear);
              const SpeedLimits checked_angular = to_limits(angular);
              if (!(max_angle > 0.0 && max_angle < 1.5707)) {
                throw py::value_error("max_angle must be between 0 and 90 degrees");
              }
              motion.max_angle = max_angle;
              motion.linear = checked_linear;
              motion.angular = checked_angular;
            });
  world.def("set_ackermann_target", [](World& self, Id id, double speed, double angular) {
    motion_of<AckermannMotion>(self, id).target = {speed, 0.0, angular};
  });
  world.def("ackermann_state", [](World& self, Id id) {
    const auto& motion = motion_of<AckermannMotion>(self, id);
    return py::make_tuple(motion.angle, motion.angle_velocity, motion.speed, motion.target_angle);
  });
}

void bind_omni(WorldClass& world) {
  world.def(
      "add_omni_controller",
      [](World& self, Id body, const std::vector<PyTriple>& wheels, double wheel_speed,
         double wheel_acceleration) {
        std::vector<Triple> rows;
        for (const PyTriple& row : wheels) rows.push_back(from_python(row));
        OmniMotion motion;
        motion.wheels = std::make_shared<const std::vector<Triple>>(std::move(rows));
        motion.wheel_speed = checked_limit(wheel_speed);
        motion.wheel_acceleration = checked_limit(wheel_acceleration);
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("wheels"), py::arg("wheel_speed"), py::arg("wheel_acceleration"));
  world.def("set_omni_limits", [](World& self, Id id, const Limits& linear, const Limits& angular) {
    auto& motion = motion_of<OmniMotion>(self, id);
    const SpeedLimits checked = to_limits(linear);
    motion.angular = to_limits(angular);
    motion.linear = checked;
  });
  world.def("set_omni_target",
            [](World& self, Id id, double forward, double sideways, double omega) {
              motion_of<OmniMotion>(self, id).target = {forward, sideways, omega};
            });
  world.def("omni_velocity",
            [](World& self, Id id) { return to_python(motion_of<OmniMotion>(self, id).velocity); });
}

// The traction of a drive, null for other controllers.
Traction* traction_of(Motion& motion) {
  return std::visit(
      [](auto& kind) -> Traction* {
        using Kind = std::decay_t<decltype(kind)>;
        if constexpr (std::is_same_v<Kind, TweenMotion> || std::is_same_v<Kind, PathMotion> ||
                      std::is_same_v<Kind, RollingWheels>) {
          return nullptr;
        } else {
          return &kind.traction;
        }
      },
      motion);
}

Traction& changed_traction(World& world, Id id) {
  Traction* traction = traction_of(changed_controller(world, id).motion);
  if (traction == nullptr) throw PhysicsError("the controller has no traction");
  return *traction;
}

void bind_traction(WorldClass& world) {
  world.def(
      "set_traction",
      [](World& self, Id id, const std::vector<Id>& bodies, bool is_holonomic, bool acts_at_center,
         double max_force, double max_torque, double grip, double radius) {
        Traction& traction = changed_traction(self, id);
        const Id driven = changed_controller(self, id).body;
        if (self.read_body(driven)->GetType() != b2_dynamicBody) {
          throw py::value_error("a drive with forces needs a dynamic body");
        }
        for (const Id body : bodies) self.read_body(body);
        Traction changed;
        changed.max_force = checked_limit(max_force);
        changed.max_torque = checked_limit(max_torque);
        changed.grip = checked_limit(grip);
        changed.radius = checked_limit(radius);
        changed.is_enabled = true;
        changed.is_holonomic = is_holonomic;
        changed.acts_at_center = acts_at_center;
        changed.bodies = std::make_shared<const std::vector<Id>>(bodies);
        traction = changed;
      },
      py::arg("controller"), py::arg("bodies"), py::arg("is_holonomic"), py::arg("acts_at_center"),
      py::arg("max_force"), py::arg("max_torque"), py::arg("grip"), py::arg("radius"));
  world.def("release_brakes",
            [](World& self, Id id) { changed_traction(self, id).is_braked = false; });
  world.def("traction_state", [](World& self, Id id) {
    const Traction& traction = changed_traction(self, id);
    return py::make_tuple(traction.load, traction.is_braked, to_python(traction.brake_pose));
  });
}

Path::Mode path_mode(const std::string& name) {
  if (name == "loop") return Path::Mode::kLoop;
  if (name == "once") return Path::Mode::kOnce;
  if (name == "there_and_back") return Path::Mode::kThereAndBack;
  if (name == "random") return Path::Mode::kRandom;
  throw py::value_error("mode must be one of: loop, once, there_and_back, random, got \"" + name +
                        "\"");
}

void bind_path(WorldClass& world) {
  world.def(
      "add_path_controller",
      [](World& self, Id body, const std::vector<PyTriple>& waypoints, const std::string& mode,
         bool faces_forward, const Limits& linear, const Limits& angular, double wait,
         std::uint64_t key) {
        Path path;
        if (waypoints.empty()) throw py::value_error("there must be at least one waypoint");
        path.waypoints.push_back(pose_of(self, body));
        for (const PyTriple& each : waypoints) path.waypoints.push_back(from_python(each));
        path.mode = path_mode(mode);
        path.faces_forward = faces_forward;
        path.linear = to_limits(linear);
        path.angular = to_limits(angular);
        path.wait = checked_limit(wait);
        if (!(path.linear.velocity > 0.0 && path.angular.velocity > 0.0)) {
          throw py::value_error("the limits of velocity must be positive");
        }
        PathMotion motion;
        motion.pose = path.waypoints.front();
        motion.path = std::make_shared<const Path>(std::move(path));
        motion.is_dynamic = self.read_body(body)->GetType() == b2_dynamicBody;
        motion.key = key;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("waypoints"), py::arg("mode"), py::arg("faces_forward"),
      py::arg("linear"), py::arg("angular"), py::arg("wait"), py::arg("key"));
  world.def("set_path_start", [](World& self, Id id, bool is_started, std::uint64_t starts) {
    auto& motion = motion_of<PathMotion>(self, id);
    motion.is_started = is_started;
    motion.starts = starts;
  });
  world.def("set_path_key", [](World& self, Id id, std::uint64_t key) {
    motion_of<PathMotion>(self, id).key = key;
  });
  world.def("restart_path", [](World& self, Id id) {
    const Id body = changed_controller(self, id).body;
    restart_path(motion_of<PathMotion>(self, id), pose_of(self, body));
  });
  // Last waypoint, next one, whether it moves, direction, number of legs, time of this leg, starts,
  // pose, pose at the beginning of the leg, key.
  world.def("path_state", [](World& self, Id id) {
    const auto& motion = motion_of<PathMotion>(self, id);
    return py::make_tuple(motion.waypoint, motion.next, motion.is_moving, motion.is_forward,
                          motion.legs, motion.time, motion.used_starts, to_python(motion.pose),
                          to_python(motion.from), motion.key);
  });
}

void bind_wheels(WorldClass& world) {
  // A wheel is (body, x, y, heading, radius, slide).
  using PyWheel = std::tuple<Id, double, double, double, double, double>;
  world.def("add_rolling_wheels", [](World& self, const std::vector<PyWheel>& given) {
    if (given.empty()) throw py::value_error("there must be at least one wheel");
    std::vector<Wheel> wheels;
    for (const auto& [body, x, y, heading, radius, slide] : given) {
      self.read_body(body);
      if (!(radius > 0.0)) throw py::value_error("the radius of a wheel must be positive");
      wheels.push_back({body, x, y, heading, radius, slide});
    }
    RollingWheels motion;
    motion.states.resize(wheels.size());
    const Id body = wheels.front().body;
    motion.wheels = std::make_shared<const std::vector<Wheel>>(std::move(wheels));
    measure_wheels(self, motion);
    return add_controller(self, body, motion);
  });
  world.def("skip_wheel_motion",
            [](World& self, Id id) { skip_motion(self, motion_of<RollingWheels>(self, id)); });
  world.def("wheel_states", [](World& self, Id id) {
    std::vector<std::pair<double, double>> states;
    for (const auto& state : motion_of<RollingWheels>(self, id).states) {
      states.emplace_back(state.angle, state.speed);
    }
    return states;
  });
}

}  // namespace

void bind_motions(WorldClass& world) {
  bind_ackermann(world);
  bind_omni(world);
  bind_traction(world);
  bind_path(world);
  bind_wheels(world);
}

}  // namespace flatland
