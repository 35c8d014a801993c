#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "bindings/named.h"
#include "world/easing.h"

namespace py = pybind11;

namespace flatland {
namespace {

void bind_controller(py::class_<ControllerHandle, Handle>& controller) {
  controller.def(
      "remove",
      [](const ControllerHandle& self) {
        changed_controller(self);
        self.core().jobs().remove_controller(self.id);
      },
      R"(
Removes the controller; the body keeps its velocity.

Raises:
    StaleHandleError: The controller has already been removed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "set_place",
      [](const ControllerHandle& self, std::int64_t order, std::int64_t number) {
        changed_controller(self).place = {order, number};
        self.core().jobs().place_changed();
      },
      py::arg("order"), py::arg("number"), R"(
Sets the place of the controller in the order of a step; see `JobQueue`.

Raises:
    StaleHandleError: The controller was removed.
    WorldLockedError: The world is stepping.
)");
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

Traction& changed_traction(const DriveHandle& drive) {
  Traction* traction = traction_of(changed_controller(drive).motion);
  if (traction == nullptr) throw PhysicsError("the controller has no traction");
  return *traction;
}

void set_traction(const DriveHandle& drive, const Bodies& bodies, bool holonomic, bool at_center,
                  double max_force, double max_torque, double grip, double radius) {
  const World& world = drive.core();
  Traction& traction = changed_traction(drive);
  if (world.read_body(changed_controller(drive).body)->GetType() != b2_dynamicBody) {
    throw py::value_error("a drive with forces needs a dynamic body");
  }
  std::vector<Id> ids = existing_ids_in(world, bodies);
  Traction changed;
  changed.max_force = checked_limit(max_force);
  changed.max_torque = checked_limit(max_torque);
  changed.grip = checked_limit(grip);
  changed.radius = checked_limit(radius);
  changed.is_enabled = true;
  changed.is_holonomic = holonomic;
  changed.acts_at_center = at_center;
  changed.bodies = std::make_shared<const std::vector<Id>>(std::move(ids));
  traction = changed;
}

void bind_drive(py::class_<DriveHandle, ControllerHandle>& drive) {
  drive.def("set_traction", &set_traction, py::arg("bodies"), py::kw_only(), py::arg("holonomic"),
            py::arg("at_center"), py::arg("max_force"), py::arg("max_torque"), py::arg("grip"),
            py::arg("radius"), R"(
Makes the drive push its body with bounded forces instead of setting the velocity.

Args:
    bodies: The driven body, and those that move with it as if they were rigid.
    holonomic: Whether the motors push in all directions, or only forwards and backwards.
    at_center: Whether the forces act at the common centre of mass, as those of a car, or at the
        origin of the body, as those of a single axle.
    max_force: Force of the motors [N].
    max_torque: Torque of the motors [N m].
    grip: Friction coefficient on the ground times gravity [m/s²]; may be infinite.
    radius: Radius at which the friction acts [m], 0 for the radius of gyration.

Raises:
    ValueError: A limit is negative or NaN, or the body is not dynamic.
    StaleHandleError: The controller was removed, or a body destroyed.
    WorldLockedError: The world is stepping.
)");
  drive.def(
      "set_command_timeout",
      [](const DriveHandle& self, std::int64_t limit) {
        if (limit < 0) throw py::value_error("a limit must not be negative");
        CommandTimeout& timeout = changed_controller(self).timeout;
        timeout = {limit, std::min(timeout.age, limit)};
      },
      py::arg("limit"), R"(
Makes the drive stop if it has not received a command for some time, as a command of zeros does.

Args:
    limit: The simulated time without a command [ns], 0 for no limit.

Raises:
    ValueError: The limit is negative.
)");
  drive.def_property_readonly(
      "command_age", [](const DriveHandle& self) { return changed_controller(self).timeout.age; },
      "Simulated time since the last command, up to the limit of this time [ns].");
  drive.def(
      "release_brakes", [](const DriveHandle& self) { changed_traction(self).is_braked = false; },
      "Makes the brakes hold the pose at the next step, for a body that was moved.");
  drive.def_property_readonly(
      "traction_state",
      [](const DriveHandle& self) {
        const Traction& traction = changed_traction(self);
        return std::make_tuple(traction.load, traction.is_braked, to_python(traction.brake_pose));
      },
      R"(
Part of the limits that the last step required, and the pose that the brakes hold.

The part is above 1 if the drive slipped or stalled. The second value is whether the drive is braked.
)");
}

// The members of the controllers whose commands are velocities (forward, sideways, omega).
template <typename Kind, typename Class>
void bind_velocities(Class& controller) {
  controller.def(
      "set_target",
      [](const ControllerHandle& self, Named<double> forward, Named<double> sideways,
         Named<double> omega) {
        // A velocity that is out of range is refused when it is applied to the body.
        set_command(changed_controller(self),
                    {forward.as("forward"), sideways.as("sideways"), omega.as("omega")});
      },
      py::arg("forward"), py::arg("sideways"), py::arg("omega"),
      "Sets the commanded velocity, from the next step on.");
  controller.def_property_readonly(
      "velocity",
      [](const ControllerHandle& self) { return to_python(motion_of<Kind>(self).velocity); },
      "The commanded velocity within the limits, as of the last step.");
}

template <typename Kind>
void set_limits(const ControllerHandle& controller, const PyLimits& linear,
                const PyLimits& angular) {
  auto& motion = motion_of<Kind>(controller);
  const SpeedLimits checked = to_limits(linear);
  motion.angular = to_limits(angular);
  motion.linear = checked;
}

void bind_velocity(py::class_<BodyHandle, Handle>& body,
                   py::class_<VelocityHandle, DriveHandle>& controller) {
  body.def(
      "control_velocity",
      [](const BodyHandle& self, const PyLimits& linear, const PyLimits& angular, bool holonomic) {
        TwistMotion motion;
        motion.is_holonomic = holonomic;
        motion.linear = to_limits(linear);
        motion.angular = to_limits(angular);
        return VelocityHandle(self.world, add_controller(self.core(), self.id, motion));
      },
      py::arg("linear") = PyLimits{}, py::arg("angular") = PyLimits{}, py::kw_only(),
      py::arg("holonomic") = true, R"(
Creates a controller that sets the velocity of the body in its own frame in each step.

The core carries it out before the hooks of plugins, in a tenth of the time of a hook that calls
`set_velocity`. The commanded velocity is initially 0.

Args:
    linear: Limits of the forward and sideways velocity [m/s], acceleration and deceleration
        [m/s²]; 0 for no limit.
    angular: Limits of the angular velocity [rad/s], acceleration and deceleration [rad/s²]; 0 for
        no limit.
    holonomic: Whether the body can move sideways.

Returns:
    The controller, which sets the commanded velocity.

Raises:
    ValueError: A limit is negative or NaN.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def_property_readonly(
      "target",
      [](const VelocityHandle& self) { return to_python(motion_of<TwistMotion>(self).target); },
      "The commanded velocity.");
  bind_velocities<TwistMotion>(controller);
  controller.def(
      "set_velocity",
      [](const VelocityHandle& self, Named<double> forward, Named<double> sideways,
         Named<double> omega) {
        motion_of<TwistMotion>(self).velocity = {forward.as("forward"), sideways.as("sideways"),
                                                 omega.as("omega")};
      },
      py::arg("forward"), py::arg("sideways"), py::arg("omega"),
      "Sets the velocity from which the limits of acceleration are applied.");
  controller.def("set_limits", &set_limits<TwistMotion>, py::arg("linear"), py::arg("angular"), R"(
Sets limits of velocity [m/s, rad/s], acceleration and deceleration.

Args:
    linear: Limits of the forward velocity, and of the sideways velocity.
    angular: Limits of the angular velocity.

Raises:
    ValueError: A limit is negative or NaN.
)");
}

void bind_omni(py::class_<BodyHandle, Handle>& body,
               py::class_<OmniHandle, DriveHandle>& controller) {
  body.def(
      "control_omni",
      [](const BodyHandle& self, const std::vector<PyPose>& wheels, double wheel_speed,
         double wheel_acceleration) {
        OmniMotion motion;
        motion.wheels = std::make_shared<const std::vector<Triple>>(wheels.begin(), wheels.end());
        motion.wheel_speed = checked_limit(wheel_speed);
        motion.wheel_acceleration = checked_limit(wheel_acceleration);
        return OmniHandle(self.world, add_controller(self.core(), self.id, motion));
      },
      py::arg("wheels"), py::kw_only(), py::arg("wheel_speed"), py::arg("wheel_acceleration"), R"(
Creates a controller of a holonomic drive.

Args:
    wheels: For each wheel, the factors of the velocity (forward, sideways, omega) of the body in
        the speed at which its rim rolls.
    wheel_speed: Largest speed of the rims [m/s], 0 for no limit.
    wheel_acceleration: Largest acceleration of the rims [m/s²], 0 for no limit.

Raises:
    ValueError: A limit is negative or NaN.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  bind_velocities<OmniMotion>(controller);
  controller.def("set_limits", &set_limits<OmniMotion>, py::arg("linear"), py::arg("angular"), R"(
Sets limits of velocity [m/s, rad/s], acceleration and deceleration.

Args:
    linear: Limits of the speed, and of the acceleration along each axis of the body.
    angular: Limits of the angular velocity.

Raises:
    ValueError: A limit is negative or NaN.
)");
}

}  // namespace

void bind_controllers(py::module_& module, Classes& classes) {
  bind_controller(classes.controller);
  bind_drive(classes.drive);
  bind_velocity(classes.body, classes.velocity);
  bind_omni(classes.body, classes.omni);
  module.def(
      "ease", [](const std::string& easing, double p) { return easing_of(easing)(p); },
      py::arg("easing"), py::arg("p"), R"(
Returns the fraction of the path that an easing curve covers at some progress.

Raises:
    ValueError: The easing does not exist.
)");
  module.def("easings", &easing_names, "Returns the names of all easing curves.");
}

}  // namespace flatland
