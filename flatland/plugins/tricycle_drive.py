"""A tricycle drive: one front wheel that steers and drives, two rear wheels that follow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flatland.plugin_api.drive import Odometer, open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.parameters import at_key, read_body, read_not_negative, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.update_timer import UpdateTimer

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.joint import Joint
    from flatland.entities.model import Model
    from flatland.geometry import Vector2
    from flatland.timekeeper import Timekeeper

_TOLERANCE = 1e-5  # m, within which anchors are where they must be


class TricycleGeometry:
    """Where the wheels of a tricycle are, taken from its joints and checked.

    Attributes:
        front_joint: The revolute joint of the steered wheel.
        steering_sign: Of the front joint's angle when the wheel is steered to the left.
        rear_center: Middle between the rear wheels, body frame [m].
        wheelbase: Distance from there to the front wheel [m].
    """

    def __init__(self, config: YamlReader, model: Model, body: Body) -> None:
        """Reads the names of the joints and checks them.

        Args:
            config: The plugin's parameters.
            model: Whose joints they are.
            body: The body that the wheels are on.

        Raises:
            YamlError: A joint does not exist, is of the wrong kind or not where it must be.
        """
        front = _WheelJoint(config, "front_wheel_joint", model)
        rear_left = _WheelJoint(config, "rear_left_wheel_joint", model)
        rear_right = _WheelJoint(config, "rear_right_wheel_joint", model)
        front.check_type("revolute", "Front wheel joint must be a revolute joint")
        rear_left.check_type("weld", "Rear left wheel joint must be a weld joint")
        rear_right.check_type("weld", "Rear right wheel joint must be a weld joint")
        front_anchor = front.body_anchor(body)
        left_anchor = rear_left.body_anchor(body)
        right_anchor = rear_right.body_anchor(body)
        if _off(front_anchor, (0.0, 0.0)):
            raise front.error("Front wheel joint must have its body anchored at (0, 0)")
        self.front_joint = front.joint
        # A joint's angle counts from its body A.
        self.steering_sign = 1.0 if front.joint.bodies[0] is body else -1.0
        self.rear_center = (
            (left_anchor[0] + right_anchor[0]) / 2,
            (left_anchor[1] + right_anchor[1]) / 2,
        )
        if not _off(left_anchor, right_anchor):
            raise rear_left.error("The rear wheel joints must not have the same anchor")
        if _off(self.rear_center, _foot(front_anchor, left_anchor, right_anchor)):
            raise rear_left.error(
                "The mid point between the rear wheel anchors on the body must equal the "
                "perpendicular intersection between the rear axel (line segment between rear "
                "anchors) and the front wheel anchor"
            )
        self.wheelbase = math.dist(front_anchor, self.rear_center)
        if self.wheelbase <= _TOLERANCE:
            raise front.error("The front wheel joint must not be anchored on the rear axle")


class _WheelJoint:
    """A joint that a parameter names, and the place of that parameter for errors."""

    def __init__(self, config: YamlReader, key: str, model: Model) -> None:
        name = config.get(key, "string")
        self._place = at_key(config, key)
        joint = model.find_joint(name)
        if joint is None:
            raise self.error(f'Joint with name "{name}" does not exist')
        self.joint: Joint = joint

    def error(self, text: str) -> Exception:
        return self._place.error(text)

    def check_type(self, kind: str, text: str) -> None:
        if self.joint.type != kind:
            raise self.error(text)

    def body_anchor(self, body: Body) -> Vector2:
        """Returns the anchor on the body, after checks of the one on the wheel."""
        (ax, ay), (bx, by) = self.joint.anchors.tolist()
        if self.joint.bodies[0] is body:
            anchor, wheel_anchor = (ax, ay), (bx, by)
        elif self.joint.bodies[1] is body:
            anchor, wheel_anchor = (bx, by), (ax, ay)
        else:
            raise self.error(f'Joint "{self.joint.name}" does not anchor on body "{body.name}"')
        if _off(wheel_anchor, (0.0, 0.0)):
            raise self.error(f'Joint "{self.joint.name}" must be anchored at (0, 0) on the wheel')
        return anchor


def _off(point: Vector2, target: Vector2) -> bool:
    return abs(point[0] - target[0]) > _TOLERANCE or abs(point[1] - target[1]) > _TOLERANCE


def _foot(point: Vector2, start: Vector2, end: Vector2) -> Vector2:
    """Returns the foot of the perpendicular from a point to the line through two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / (dx * dx + dy * dy)
    return (start[0] + along * dx, start[1] + along * dy)


class TricycleDrive(ModelPlugin):
    """Steers and drives the front wheel as commanded; the body follows without slip.

    Attributes:
        geometry: Of the wheels.
        steering_angle: Of the front wheel, counter-clockwise [rad].
        steering_velocity: [rad/s].
        front_velocity: Speed of the front wheel along its heading [m/s].
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, checks the joints and declares the ports.

        Raises:
            YamlError: A parameter is wrong.
            PluginError: A topic is no legal name.
        """
        self.body = read_body(config, self.model)
        self.timer = UpdateTimer(read_rate(config, "pub_rate"))
        self.max_steer_angle = read_not_negative(config, "max_steer_angle", 0.0)
        self.linear_dynamics = DynamicsLimits.from_config(
            config.optional_subnode("linear_dynamics", "map")
        )
        self.angular_dynamics = self._read_angular_dynamics(config)
        self.geometry = TricycleGeometry(config, self.model, self.body)
        # Unlike the reference: odometry is in its own frame, not in that of the ground truth.
        self._odometer = Odometer(self, config, self.body, twist_in_local_frame=False)
        self._command = open_twist_command(self, config.get("twist_sub", "string", "cmd_vel"))
        self.steering_angle = 0.0
        self.steering_velocity = 0.0
        self.front_velocity = 0.0
        self._shown_angle: float | None = None

    @staticmethod
    def _read_angular_dynamics(config: YamlReader) -> DynamicsLimits:
        """Reads the limits of the steering, also from the keys that older files have."""
        limits = DynamicsLimits.from_config(config.optional_subnode("angular_dynamics", "map"))
        velocity = read_not_negative(config, "max_angular_velocity", 0.0)
        acceleration = read_not_negative(config, "max_steer_acceleration", 0.0)
        if limits.acceleration_limit or not acceleration:
            acceleration, deceleration = limits.acceleration_limit, limits.deceleration_limit
        else:
            deceleration = acceleration
        return DynamicsLimits(limits.velocity_limit or velocity, acceleration, deceleration)

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Reports the motion so far, then steers and sets the body's velocity."""
        body = self.body
        pose = body.pose
        if self.timer.check_update(timekeeper):
            self._odometer.begin_update()
            if self._odometer.wanted:
                self._odometer.report(timekeeper.sim_time_ns, pose, body.velocity)
        dt = timekeeper.step_size
        command = self._command.value
        self._steer(command.angular_z, dt)
        v = self.front_velocity = self.linear_dynamics.limit(
            self.front_velocity, command.linear_x, dt
        )
        geometry = self.geometry
        steering_angle = self.steering_angle
        omega = v * math.sin(steering_angle) / geometry.wheelbase
        # The rear centre moves straight ahead; from there to the origin, in the body frame.
        forward = v * math.cos(steering_angle) + omega * geometry.rear_center[1]
        sideways = -omega * geometry.rear_center[0]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        body.set_velocity(c * forward - s * sideways, s * forward + c * sideways, omega)

    def _steer(self, target: float, dt: float) -> None:
        """Turns the front wheel towards an angle as fast as the limits allow."""
        remaining = target - self.steering_angle
        acceleration = self.angular_dynamics.acceleration_limit
        if acceleration and abs(remaining) < self.steering_velocity**2 / (2 * acceleration):
            # Braking now just stops there.
            velocity = 0.0
        else:
            velocity = remaining / dt
        self.steering_velocity = self.angular_dynamics.limit(self.steering_velocity, velocity, dt)
        angle = self.steering_angle + self.steering_velocity * dt
        most = self.max_steer_angle
        if most:
            angle = min(max(angle, -most), most)
        self.steering_angle = angle
        if angle != self._shown_angle:
            self._shown_angle = angle
            shown = angle * self.geometry.steering_sign
            self.geometry.front_joint.set_limits(shown, shown)
