"""OmniDrive: holonomic motion, limits of wheels, odometry and errors."""

from __future__ import annotations

import math
from typing import Any

import pytest

import flatland
from flatland.plugin_api.wheels import GroundWheel, mecanum_wheels, three_wheels


def drive(text: str = "") -> str:
    return f"[{{type: OmniDrive, name: drive, body: base, {text}}}]"


MECANUM = "layout: mecanum, wheelbase: 0.5, track: 0.3"
THREE = "layout: three_wheel, wheel_distance: 0.2, wheel_angle: 0"


def command(world: flatland.World, x: float, y: float, omega: float) -> None:
    world.command("/cmd_vel").set(flatland.Twist(x, y, omega))


def plugin(world: flatland.World) -> Any:
    return world.model("robot").plugin("drive")


def base(world: flatland.World) -> flatland.Body:
    return world.model("robot").body("base")


def test_motion_in_the_frame_of_the_body(plugin_world: Any) -> None:
    world = plugin_world(drive(), pose=(1.0, 2.0, 0.5))
    command(world, 0.6, 0.4, 0.0)
    world.step(200)
    c, s = math.cos(0.5), math.sin(0.5)
    expected = (1 + 0.6 * c - 0.4 * s, 2 + 0.6 * s + 0.4 * c, 0.5)
    assert base(world).pose == pytest.approx(expected, abs=1e-4)


def test_circle_while_turning(plugin_world: Any) -> None:
    """With a constant velocity in the frame of the body, the path is a circle."""
    world = plugin_world(drive(), step_size=0.001)
    command(world, 0.3, 0.4, 0.5)
    world.step(4000)
    radius, start, theta = 0.5 / 0.5, math.atan2(0.4, 0.3), 2.0
    x = radius * (math.sin(start + theta) - math.sin(start))
    y = -radius * (math.cos(start + theta) - math.cos(start))
    assert base(world).pose == pytest.approx((x, y, theta), abs=2e-3)


class TestWheels:
    def test_rows_of_mecanum_wheels(self) -> None:
        """The inverse kinematics of four mecanum wheels with l + w = 0.4 m."""
        rows = [wheel.row() for wheel in mecanum_wheels(0.5, 0.3)]
        expected = [(1, -1, -0.4), (1, 1, 0.4), (1, 1, -0.4), (1, -1, 0.4)]
        assert rows == [pytest.approx(row) for row in expected]

    def test_rows_of_three_wheels(self) -> None:
        rows = [wheel.row() for wheel in three_wheels(0.2, 0.0)]
        expected = [(-math.sin(a), math.cos(a), 0.2) for a in (0, math.tau / 3, 2 * math.tau / 3)]
        assert rows == [pytest.approx(row) for row in expected]

    def test_row_is_the_solution_of_the_velocities(self) -> None:
        wheel = GroundWheel((0.3, -0.2), heading=0.4, slide=1 / math.tan(0.9))
        v, w = (0.7, -0.3), 1.1
        a, b, c = wheel.row()
        speed = a * v[0] + b * v[1] + c * w
        point = (v[0] + 0.2 * w, v[1] + 0.3 * w)
        free = (math.cos(0.4 + 0.9), math.sin(0.4 + 0.9))
        rest = (point[0] - speed * math.cos(0.4), point[1] - speed * math.sin(0.4))
        assert rest[0] * free[1] - rest[1] * free[0] == pytest.approx(0.0, abs=1e-12)

    @pytest.mark.parametrize("layout", [MECANUM, THREE], ids=["mecanum", "three"])
    def test_speed_limit_keeps_the_direction(self, plugin_world: Any, layout: str) -> None:
        world = plugin_world(drive(f"{layout}, max_wheel_speed: 0.5"))
        command(world, 2.0, 1.0, 3.0)
        world.step()
        velocity = plugin(world).velocity
        assert max(abs(s) for s in plugin(world).wheel_speeds) == pytest.approx(0.5)
        assert velocity[0] / 2 == pytest.approx(velocity[1]) == pytest.approx(velocity[2] / 3)

    def test_known_speeds(self, plugin_world: Any) -> None:
        """Diagonally, a mecanum drive moves with two wheels only, at half the speed."""
        world = plugin_world(drive(f"{MECANUM}, max_wheel_speed: 1"))
        command(world, 5.0, 5.0, 0.0)
        world.step()
        assert plugin(world).wheel_speeds == pytest.approx((0, 1, 1, 0))
        assert plugin(world).velocity == pytest.approx((0.5, 0.5, 0.0))

    @pytest.mark.parametrize("layout", [MECANUM, THREE], ids=["mecanum", "three"])
    def test_wheel_acceleration_in_all_steps(self, plugin_world: Any, layout: str) -> None:
        world = plugin_world(drive(f"{layout}, max_wheel_speed: 0.8, max_wheel_acceleration: 2"))
        before = plugin(world).wheel_speeds
        for target in ((1.0, 0.2, 0.0), (-1.0, 0.5, 2.0), (0.0, -1.0, -1.0), (0.0, 0.0, 0.0)):
            command(world, *target)
            steps = 0
            while True:
                last = plugin(world).velocity
                world.step()
                speeds = plugin(world).wheel_speeds
                changes = [abs(a - b) for a, b in zip(speeds, before, strict=True)]
                assert max(changes) <= 2 * 0.005 + 1e-12
                assert max(map(abs, speeds)) <= 0.8 + 1e-12
                before = speeds
                if plugin(world).velocity == last:
                    break
                steps += 1
                assert steps < 500
        assert plugin(world).velocity == (0.0, 0.0, 0.0)


def test_limits_of_the_body(plugin_world: Any) -> None:
    world = plugin_world(
        drive(
            "linear_dynamics: {velocity_limit: 0.5, acceleration_limit: 1}, "
            "angular_dynamics: {velocity_limit: 0.4}"
        )
    )
    command(world, 3.0, 4.0, 0.0)
    world.step(50)
    # The components change in proportion; the faster one has the limit of 1 m/s^2.
    assert plugin(world).velocity == pytest.approx((0.75 * 0.25, 0.25, 0.0))
    world.step(100)
    assert plugin(world).velocity == pytest.approx((0.3, 0.4, 0.0))
    command(world, 0.0, 0.0, 1.0)
    world.step(200)
    assert plugin(world).velocity == pytest.approx((0.0, 0.0, 0.4))


def test_odometry_measures_sideways_motion(plugin_world: Any) -> None:
    world = plugin_world(drive("odom_twist_noise: [0, 0.01, 0]"), pose=(0, 0, 1.0))
    truth, twist = world.output("/odometry/ground_truth"), world.output("/twist")
    command(world, 0.3, 0.4, 0.0)
    world.step(10)
    assert truth.latest.twist == pytest.approx((0.3, 0.4, 0.0), abs=1e-5)
    assert twist.latest.twist[0] == pytest.approx(0.3, abs=1e-5)
    assert abs(twist.latest.twist[1] - 0.4) > 1e-4
