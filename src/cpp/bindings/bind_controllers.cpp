#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "world/bodies.h"
#include "world/easing.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

void bind_tricycle(WorldClass& world) {
  world.def(
      "add_tricycle_controller",
      [](World& self, Id body, Id joint, double steering_sign, double wheelbase,
         const std::pair<double, double>& rear_center, bool takes_twist) {
        if (self.read_joint(joint).joint->GetType() != e_revoluteJoint) {
          throw py::value_error("the joint of the front wheel must be a revolute joint");
        }
        TricycleMotion motion;
        motion.joint = joint;
        motion.steering_sign = steering_sign;
        if (!(wheelbase > 0.0)) throw py::value_error("wheelbase must be positive");
        motion.wheelbase = wheelbase;
        motion.rear_center[0] = rear_center.first;
        motion.rear_center[1] = rear_center.second;
        motion.takes_twist = takes_twist;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("joint"), py::arg("steering_sign"), py::arg("wheelbase"),
      py::arg("rear_center"), py::arg("takes_twist"));
  world.def("set_tricycle_limits",
            [](World& self, Id id, const Limits& linear, const Limits& angular, double max_angle) {
              auto& motion = motion_of<TricycleMotion>(self, id);
              const SpeedLimits checked_linear = to_limits(linear);
              const SpeedLimits checked_angular = to_limits(angular);
              motion.max_angle = checked_limit(max_angle);
              motion.linear = checked_linear;
              motion.angular = checked_angular;
            });
  world.def("set_tricycle_target", [](World& self, Id id, double linear, double angular) {
    motion_of<TricycleMotion>(self, id).target = {linear, 0.0, angular};
  });
  world.def("tricycle_state", [](World& self, Id id) {
    const auto& motion = motion_of<TricycleMotion>(self, id);
    return py::make_tuple(motion.angle, motion.angle_velocity, motion.speed, motion.target_angle);
  });
  world.def("set_tricycle_state", [](World& self, Id id, double angle, double angle_velocity,
                                     double speed, double target_angle) {
    auto& motion = motion_of<TricycleMotion>(self, id);
    motion.angle = angle;
    motion.angle_velocity = angle_velocity;
    motion.speed = speed;
    motion.target_angle = target_angle;
  });
}

TweenMotion::Mode tween_mode(const std::string& name) {
  using Mode = TweenMotion::Mode;
  if (name == "yoyo") return Mode::kYoyo;
  if (name == "loop") return Mode::kLoop;
  if (name == "once") return Mode::kOnce;
  if (name == "trigger") return Mode::kTrigger;
  throw py::value_error("mode must be one of: yoyo, loop, once, trigger, got \"" + name + "\"");
}

void bind_tween(WorldClass& world) {
  world.def(
      "add_tween_controller",
      [](World& self, Id body, const PyTriple& delta, double duration, const std::string& mode,
         const std::string& easing) {
        if (!(duration > 0.0)) throw py::value_error("duration must be positive");
        TweenMotion motion;
        motion.mode = tween_mode(mode);
        motion.easing = easing_of(easing);
        motion.duration = duration;
        motion.start = motion.pose = pose_of(self, body);
        motion.delta = {std::get<0>(delta), std::get<1>(delta), std::get<2>(delta)};
        motion.is_dynamic = self.read_body(body)->GetType() == b2_dynamicBody;
        return add_controller(self, body, motion);
      },
      py::arg("body"), py::arg("delta"), py::arg("duration"), py::arg("mode"), py::arg("easing"));
  world.def("set_tween_trigger", [](World& self, Id id, bool is_triggered) {
    motion_of<TweenMotion>(self, id).is_triggered = is_triggered;
  });
  world.def("tween_state", [](World& self, Id id) {
    const auto& motion = motion_of<TweenMotion>(self, id);
    return py::make_tuple(motion.progress, motion.exact_progress, motion.is_forward);
  });
  world.def("hold_controller", [](World& self, Id id) {
    Controller& controller = changed_controller(self, id);
    hold(self, self.change_body(controller.body), controller.motion);
  });
}

}  // namespace

void bind_controllers(py::module_& module, WorldClass& world) {
  module.def("ease", [](const std::string& easing, double p) { return easing_of(easing)(p); });
  module.def("easings", &easing_names);
  world.def("add_twist_controller", [](World& self, Id body, bool is_holonomic) {
    TwistMotion motion;
    motion.is_holonomic = is_holonomic;
    return add_controller(self, body, motion);
  });
  world.def("set_twist_limits",
            [](World& self, Id id, const Limits& linear, const Limits& angular) {
              auto& motion = motion_of<TwistMotion>(self, id);
              const SpeedLimits checked = to_limits(linear);
              motion.angular = to_limits(angular);
              motion.linear = checked;
            });
  world.def("twist_target",
            [](World& self, Id id) { return to_python(motion_of<TwistMotion>(self, id).target); });
  world.def("set_twist_target",
            [](World& self, Id id, double forward, double sideways, double omega) {
              // A velocity that is out of range is refused when it is applied to the body.
              motion_of<TwistMotion>(self, id).target = {forward, sideways, omega};
            });
  world.def("twist_velocity", [](World& self, Id id) {
    return to_python(motion_of<TwistMotion>(self, id).velocity);
  });
  world.def("set_twist_velocity",
            [](World& self, Id id, double forward, double sideways, double omega) {
              motion_of<TwistMotion>(self, id).velocity = {forward, sideways, omega};
            });
  bind_tricycle(world);
  bind_tween(world);
  bind_motions(world);
  world.def("has_controller",
            [](World& self, Id id) { return self.plan().find_controller(id) != nullptr; });
  world.def("remove_controller", [](World& self, Id id) {
    changed_controller(self, id);
    self.plan().remove_controller(id);
  });
  world.def(
      "schedule_controller",
      [](World& self, Id id, std::int64_t order, bool is_automatic, bool holds) {
        Controller& controller = changed_controller(self, id);
        controller.order = order;
        controller.is_automatic = is_automatic;
        controller.holds = holds && has_hold(controller.motion);
        self.plan().order_changed();
      },
      py::arg("controller"), py::arg("order"), py::arg("is_automatic"), py::arg("holds"));
  world.def("advance_controller", [](World& self, Id id, double dt) {
    self.plan().advance_now(self, changed_controller(self, id), dt);
  });
  world.def("take_failed_controllers", [](World& self) {
    self.check_changeable();
    return self.plan().take_failed();
  });
}

}  // namespace flatland
