"""AckermannDrive: the single track, the angles of the wheels, limits, commands and errors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.recording import Replay
from flatland.values import AckermannCommand
from tests.support.steps import control_bodies

WHEEL = "footprints: [{type: circle, radius: 0.05, density: 1, collision: false}]"
BODIES = f"""
- name: base
  footprints: [{{type: circle, radius: 0.4, center: [1, 0.1], density: 100}}]
- {{name: fl, pose: [2.5, 0.8, 0], {WHEEL}}}
- {{name: fr, pose: [2.5, -0.8, 0], {WHEEL}}}
- {{name: rl, pose: [0.5, 0.8, 0], {WHEEL}}}
- {{name: rr, pose: [0.5, -0.8, 0], {WHEEL}}}
"""
ANCHORS = {"fl": (2.5, 0.8), "fr": (2.5, -0.8), "rl": (0.5, 0.8), "rr": (0.5, -0.8)}
WHEELBASE, TRACK, REAR = 2.0, 1.6, 0.5


def joints(**changes: tuple[float, float]) -> str:
    lines = []
    for name, anchor in {**ANCHORS, **changes}.items():
        kind = "revolute" if name.startswith("f") else "weld"
        ends = [f"{{name: base, anchor: {list(anchor)}}}", f"{{name: {name}, anchor: [0, 0]}}"]
        if name == "fr":  # the order of the bodies of a joint does not matter
            ends.reverse()
        lines.append(f"- {{type: {kind}, name: {name}_j, bodies: [{', '.join(ends)}]}}")
    return "\n".join(lines)


def drive(text: str = "", limit: float = 0.8) -> str:
    return (
        "[{type: AckermannDrive, name: drive, body: base, front_left_wheel_joint: fl_j, "
        "front_right_wheel_joint: fr_j, rear_left_wheel_joint: rl_j, "
        f"rear_right_wheel_joint: rr_j, max_steer_angle: {limit}, {text}}}]"
    )


@pytest.fixture
def car(plugin_world: Any) -> Any:
    def load(text: str = "", **options: Any) -> flatland.World:
        limit = options.pop("limit", 0.8)
        options = {"bodies": BODIES, "joints": joints(), **options}
        world: flatland.World = plugin_world(drive(text, limit), **options)
        return world

    return load


def command(world: flatland.World, v: float, angular: float) -> None:
    world.command("/cmd_vel").set(flatland.Twist(v, 0.0, angular))


def plugin(world: flatland.World) -> Any:
    return world.model("robot").plugin("drive")


def base(world: flatland.World) -> flatland.Body:
    return world.model("robot").body("base")


class TestMotion:
    def test_twist_moves_the_rear_center(self, car: Any) -> None:
        world = car(pose=(0.0, 0.0, 0.7))
        command(world, 1.2, 0.3)
        control_bodies(world)
        vx, vy, omega = base(world).velocity
        assert omega == pytest.approx(0.3, abs=1e-5)
        c, s = math.cos(0.7), math.sin(0.7)
        rear = (vx - omega * s * REAR, vy + omega * c * REAR)
        assert rear == pytest.approx((1.2 * c, 1.2 * s), abs=1e-5)
        assert plugin(world).steering_angle == pytest.approx(math.atan(WHEELBASE * 0.3 / 1.2))

    def test_circle_of_the_single_track(self, car: Any) -> None:
        world = car("command: steering")
        command(world, 1.0, 0.5)
        radius = WHEELBASE / math.tan(0.5)
        world.step(round(math.pi * radius / 0.005))
        x, y, theta = base(world).pose
        rear = (x + REAR * math.cos(theta), y + REAR * math.sin(theta))
        centre = (rear[0] - radius * math.sin(theta), rear[1] + radius * math.cos(theta))
        assert centre == pytest.approx((REAR, radius), abs=0.02)
        assert theta == pytest.approx(math.pi, abs=0.01)

    @pytest.mark.parametrize(
        ("limit", "speed", "rate", "angle"),
        [
            (0.8, -1.0, 0.3, -math.atan(WHEELBASE * 0.3)),
            (0.4, 1.0, 5.0, 0.4),  # The angle is limited, and not the speed.
        ],
    )
    def test_backwards_and_with_a_limited_angle(
        self, car: Any, limit: float, speed: float, rate: float, angle: float
    ) -> None:
        world = car(limit=limit)
        command(world, speed, rate)
        control_bodies(world)
        assert plugin(world).steering_angle == pytest.approx(angle)
        expected = speed * math.tan(angle) / WHEELBASE
        assert base(world).velocity[2] == pytest.approx(expected, abs=1e-5)

    def test_no_turn_in_place_and_a_stop_keeps_the_angle(self, car: Any) -> None:
        world = car()
        command(world, 0.0, 1.0)
        world.step()
        assert plugin(world).steering_angle == pytest.approx(0.8)
        assert base(world).velocity == pytest.approx((0, 0, 0), abs=1e-6)
        command(world, 0.0, 0.0)
        world.step()
        assert plugin(world).steering_angle == pytest.approx(0.8)

    def test_limits_of_speed_steering_rate_and_acceleration(self, car: Any) -> None:
        world = car(
            "command: steering, linear_dynamics: {velocity_limit: 1, acceleration_limit: 0.5}, "
            "angular_dynamics: {velocity_limit: 0.2}"
        )
        command(world, 3.0, 0.7)
        world.step(200)
        assert plugin(world).speed == pytest.approx(0.5)
        assert plugin(world).steering_angle == pytest.approx(0.2)
        world.step(600)
        assert plugin(world).speed == pytest.approx(1.0)
        assert plugin(world).steering_angle == pytest.approx(0.7)


class TestWheels:
    @pytest.mark.parametrize("angle", [0.6, -0.35, 0.0])
    def test_axes_of_the_front_wheels_meet_on_the_rear_axle(self, car: Any, angle: float) -> None:
        world = car("command: steering")
        command(world, 0.3, angle)
        world.step(50)
        yaw = base(world).pose[2]
        for name in ("fl", "fr"):
            # The angle of the line to the centre of the turn is that of the axle of the wheel.
            turn = WHEELBASE / math.tan(angle) if angle else math.inf
            heading = world.model("robot").body(name).pose[2] - yaw
            expected = math.atan(WHEELBASE / (turn - ANCHORS[name][1]))
            assert heading == pytest.approx(expected, abs=2e-3), name

    def test_geometry_of_the_joints_equals_that_of_parameters(
        self, car: Any, plugin_world: Any
    ) -> None:
        geometry = plugin(car()).geometry
        assert (geometry.wheelbase, geometry.track) == pytest.approx((WHEELBASE, TRACK))
        assert geometry.rear_center == pytest.approx((REAR, 0.0))
        plain = plugin_world(
            "[{type: AckermannDrive, name: drive, body: base, wheelbase: 2, rear_axle: [0.5, 0], "
            "max_steer_angle: 0.8}]"
        )
        jointed = car()
        for world in (plain, jointed):
            command(world, 1.0, 0.4)
            world.step(100)
        assert base(plain).pose == pytest.approx(base(jointed).pose, abs=2e-3)


class TestAckermannCommand:
    def test_command_contains_limits(self, car: Any) -> None:
        world = car("command: ackermann, linear_dynamics: {acceleration_limit: 2}")
        world.command("/ackermann_cmd").set(AckermannCommand(0.5, 0.25, 1.0, 0.5))
        world.step(200)
        assert plugin(world).steering_angle == pytest.approx(0.25)
        assert plugin(world).speed == pytest.approx(0.5)
        world.command("/ackermann_cmd").set(AckermannCommand(0.5, 0.0, 1.5, 0.0))
        world.step(40)
        assert plugin(world).steering_angle == pytest.approx(0.5)
        assert plugin(world).speed == pytest.approx(0.5 + 2 * 0.2)
        # Only the size of an acceleration counts.
        world.command("/ackermann_cmd").set(AckermannCommand(0.5, 0.0, 1.5, -1.0))
        world.step(40)
        assert plugin(world).speed == pytest.approx(0.5 + 2 * 0.2 + 1 * 0.2)

    def test_commands_are_recorded(self, car: Any, tmp_path: Path) -> None:
        world = car("command: ackermann")
        world.record(tmp_path / "run.flog")
        world.command("/ackermann_cmd").set(AckermannCommand(0.5, 0.25, 1.0, 0.5))
        world.step(200)
        world.close()
        replay = Replay(tmp_path / "run.flog")
        replay.run()
        replay.close()
        assert (replay.difference, replay.last_step) == (None, 200)

    def test_invalid_commands_are_rejected(self, car: Any) -> None:
        world = car("command: ackermann")
        world.command("/ackermann_cmd").set(AckermannCommand(speed=1.0))
        world.command("/ackermann_cmd").set(AckermannCommand(speed=math.nan))
        world.step()
        assert plugin(world).speed == 1.0


def test_odometry_and_twist(car: Any) -> None:
    world = car("odom_frame_id: odom2, odom_pose_noise: [0.01, 0.01, 0], pub_rate: 50")
    truth, odometry = world.output("/odometry/ground_truth"), world.output("/odometry/filtered")
    twist = world.output("/twist")
    command(world, 1.0, 0.2)
    world.step(100)
    assert truth.latest.twist[2] == pytest.approx(0.2, abs=1e-4)
    assert odometry.latest.frame_id == "odom2"
    assert odometry.latest.pose != truth.latest.pose
    assert np.diag(odometry.latest.pose_covariance)[0] == 0.01
    assert twist.latest.twist == pytest.approx((1.0, 0.0, 0.2), abs=1e-2)


@pytest.mark.parametrize(
    ("key", "moved", "message"),
    [
        ("command", {}, 'Invalid "command", must be one of: twist, steering, ackermann, got drive'),
        ("front_right", {"fr": (2.4, -0.8)}, "The wheels of the front axle must have the same x"),
        ("rear_left", {"rl": (0.5, -0.9)}, "The left wheel of the rear axle must have a greater y"),
        ("front_left", {"rl": (0.5, 0.9)}, "The centres of both axles must have the same y"),
        ("front_left", {"rl": (3, 0.8), "rr": (3, -0.8)}, "The front axle must have a greater x"),
        (
            "front_left",
            {name: (2, y) for name, y in [("fl", 1), ("fr", -1), ("rl", 1), ("rr", -1)]},
            "The front axle must have a greater x",
        ),
    ],
)
def test_errors(plugin_world: Any, key: str, moved: Any, message: str) -> None:
    bodies = BODIES
    for name, (x, y) in moved.items():
        bodies = bodies.replace(
            f"name: {name}, pose: {[*ANCHORS[name], 0]}", f"name: {name}, pose: {[x, y, 0]}"
        )
    # Each parameter on a line of its own.
    text = drive("command: drive" if key == "command" else "").replace(", ", ",\n  ")
    error = plugin_world.error(text, bodies=bodies, joints=joints(**moved))
    assert message in error
    lines = (plugin_world.files.folder / "robot.model.yaml").read_text().splitlines()
    (number,) = (number for number, line in enumerate(lines, 1) if line.strip().startswith(key))
    assert f"robot.model.yaml:{number}]" in error
