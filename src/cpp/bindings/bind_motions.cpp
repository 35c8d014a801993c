#include <pybind11/stl.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/controllers.h"
#include "bindings/named.h"
#include "bindings/values.h"
#include "world/bodies.h"

namespace py = pybind11;

namespace flatland {
namespace {

double checked_share(double share) {
  if (!(share >= 0.0 && share <= 1.0)) throw py::value_error("share must be from 0 to 1");
  return share;
}

// Returns the motion of a vehicle with steered wheels.
template <typename Kind>
Kind steered_motion(double wheelbase, const PyPoint& rear_center, bool takes_twist) {
  if (!(wheelbase > 0.0)) throw py::value_error("wheelbase must be positive");
  Kind motion;
  motion.wheelbase = wheelbase;
  motion.rear_center = {rear_center[0], rear_center[1]};
  motion.takes_twist = takes_twist;
  return motion;
}

Id checked_joint(const World& world, const JointHandle& joint, const char* error) {
  const Id id = id_in(world, joint);
  if (world.read_joint(id).joint->GetType() != e_revoluteJoint) throw py::value_error(error);
  return id;
}

template <typename Kind>
auto steering_state(const ControllerHandle& self) {
  const auto& motion = motion_of<Kind>(self);
  return std::make_tuple(motion.angle, motion.angle_velocity, motion.speed, motion.target_angle);
}

template <typename Kind>
void set_steering_limits(const ControllerHandle& self, const PyLimits& linear,
                         const PyLimits& angular, double max_angle) {
  auto& motion = motion_of<Kind>(self);
  const SpeedLimits checked_linear = to_limits(linear);
  const SpeedLimits checked_angular = to_limits(angular);
  motion.max_angle = checked_limit(max_angle);
  motion.linear = checked_linear;
  motion.angular = checked_angular;
}

void bind_tricycle(py::class_<BodyHandle, Handle>& body,
                   py::class_<TricycleHandle, DriveHandle>& controller) {
  body.def(
      "control_tricycle",
      [](const BodyHandle& self, const JointHandle& front_joint, double steering_sign,
         double wheelbase, const PyPoint& rear_center, bool takes_twist) {
        const Id joint = checked_joint(self.core(), front_joint,
                                       "the joint of the front wheel must be a revolute joint");
        auto motion = steered_motion<TricycleMotion>(wheelbase, rear_center, takes_twist);
        motion.joint = joint;
        motion.steering_sign = steering_sign;
        return TricycleHandle(self.world, add_controller(self.core(), self.id, motion));
      },
      py::arg("front_joint"), py::kw_only(), py::arg("steering_sign"), py::arg("wheelbase"),
      py::arg("rear_center"), py::arg("takes_twist"), R"(
Creates a controller that steers and drives the front wheel of the body.

Args:
    front_joint: Revolute joint of the steered wheel at the origin of the body; its limits are set
        to the steering angle.
    steering_sign: Sign of the angle of the joint if the wheel is steered to the left.
    wheelbase: Distance from the rear center to the front wheel [m].
    rear_center: Midpoint of the rear wheels in the frame of the body [m].
    takes_twist: Whether commands are velocities of the rear center and yaw rates.

Raises:
    ValueError: The wheelbase is not positive.
    StaleHandleError: The body or the joint was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "set_target",
      [](const TricycleHandle& self, Named<double> linear, Named<double> angular) {
        set_command(changed_controller(self), {linear.as("linear"), 0.0, angular.as("angular")});
      },
      py::arg("linear"), py::arg("angular"), R"(
Sets the command, from the next step on.

Args:
    linear: Speed of the front wheel; of the rear center if the drive takes a twist [m/s].
    angular: Steering angle [rad]; the yaw rate if the drive takes a twist [rad/s].
)");
  controller.def("set_limits", &set_steering_limits<TricycleMotion>, py::arg("linear"),
                 py::arg("angular"), py::arg("max_angle"), R"(
Sets limits of velocity, acceleration and deceleration.

Args:
    linear: Limits of the front wheel [m/s].
    angular: Limits of the steering angle [rad/s].
    max_angle: Largest steering angle [rad], 0 for no limit.

Raises:
    ValueError: A limit is negative or NaN.
)");
  controller.def_property(
      "state", &steering_state<TricycleMotion>,
      [](const TricycleHandle& self, const std::tuple<double, double, double, double>& state) {
        auto& motion = motion_of<TricycleMotion>(self);
        std::tie(motion.angle, motion.angle_velocity, motion.speed, motion.target_angle) = state;
      },
      "The state; settable.");
}

void bind_ackermann(py::class_<BodyHandle, Handle>& body,
                    py::class_<AckermannHandle, DriveHandle>& controller) {
  body.def(
      "control_ackermann",
      [](const BodyHandle& self, double wheelbase, double track, const PyPoint& rear_center,
         const std::vector<std::pair<const JointHandle*, double>>& front_joints, bool takes_twist) {
        auto motion = steered_motion<AckermannMotion>(wheelbase, rear_center, takes_twist);
        if (!front_joints.empty() && front_joints.size() != 2) {
          throw py::value_error("a car has two joints");
        }
        for (std::size_t i = 0; i < front_joints.size(); ++i) {
          const auto& [joint, sign] = front_joints[i];
          if (joint == nullptr) throw py::type_error("a joint is required, got None");
          motion.joints[i] = checked_joint(
              self.core(), *joint, "the joints of the front wheels must be revolute joints");
          motion.steering_signs[i] = sign;
        }
        motion.track = track;
        return AckermannHandle(self.world, add_controller(self.core(), self.id, motion));
      },
      py::kw_only(), py::arg("wheelbase"), py::arg("track"), py::arg("rear_center"),
      py::arg("front_joints"), py::arg("takes_twist"), R"(
Creates a controller that steers and drives the body as a car.

Args:
    wheelbase: Distance of the axles [m].
    track: Distance of the front wheels [m].
    rear_center: Centre of the rear axle in the frame of the body [m].
    front_joints: Revolute joints of the left and the right front wheel, each with the sign of its
        angle if the wheel is steered to the left; may be empty. Their limits are set to the angles
        of the wheels.
    takes_twist: Whether commands are velocities of the rear center and yaw rates.

Raises:
    ValueError: An argument is invalid.
    StaleHandleError: The body or a joint was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "set_target",
      [](const AckermannHandle& self, Named<double> speed, Named<double> angular,
         Named<double> acceleration, Named<double> steering_velocity) {
        const double forward = speed.as("speed"), angle = angular.as("angular");
        const double change = acceleration.as("acceleration");
        const double turning = steering_velocity.as("steering_velocity");
        set_command(changed_controller(self), {forward, 0.0, angle});
        auto& motion = motion_of<AckermannMotion>(self);
        motion.acceleration = std::fabs(change);
        motion.steering_velocity = std::fabs(turning);
      },
      py::arg("speed"), py::arg("angular"), py::arg("acceleration") = 0.0,
      py::arg("steering_velocity") = 0.0, R"(
Sets the command, from the next step on.

Args:
    speed: Speed of the centre of the rear axle [m/s].
    angular: Steering angle [rad]; the yaw rate if the drive takes a twist [rad/s].
    acceleration: Limit of acceleration and deceleration besides that of the car [m/s²], 0 for none;
        the sign is ignored.
    steering_velocity: The same of the rate of the steering angle [rad/s].
)");
  controller.def(
      "set_limits",
      [](const AckermannHandle& self, const PyLimits& linear, const PyLimits& angular,
         double max_angle) {
        if (!(max_angle > 0.0 && max_angle < 1.5707)) {
          throw py::value_error("max_angle must be between 0 and 90 degrees");
        }
        set_steering_limits<AckermannMotion>(self, linear, angular, max_angle);
      },
      py::arg("linear"), py::arg("angular"), py::arg("max_angle"), R"(
Sets limits of velocity, acceleration and deceleration.

Args:
    linear: Limits of the speed [m/s].
    angular: Limits of the steering angle [rad/s].
    max_angle: Largest steering angle [rad].

Raises:
    ValueError: A limit is negative or NaN, or the angle is not between 0 and 90 degrees.
)");
  controller.def_property_readonly(
      "state", &steering_state<AckermannMotion>,
      "Steering angle [rad], its rate [rad/s], speed [m/s] and commanded angle [rad].");
}

PathHandle control_path(const BodyHandle& body, const std::vector<PyPose>& waypoints,
                        const std::string& mode, bool faces_forward, const PyLimits& linear,
                        const PyLimits& angular, double wait, std::uint64_t key) {
  World& world = body.core();
  Path path;
  if (waypoints.empty()) throw py::value_error("there must be at least one waypoint");
  path.waypoints.push_back(pose_of(world, body.id));
  path.waypoints.insert(path.waypoints.end(), waypoints.begin(), waypoints.end());
  using Mode = Path::Mode;
  path.mode = chosen<Mode>(mode, "mode",
                           {{"loop", Mode::kLoop},
                            {"once", Mode::kOnce},
                            {"there_and_back", Mode::kThereAndBack},
                            {"random", Mode::kRandom}});
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
  motion.is_dynamic = world.read_body(body.id)->GetType() == b2_dynamicBody;
  motion.key = key;
  return {body.world, add_controller(world, body.id, motion)};
}

void bind_path(py::class_<BodyHandle, Handle>& body,
               py::class_<PathHandle, ControllerHandle>& controller) {
  body.def("control_path", &control_path, py::arg("waypoints"), py::kw_only(), py::arg("mode"),
           py::arg("faces_forward"), py::arg("linear"), py::arg("angular"), py::arg("wait"),
           py::arg("key"), R"(
Creates a controller of a motion along waypoints.

Args:
    waypoints: Poses after the current pose of the body, world frame [m, rad].
    mode: `loop`, `once`, `there_and_back` or `random`.
    faces_forward: Whether the body turns towards the next waypoint and then drives there; otherwise
        it reaches the angle of a waypoint on the way.
    linear: Limits of speed [m/s], which is above 0, acceleration and deceleration [m/s²].
    angular: The same of the rotation [rad/s, rad/s²].
    wait: Time at each waypoint [s].
    key: Key of the random numbers of mode `random`, from 0 to 2^64 - 1.

Raises:
    ValueError: An argument is invalid.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "set_start",
      [](const PathHandle& self, bool is_started, std::uint64_t starts) {
        auto& motion = motion_of<PathMotion>(self);
        motion.is_started = is_started;
        motion.starts = starts;
      },
      py::arg("is_started"), py::arg("starts"), R"(
Sets whether the body moves, from the next step on.

Args:
    is_started: Whether it moves; otherwise it stops at the next waypoint.
    starts: Number of commands to start so far.
)");
  controller.def(
      "set_key",
      [](const PathHandle& self, std::uint64_t key) { motion_of<PathMotion>(self).key = key; },
      py::arg("key"), "Sets the key of the random numbers, from 0 to 2^64 - 1.");
  controller.def(
      "place",
      [](const PathHandle& self, double share) {
        b2Body* body = self.core().change_body(changed_controller(self).body);
        place_on_path(self.core(), body, motion_of<PathMotion>(self), checked_share(share));
      },
      py::arg("share"), R"(
Moves the body to where it is in a round of the waypoints.

Has no effect in mode `once`, and on a body that is not started.

Args:
    share: Time since the initial pose as a share of the duration of a round, from 0 to 1. In mode
        `random`, a round has as many motions as there are waypoints.

Raises:
    ValueError: The share is out of range.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "restart",
      [](const PathHandle& self) {
        const Id moved = changed_controller(self).body;
        restart_path(motion_of<PathMotion>(self), pose_of(self.core(), moved));
      },
      "Continues from the current pose of the body, which was moved.");
  controller.def_property_readonly(
      "state",
      [](const PathHandle& self) {
        const auto& motion = motion_of<PathMotion>(self);
        return make_value<PyPathState>(motion.waypoint, motion.next, motion.is_moving,
                                       motion.is_forward, motion.legs, motion.time,
                                       motion.used_starts, to_python(motion.pose),
                                       to_python(motion.from), motion.key);
      },
      "Everything that changes.");
}

WheelsHandle measure_wheels_of(const PyWorld& world, const PyWheels& given) {
  World& core = *world.core;
  std::vector<Wheel> wheels;
  for (const py::handle item : given) {
    const auto number = [&](const char* name) { return item.attr(name).cast<double>(); };
    const auto [x, y] = item.attr("position").cast<std::pair<double, double>>();
    const Id body = id_in(core, item.attr("body").cast<const BodyHandle&>());
    wheels.push_back({body, {x, y}, number("heading"), number("radius"), number("slide")});
    core.read_body(body);
    if (!(wheels.back().radius > 0.0)) {
      throw py::value_error("the radius of a wheel must be positive");
    }
  }
  if (wheels.empty()) throw py::value_error("there must be at least one wheel");
  RollingWheels motion;
  motion.states.resize(wheels.size());
  const Id body = wheels.front().body;
  motion.wheels = std::make_shared<const std::vector<Wheel>>(std::move(wheels));
  measure_wheels(core, motion);
  return {world, add_controller(core, body, motion)};
}

void bind_wheels(WorldClass& world, py::class_<WheelsHandle, ControllerHandle>& controller) {
  world.def("measure_wheels", &measure_wheels_of, py::arg("wheels"), R"(
Creates a controller that measures how far wheels roll.

Args:
    wheels: The wheels, at least one.

Raises:
    ValueError: There is no wheel, or a radius is not positive.
    StaleHandleError: A body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "skip",
      [](const WheelsHandle& self) { skip_motion(self.core(), motion_of<RollingWheels>(self)); },
      "Makes the next measurement start from the current poses.");
  controller.def_property_readonly(
      "states",
      [](const WheelsHandle& self) {
        std::vector<std::pair<double, double>> states;
        for (const auto& state : motion_of<RollingWheels>(self).states) {
          states.emplace_back(state.angle, state.speed);
        }
        return states;
      },
      "Angle [rad] and speed [rad/s] of each wheel, positive if it rolls forwards.");
}

void bind_tween(py::class_<BodyHandle, Handle>& body,
                py::class_<TweenHandle, ControllerHandle>& controller) {
  body.def(
      "control_tween",
      [](const BodyHandle& self, const PyPose& delta, double duration, const std::string& mode,
         const std::string& easing) {
        if (!(duration > 0.0)) throw py::value_error("duration must be positive");
        TweenMotion motion;
        using Mode = TweenMotion::Mode;
        motion.mode = chosen<Mode>(mode, "mode",
                                   {{"yoyo", Mode::kYoyo},
                                    {"loop", Mode::kLoop},
                                    {"once", Mode::kOnce},
                                    {"trigger", Mode::kTrigger}});
        motion.easing = easing_of(easing);
        motion.duration = duration;
        motion.start = motion.pose = pose_of(self.core(), self.id);
        motion.delta = delta;
        motion.is_dynamic = self.core().read_body(self.id)->GetType() == b2_dynamicBody;
        return TweenHandle(self.world, add_controller(self.core(), self.id, motion));
      },
      py::arg("delta"), py::kw_only(), py::arg("duration"), py::arg("mode"), py::arg("easing"), R"(
Creates a controller that moves the body between its pose and a pose at an offset.

Args:
    delta: Offset of the other end from the current pose [m, rad].
    duration: Duration of the motion to the other end [s].
    mode: `yoyo`, `loop`, `once` or `trigger`.
    easing: Name of the easing curve.

Raises:
    ValueError: An argument is invalid.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def(
      "set_trigger",
      [](const TweenHandle& self, bool is_triggered) {
        motion_of<TweenMotion>(self).is_triggered = is_triggered;
      },
      py::arg("is_triggered"),
      "Sets the direction of the motion in mode `trigger`, from the next step on.");
  controller.def(
      "place",
      [](const TweenHandle& self, double share) {
        b2Body* body = self.core().change_body(changed_controller(self).body);
        place_on_tween(self.core(), body, motion_of<TweenMotion>(self), checked_share(share));
      },
      py::arg("share"), R"(
Moves the body to where it is in a period of the motion.

Has no effect in the modes `once` and `trigger`.

Args:
    share: Time since the start as a share of the period, from 0 to 1; in mode `yoyo`, the period
        contains the motion back.

Raises:
    ValueError: The share is out of range.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  controller.def_property_readonly(
      "state",
      [](const TweenHandle& self) {
        const auto& motion = motion_of<TweenMotion>(self);
        return std::make_tuple(motion.progress, motion.exact_progress, motion.is_forward);
      },
      "Progress in 32 bits, exact progress, and whether the motion is forward.");
}

}  // namespace

void bind_motions(Classes& classes) {
  bind_tricycle(classes.body, classes.tricycle);
  bind_ackermann(classes.body, classes.ackermann);
  bind_path(classes.body, classes.path);
  bind_wheels(classes.world, classes.wheels);
  bind_tween(classes.body, classes.tween);
}

}  // namespace flatland
