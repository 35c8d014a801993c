"""Random calls of the controllers of the physics engine: drives and prescribed motions."""

from __future__ import annotations

import random

from flatland.physics import (
    Controller,
    DriveController,
    PhysicsBody,
    PhysicsJoint,
    PhysicsWorld,
    RollingWheel,
    SpeedLimits,
    easings,
)


class ControllerCalls:
    """The part of `RandomCalls` that creates controllers of bodies."""

    rng: random.Random
    world: PhysicsWorld

    def number(self, low: float = -5.0, high: float = 5.0) -> float:
        raise NotImplementedError

    def positive(self, high: float = 2.0) -> float:
        raise NotImplementedError

    def pair(self) -> tuple[float, float]:
        raise NotImplementedError

    def triple(self) -> tuple[float, float, float]:
        raise NotImplementedError

    def body(self) -> PhysicsBody:
        raise NotImplementedError

    def some_bodies(self) -> list[PhysicsBody]:
        raise NotImplementedError

    def joint(self) -> PhysicsJoint:
        raise NotImplementedError

    def _speed_limits(self) -> SpeedLimits:
        return (self.positive(), self.rng.choice([0.0, self.positive()]), self.positive())

    def _start_controller(self, controller: Controller) -> None:
        """Moves a controller to a random place in the order of steps."""
        controller.set_place(self.rng.randint(0, 3), self.rng.randint(0, 3))

    def _start_drive(self, body: PhysicsBody, controller: DriveController) -> None:
        if self.rng.random() < 0.5:
            controller.set_traction(
                [body, *self.some_bodies()],
                holonomic=self.rng.random() < 0.5,
                at_center=self.rng.random() < 0.5,
                max_force=self.positive(100.0),
                max_torque=self.positive(100.0),
                grip=self.positive(10.0),
                radius=self.rng.choice([0.0, self.positive()]),
            )
            controller.release_brakes()
        self._start_controller(controller)

    def do_control_velocity(self) -> None:
        body = self.body()
        controller = body.control_velocity(
            (0.0, abs(self.number(0.0, 3.0)), 1.0), holonomic=self.rng.random() < 0.5
        )
        controller.set_target(*self.rng.choice([self.triple(), (0.0, 0.0, 0.0)]))
        self._start_drive(body, controller)

    def do_control_tween(self) -> None:
        mode = self.rng.choice(["yoyo", "loop", "once", "trigger", "none"])
        controller = self.body().control_tween(
            self.triple(),
            duration=self.number(0.01, 2.0),
            mode=mode,
            easing=self.rng.choice(easings()),
        )
        self._start_controller(controller)

    def do_control_car(self) -> None:
        body = self.body()
        joints = [(self.joint(), self.rng.choice([1.0, -1.0])) for _ in range(2)]
        controller = body.control_ackermann(
            wheelbase=self.positive(),
            track=self.positive(),
            rear_center=self.pair(),
            front_joints=self.rng.choice([[], joints]),
            takes_twist=self.rng.random() < 0.5,
        )
        controller.set_limits(self._speed_limits(), self._speed_limits(), self.positive(1.5))
        controller.set_target(*self.pair())
        self._start_drive(body, controller)

    def do_control_omni(self) -> None:
        body = self.body()
        controller = body.control_omni(
            [self.triple() for _ in range(self.rng.randint(0, 4))],
            wheel_speed=self.positive(),
            wheel_acceleration=self.positive(),
        )
        controller.set_limits(self._speed_limits(), self._speed_limits())
        controller.set_target(*self.triple())
        self._start_drive(body, controller)

    def do_control_path(self) -> None:
        controller = self.body().control_path(
            [self.triple() for _ in range(self.rng.randint(0, 4))],
            mode=self.rng.choice(["loop", "once", "there_and_back", "random", "none"]),
            faces_forward=self.rng.random() < 0.5,
            linear=self._speed_limits(),
            angular=self._speed_limits(),
            wait=self.rng.choice([0.0, self.positive()]),
            key=self.rng.randrange(2**64),
        )
        controller.set_start(self.rng.random() < 0.9, self.rng.randint(0, 3))
        self._start_controller(controller)
        if self.rng.random() < 0.3:
            controller.restart()

    def do_measure_wheels(self) -> None:
        wheels = [
            RollingWheel(body, self.pair(), self.number(), self.positive(), self.number())
            for body in self.some_bodies()
        ]
        controller = self.world.measure_wheels(wheels)
        self._start_controller(controller)
        if self.rng.random() < 0.3:
            controller.skip()
        if len(controller.states) != len(wheels):
            raise AssertionError("wheels are missing")
