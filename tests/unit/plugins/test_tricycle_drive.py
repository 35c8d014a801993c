from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland.values import Odometry
from tests.support.steps import control_bodies

Collect = Callable[[flatland.World, str], list[Any]]

WHEEL = "footprints: [{type: circle, radius: 0.05, density: 1, collision: false}]"
# The rear axle is 1 m behind the front wheel at the origin; the center of mass is elsewhere.
BODIES = f"""
- name: base
  footprints: [{{type: circle, radius: 0.3, center: [-0.4, 0.1], density: 100}}]
- {{name: front, {WHEEL}}}
- {{name: left, pose: [-1, 0.4, 0], {WHEEL}}}
- {{name: right, pose: [-1, -0.4, 0], {WHEEL}}}
"""
ANCHORS = {"front": "[0, 0]", "left": "[-1, 0.4]", "right": "[-1, -0.4]"}
TRUTH = "/odometry/ground_truth"
ODOMETRY = "/odometry/filtered"


def joint(
    name: str,
    kind: str,
    wheel: str,
    anchor: str,
    *,
    on: str = "base",
    wheel_anchor: str = "[0, 0]",
    base_first: bool = True,
) -> str:
    ends = [f"{{name: {on}, anchor: {anchor}}}", f"{{name: {wheel}, anchor: {wheel_anchor}}}"]
    if not base_first:
        ends.reverse()
    return f"- {{type: {kind}, name: {name}, bodies: [{', '.join(ends)}]}}"


def joints(**changes: str) -> str:
    usual = (at(name, anchor)[name] for name, anchor in ANCHORS.items())
    return "\n".join({**dict(zip(ANCHORS, usual, strict=True)), **changes}.values())


def at(name: str, anchor: str, **options: Any) -> dict[str, str]:
    """Returns a joint that differs from the usual one in some options."""
    kind = options.pop("kind", "revolute" if name == "front" else "weld")
    return {name: joint(f"{name}_j", kind, name, anchor, **options)}


def drive(extra: str = "", front: str = "front_j", left: str = "left_j") -> str:
    return (
        f"- {{type: TricycleDrive, name: wheels, body: base, front_wheel_joint: {front}, "
        f"rear_left_wheel_joint: {left}, rear_right_wheel_joint: right_j, {extra}}}"
    )


@pytest.fixture
def trike(plugin_world: Any) -> Callable[..., flatland.World]:
    def load(extra: str = "", **options: Any) -> flatland.World:
        options = {"bodies": BODIES, "joints": joints(), **options}
        world: flatland.World = plugin_world(drive(extra), **options)
        return world

    return load


def command(world: flatland.World, v: float, angle: float) -> None:
    world.command("/cmd_vel").set(flatland.Twist(linear_x=v, angular_z=angle))


def plugin(world: flatland.World) -> Any:
    return world.model("robot").plugin("wheels")


def base(world: flatland.World) -> flatland.Body:
    return world.model("robot").body("base")


class TestMotion:
    def test_rear_center_moves_along_the_heading(self, trike: Any) -> None:
        # A slanted axle whose midpoint is the foot of the perpendicular from the origin.
        line = joints(**at("left", "[-1.76, 1.4]"), **at("right", "[-2.24, -0.2]"))
        world = trike(pose=(0.0, 0.0, 0.7), joints=line)
        command(world, 0.6, 0.5)
        geometry = plugin(world).geometry
        assert geometry.rear_center == pytest.approx((-2.0, 0.6), abs=1e-6)
        assert geometry.wheelbase == pytest.approx(math.hypot(2.0, 0.6), abs=1e-6)
        control_bodies(world)
        vx, vy, omega = base(world).velocity
        assert omega == pytest.approx(0.6 * math.sin(0.5) / math.hypot(2.0, 0.6), abs=1e-5)
        c, s = math.cos(0.7), math.sin(0.7)
        rx, ry = -c * 2.0 - s * 0.6, -s * 2.0 + c * 0.6
        rear = (vx - omega * ry, vy + omega * rx)
        forward = 0.6 * math.cos(0.5)
        assert rear == pytest.approx((forward * c, forward * s), abs=1e-5)

    def test_robot_drives_a_circle_about_a_point_on_the_rear_axle_line(self, trike: Any) -> None:
        world = trike()
        command(world, 0.5, math.pi / 4)
        world.step(2)
        for _ in range(50):
            world.step(20)
            x, y, theta = base(world).pose
            # The center of rotation is on the line of the axle, 1 m to the left of the rear center.
            rear = (x - math.cos(theta), y - math.sin(theta))
            centre = (rear[0] - math.sin(theta), rear[1] + math.cos(theta))
            assert centre == pytest.approx((-1.0, 1.0), abs=0.02)


class TestSteering:
    def steps(self, world: flatland.World, target: float, n: int) -> list[float]:
        command(world, 0.0, target)
        angles = []
        for _ in range(n):
            world.step()
            angles.append(plugin(world).steering_angle)
        return angles

    @pytest.mark.parametrize(
        ("extra", "target", "expected"),
        [
            ("max_steer_angle: 0", 3.0, [3.0]),  # no limit
            ("max_steer_angle: 0.7", 3.0, [0.7] * 2),
            ("max_steer_angle: 0.7", -3.0, [-0.7] * 2),  # at any speed
            ("angular_dynamics: {velocity_limit: 2.0}", 0.025, [0.01, 0.02, 0.025, 0.025]),
            ("max_angular_velocity: 2.0", 0.025, [0.01, 0.02, 0.025, 0.025]),
            ("angular_dynamics: {acceleration_limit: 4.0}", 1.0, [1e-4, 3e-4, 6e-4]),
            ("max_steer_acceleration: 4.0", 1.0, [1e-4, 3e-4, 6e-4]),
        ],
    )
    def test_limits(self, trike: Any, extra: str, target: float, expected: list[float]) -> None:
        world = trike(extra)
        assert self.steps(world, target, len(expected)) == pytest.approx(expected)
        if "acceleration" in extra:
            assert plugin(world).steering_velocity == pytest.approx(0.06)

    def test_steering_deceleration_starts_at_the_stopping_distance(self, trike: Any) -> None:
        world = trike("angular_dynamics: {acceleration_limit: 4.0}")
        drive = plugin(world)
        controller = drive._controller
        controller.state = (0.0, 1.0, 0.0, 0.0)  # the stopping distance is 0.125 rad
        command(world, 0.0, 0.125)
        world.step()
        assert drive.steering_velocity == pytest.approx(1.0 + 4.0 * 0.005)
        controller.state = (0.0, 1.0, 0.0, 0.125)
        command(world, 0.0, 0.1249)
        world.step()
        assert drive.steering_velocity == pytest.approx(1.0 - 4.0 * 0.005)

    @pytest.mark.parametrize(
        ("extra", "expected"),
        [
            # `angular_dynamics` takes precedence over the older keys.
            (
                "max_angular_velocity: 1, max_steer_acceleration: 2, angular_dynamics: "
                "{velocity_limit: 3, acceleration_limit: 4, deceleration_limit: 5}",
                (3, 4, 5),
            ),
            # The older key limits the deceleration as well.
            ("max_steer_acceleration: 2, angular_dynamics: {deceleration_limit: 5}", (0, 2, 2)),
            ("angular_dynamics: {deceleration_limit: 5}", (0, 0, 5)),
        ],
    )
    def test_limits_of_both_spellings(
        self, trike: Any, extra: str, expected: tuple[float, ...]
    ) -> None:
        assert plugin(trike(extra)).angular_dynamics.as_tuple() == expected

    @pytest.mark.parametrize(("base_first", "sign"), [(True, 1.0), (False, -1.0)])
    def test_the_front_joint_has_the_steering_angle(
        self, trike: Any, base_first: bool, sign: float
    ) -> None:
        front = at("front", "[0, 0]", base_first=base_first)
        world = trike("max_angular_velocity: 2", joints=joints(**front))
        command(world, 0.2, 0.4)
        world.step(100)
        limits = world.model("robot").joint("front_j").limits
        assert limits == pytest.approx((sign * 0.4, sign * 0.4), abs=1e-6)
        wheel = world.model("robot").body("front").pose[2]
        assert wheel - base(world).pose[2] == pytest.approx(0.4, abs=0.01)

    def test_linear_dynamics(self, trike: Any) -> None:
        world = trike("linear_dynamics: {acceleration_limit: 1.0, velocity_limit: 0.012}")
        command(world, 5.0, 0.0)
        speeds = []
        for _ in range(4):
            world.step()
            speeds.append(plugin(world).front_velocity)
        assert speeds == pytest.approx([0.005, 0.01, 0.012, 0.012])


class TestOdometry:
    def test_messages_have_the_state_before_the_command(self, trike: Any, collect: Collect) -> None:
        world = trike(pose=(1.0, 2.0, 0.5))
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        command(world, 0.6, 0.0)
        world.step(2)
        assert isinstance(truths[0], Odometry)
        assert [value.stamp for value in truths] == [0, 5_000_000]
        assert truths[0].pose == pytest.approx((1.0, 2.0, 0.5), abs=1e-6)
        assert truths[0].twist == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        assert odometry[1].pose == truths[1].pose
        assert truths[1].pose[0] == pytest.approx(1.0 + 0.003 * math.cos(0.5), abs=1e-4)
        # No transform and no twist topic by default.
        assert world.transforms == {}
        assert sorted(world.ports.outputs) == [ODOMETRY, TRUTH]

    @pytest.mark.parametrize(("extra", "heading"), [("", 0.5), ("twist_in_local_frame: true", 0.0)])
    def test_twist_is_in_the_world_frame_by_default(
        self, trike: Any, collect: Collect, extra: str, heading: float
    ) -> None:
        world = trike(extra, pose=(0.0, 0.0, 0.5))
        truths, odometry = collect(world, TRUTH), collect(world, ODOMETRY)
        command(world, 0.6, 0.0)
        world.step(3)
        expected = (0.6 * math.cos(heading), 0.6 * math.sin(heading), 0.0)
        assert odometry[-1].twist == pytest.approx(expected, abs=1e-3)
        assert truths[-1].twist == pytest.approx(expected, abs=1e-3)


class TestTwistCommand:
    """`command: twist`: the speed of the rear center, 1 m behind the origin, and the yaw rate."""

    def rear(self, world: flatland.World) -> tuple[float, float, float]:
        """Returns the velocity of the rear center in the frame of the body, and the yaw rate."""
        vx, vy, omega = base(world).velocity
        theta = base(world).pose[2]
        c, s = math.cos(theta), math.sin(theta)
        return (c * vx + s * vy, c * vy - s * vx - omega, omega)

    @pytest.mark.parametrize(
        ("v", "omega", "angle", "speed"),
        [
            (0.6, 0.0, 0.0, 0.6),
            (0.6, 0.8, math.atan2(0.8, 0.6), 1.0),
            (0.6, -0.8, -math.atan2(0.8, 0.6), 1.0),
            (-0.6, 0.0, 0.0, -0.6),
            # Backwards, to the left seen from above: the wheel points to the right.
            (-0.6, 0.8, -math.atan2(0.8, 0.6), -1.0),
            (-0.6, -0.8, math.atan2(0.8, 0.6), -1.0),
            (0.0, 0.5, math.pi / 2, 0.5),
            (0.0, -0.5, -math.pi / 2, 0.5),
            (-0.0, 0.5, math.pi / 2, 0.5),
            (0.0, 0.0, 0.0, 0.0),
        ],
    )
    def test_steering_angle_and_speeds(
        self, trike: Any, v: float, omega: float, angle: float, speed: float
    ) -> None:
        world = trike("command: twist", pose=(0.0, 0.0, 0.7))
        command(world, v, omega)
        control_bodies(world)
        assert plugin(world).steering_angle == pytest.approx(angle)
        assert plugin(world).front_velocity == pytest.approx(speed)
        assert self.rear(world) == pytest.approx((v, 0.0, omega), abs=1e-5)

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_beyond_the_steering_limit_the_speed_is_kept(self, trike: Any, sign: float) -> None:
        world = trike("command: twist, max_steer_angle: 0.5")
        command(world, sign * 0.6, 2.0)
        control_bodies(world)
        assert plugin(world).steering_angle == pytest.approx(sign * 0.5)
        assert self.rear(world) == pytest.approx((sign * 0.6, 0.0, 0.6 * math.tan(0.5)), abs=1e-5)

    def test_a_limit_of_the_speed_keeps_the_curvature(self, trike: Any) -> None:
        world = trike("command: twist, linear_dynamics: {velocity_limit: 0.25}")
        command(world, 0.6, 0.8)
        control_bodies(world)
        assert self.rear(world) == pytest.approx((0.15, 0.0, 0.2), abs=1e-5)

    def test_another_wheelbase(self, trike: Any) -> None:
        moved = joints(**at("left", "[-0.5, 0.4]"), **at("right", "[-0.5, -0.4]"))
        world = trike("command: twist", bodies=BODIES.replace("[-1, ", "[-0.5, "), joints=moved)
        command(world, 0.6, 0.8)
        control_bodies(world)
        assert plugin(world).steering_angle == pytest.approx(math.atan2(0.5 * 0.8, 0.6))
        assert base(world).velocity[2] == pytest.approx(0.8, abs=1e-5)

    def test_no_turn_in_place_below_ninety_degrees(self, trike: Any) -> None:
        world = trike("command: twist, max_steer_angle: 1.5")
        command(world, 0.0, 1.0)
        world.step(50)
        assert plugin(world).steering_angle == 1.5
        assert base(world).pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)

    def test_the_robot_waits_for_its_front_wheel(self, trike: Any) -> None:
        world = trike("command: twist, angular_dynamics: {velocity_limit: 1.0}")
        command(world, 0.0, 1.0)
        for _ in range(200):
            control_bodies(world)
            angle = plugin(world).steering_angle
            assert plugin(world).front_velocity == pytest.approx(math.sin(angle), abs=1e-9)
        # More than 90 degrees from the target.
        command(world, 0.3, -0.9)
        control_bodies(world)
        assert plugin(world).front_velocity == 0.0

    def test_a_command_to_stop_keeps_the_steering_angle(self, trike: Any) -> None:
        world = trike("command: twist")
        command(world, 0.6, 0.8)
        world.step()
        command(world, 0.0, 0.0)
        world.step(3)
        assert plugin(world).steering_angle == pytest.approx(math.atan2(0.8, 0.6))
        assert base(world).velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        *(
            (at(name, ANCHORS[name], kind=kind), f"{title} wheel joint must be a {other} joint")
            for name, kind, title, other in (
                ("front", "weld", "Front", "revolute"),
                ("left", "revolute", "Rear left", "weld"),
                ("right", "revolute", "Rear right", "weld"),
            )
        ),
        *(
            (at(name, "[0, 0]", on=other), f'Joint "{name}_j" does not anchor on body "base"')
            for name, other in (("front", "left"), ("left", "front"), ("right", "front"))
        ),
        *(
            (
                at(name, ANCHORS[name], wheel_anchor="[0, 0.01]", base_first=base_first),
                f'Joint "{name}_j" must be anchored at (0, 0) on the wheel',
            )
            for name in ANCHORS
            for base_first in (True, False)
        ),
        (at("front", "[0.1, 0]"), "Front wheel joint must have its body anchored at (0, 0)"),
        (
            at("left", "[-1, 0.5]"),
            "The mid point between the rear wheel anchors on the body must equal the perpendicular "
            "intersection between the rear axel (line segment between rear anchors) and the front "
            "wheel anchor",
        ),
        (at("left", "[-1, -0.4]"), "The rear wheel joints must not have the same anchor"),
        (
            at("left", "[0, 0.4]") | at("right", "[0, -0.4]"),
            "The front wheel joint must not be anchored on the rear axle",
        ),
    ],
)
def test_errors_of_joints(plugin_world: Any, changes: dict[str, str], message: str) -> None:
    text = plugin_world.error(drive(), bodies=BODIES, joints=joints(**changes))
    assert (
        f'Model Plugin "wheels" type "TricycleDrive" model "robot": Flatland YAML: {message}'
        in text
    )
    assert "robot.model.yaml:" in text


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (drive().replace("front_j", "elbow"), 'Joint with name "elbow" does not exist'),
        (drive().replace("left_j", "elbow"), 'Joint with name "elbow" does not exist'),
        (drive().replace("right_j", "elbow"), 'Joint with name "elbow" does not exist'),
        (drive("command: 3"), 'Invalid "command", must be one of: steering, twist, got 3'),
        (drive("twist_pub: t"), "twist_pub"),
    ],
)
def test_errors_of_parameters(plugin_world: Any, entry: str, message: str) -> None:
    assert message in plugin_world.error(entry, bodies=BODIES, joints=joints())


def test_rear_axle_perpendicular_within_tolerance(trike: Any) -> None:
    world = trike(joints=joints(**at("left", "[-1, 0.400005]")))
    assert plugin(world).geometry.rear_center == pytest.approx((-1.0, 0.0), abs=1e-4)
