"""The motion and the contacts of included plugins as plugins in Python, called in every step.

They are what the core does for `DiffDrive`, `TricycleDrive`, `Tween` and `Bumper`, written with
hooks only: the results must be equal bit by bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flatland import Contact, ContactImpulse, ModelPlugin, Timekeeper, Twist, YamlReader
from flatland.plugin_api.drive import open_twist_command
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugins.tricycle_drive import TricycleGeometry


def limits(config: YamlReader, key: str) -> DynamicsLimits:
    """Reads limits of a drive."""
    return DynamicsLimits.from_config(config.optional_subnode(key, "map"))


class PythonDrive(ModelPlugin):
    """A differential drive."""

    def on_initialize(self, config: YamlReader) -> None:
        self.body = self.model.body(config.get("body", "string"))
        self.linear, self.angular = (
            limits(config, "linear_dynamics"),
            limits(config, "angular_dynamics"),
        )
        self.command_ = open_twist_command(self, "cmd_vel")
        self.v = self.omega = 0.0

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        command, dt = self.command_.value, timekeeper.step_size
        self.v = self.linear.limit(self.v, command.linear_x, dt)
        self.omega = self.angular.limit(self.omega, command.angular_z, dt)
        yaw = self.body.pose[2]
        self.body.set_velocity(self.v * math.cos(yaw), self.v * math.sin(yaw), self.omega)


class PythonTricycle(ModelPlugin):
    """A tricycle drive."""

    def on_initialize(self, config: YamlReader) -> None:
        self.body = self.model.body(config.get("body", "string"))
        self.linear, self.angular = (
            limits(config, "linear_dynamics"),
            limits(config, "angular_dynamics"),
        )
        self.max_angle = config.get("max_steer_angle", "float", 0.0)
        self.geometry = TricycleGeometry(config, self.model, self.body)
        self.takes_twist = config.get("command", "string", "steering") == "twist"
        self.command_ = open_twist_command(self, "cmd_vel")
        self.target = self.angle = self.rate = self.speed = 0.0

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        command, dt, yaw = self.command_.value, timekeeper.step_size, self.body.pose[2]
        speed = command.linear_x
        if self.takes_twist:
            speed = self._steer_for_twist(command, dt)
        else:
            self._steer(command.angular_z, dt)
        v = self.speed = self.linear.limit(self.speed, speed, dt)
        omega = v * math.sin(self.angle) / self.geometry.wheelbase
        forward = v * math.cos(self.angle) + omega * self.geometry.rear_center[1]
        sideways = -omega * self.geometry.rear_center[0]
        c, s = math.cos(yaw), math.sin(yaw)
        self.body.set_velocity(c * forward - s * sideways, s * forward + c * sideways, omega)

    def _steer_for_twist(self, command: Twist, dt: float) -> float:
        v, across = command.linear_x, self.geometry.wheelbase * command.angular_z
        if v or across:
            angle = math.atan2(-across if v < 0 else across, abs(v))
            if self.max_angle and abs(angle) > self.max_angle:
                angle = math.copysign(self.max_angle, angle)
                across = v * math.tan(angle)
            self.target = angle
        self._steer(self.target, dt)
        speed = math.copysign(math.hypot(v, across), v if v else 1.0)
        return speed * max(0.0, math.cos(self.target - self.angle))

    def _steer(self, target: float, dt: float) -> None:
        remaining, acceleration = target - self.angle, self.angular.acceleration_limit
        stops = acceleration and abs(remaining) < self.rate**2 / (2 * acceleration)
        self.rate = self.angular.limit(self.rate, 0.0 if stops else remaining / dt, dt)
        self.angle += self.rate * dt
        if self.max_angle:
            self.angle = min(max(self.angle, -self.max_angle), self.max_angle)
        joint_angle = self.angle * self.geometry.steering_sign
        self.geometry.front_joint.set_limits(joint_angle, joint_angle)


class PythonTween(ModelPlugin):
    """A prescribed motion to and fro with the easing `cubicInOut`."""

    def on_initialize(self, config: YamlReader) -> None:
        self.body = self.model.body(config.get("body", "string"))
        self.delta = config.get_list("delta", "float", size=3)
        self.duration = config.get("duration", "float")
        self.start = self.body.pose
        self.progress, self.exact, self.forward = np.float32(0.0), 0.0, True
        self.pose = self.start

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        if self.progress in (0.0, 1.0):
            self.forward = self.progress == 0.0
        step = min(timekeeper.step_size / self.duration, 1.0) * (1 if self.forward else -1)
        self.progress += np.float32(step)
        self.exact += step
        if abs(float(self.progress) - self.exact) > 1e-5:
            self.progress = np.float32(self.exact)
        end = 1.0 if self.forward else 0.0
        if self.progress >= 1.0 if self.forward else self.progress < 1e-5:
            self.progress, self.exact = np.float32(end), end
        p = float(self.progress)
        eased = (2.0 * p) ** 3 / 2.0 if p < 0.5 else 1.0 - (2.0 - 2.0 * p) ** 3 / 2.0
        if p in (0.0, 1.0):
            eased = p
        self.pose = tuple(a + b * eased for a, b in zip(self.start, self.delta, strict=True))
        self._hold()

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        self._hold()

    def _hold(self) -> None:
        self.body.set_pose(*self.pose)
        self.body.set_velocity(0.0, 0.0, 0.0)


class ContactWitness(ModelPlugin):
    """Collects (bodies, forces, points, normals) of the contacts of its model, by step."""

    def on_initialize(self, config: YamlReader) -> None:
        self.touches: dict[int, tuple[str, str, str, float]] = {}
        self.solved: dict[int, list[tuple[Contact, ContactImpulse]]] = {}
        self.steps: list[list[Any]] = []

    def begin_contact(self, contact: Contact) -> None:
        mine = self.filter_contact(contact)
        if mine is not None:
            sign = 1.0 if mine.is_a else -1.0
            names = (mine.this_body.name, mine.other_entity.name, mine.other_body.name)
            self.touches[contact.contact_id] = (*names, sign)

    def end_contact(self, contact: Contact) -> None:
        self.touches.pop(contact.contact_id, None)

    def post_solve(self, contact: Contact, impulse: ContactImpulse) -> None:
        if contact.contact_id in self.touches:
            self.solved.setdefault(contact.contact_id, []).append((contact, impulse))

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        found = []
        for contact_id, (*names, sign) in self.touches.items():
            calls = self.solved.get(contact_id, [])
            points, forces, normal = [], [], [0.0, 0.0]
            if calls:
                last = calls[-1][0]
                points, normal = last.points.tolist(), (sign * last.normal).tolist()
                total = np.zeros((2, len(points)))
                for _, impulse in calls:
                    n = min(len(points), len(impulse.normal_impulses))
                    total[0, :n] += impulse.normal_impulses[:n]
                    total[1, :n] += impulse.tangent_impulses[:n]
                mean = np.hypot(total[0], total[1]) / (len(calls) * timekeeper.step_size)
                forces = mean.tolist()
            found.append((names, forces, points, [normal] * len(points)))
        self.steps.append(found)
        self.solved.clear()
