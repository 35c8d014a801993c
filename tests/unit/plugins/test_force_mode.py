"""`mode: force` of the drives, compared with closed-form motions."""

from __future__ import annotations

import math
from typing import Any

import pytest
import tricycle

import flatland
from tests.support.steps import control_bodies

G = 9.80665
DISC = """
- name: base
  footprints: [{type: circle, radius: 0.25, density: 254.64790894703253}]
"""  # 50 kg, I = m r^2 / 2
MASS, INERTIA = 50.0, 50.0 * 0.25**2 / 2
WALL = """
bodies:
  - name: slab
    type: static
    footprints:
      - {type: polygon, density: 1, points: [[0, -1], [0.2, -1], [0.2, 1], [0, 1]]}
"""
DT = 0.005


def diff(text: str) -> str:
    return f"[{{type: DiffDrive, name: drive, body: base, mode: force, {text}}}]"


@pytest.fixture
def robot(plugin_world: Any) -> Any:
    def load(plugins: str, **options: Any) -> flatland.World:
        world: flatland.World = plugin_world(plugins, **{"bodies": DISC, **options})
        return world

    return load


def drive(world: flatland.World, x: float, omega: float = 0.0, y: float = 0.0) -> None:
    world.command("/cmd_vel").set(flatland.Twist(x, y, omega))


def base(world: flatland.World) -> flatland.Body:
    return world.model("robot").body("base")


class TestDriving:
    def test_constant_force_up_to_the_target(self, robot: Any) -> None:
        world = robot(diff("max_force: 40, max_torque: 5"), pose=(0.0, 0.0, 0.6))
        drive(world, 1.0)
        for k in range(1, 400):
            world.step()
            vx, vy, omega = base(world).velocity
            v = min(40.0 / MASS * k * DT, 1.0)
            assert (vx, vy) == pytest.approx((v * math.cos(0.6), v * math.sin(0.6)), abs=1e-5)
            assert omega == pytest.approx(0.0, abs=1e-6)

    def test_a_center_of_mass_beside_the_wheels_follows_at_once_without_limits(
        self, robot: Any
    ) -> None:
        world = robot(
            diff("max_force: 1.0e6, max_torque: 1.0e6, friction: .inf"),
            bodies=DISC.replace("radius", "center: [0.3, 0.1], radius"),
        )
        drive(world, 1.0, 0.5)
        world.step()
        assert base(world).velocity == pytest.approx((1.0, 0.0, 0.5), abs=1e-3)

    @pytest.mark.parametrize("share", [1.0, 0.01])  # of the mass
    def test_constant_torque_up_to_the_target(self, robot: Any, share: float) -> None:
        world = robot(
            diff(f"max_force: 40, max_torque: {0.5 * share}, friction: .inf"),
            bodies=DISC.replace("254.64790894703253", str(254.64790894703253 * share)),
        )
        drive(world, 0.0, 2.0)
        for k in range(1, 1500):
            world.step()
            expected = min(0.5 / INERTIA * k * DT, 2.0)
            assert base(world).velocity[2] == pytest.approx(expected, abs=1e-4)

    @pytest.mark.parametrize(
        ("entry", "steps", "speed"),
        [
            # Limits of the acceleration apply to the command.
            ("max_force: 40, linear_dynamics: {acceleration_limit: 0.2}", 200, 0.2),
            # Wheels spin if their grip is less than the force.
            ("max_force: 400, friction: 0.3", 100, 0.3 * G * 0.5),
        ],
    )
    def test_other_limits(self, robot: Any, entry: str, steps: int, speed: float) -> None:
        world = robot(diff(f"max_torque: 5, {entry}"))
        drive(world, 2.0)
        world.step(steps)
        assert base(world).velocity[0] == pytest.approx(speed, abs=1e-4)

    def test_without_limits_the_motion_is_that_of_the_default_mode(self, robot: Any) -> None:
        text = "max_force: .inf, max_torque: .inf, friction: .inf"
        forced, plain = robot(diff(text)), robot("[{type: DiffDrive, name: drive, body: base}]")
        for world in (forced, plain):
            drive(world, 0.7, 0.9)
            world.step(400)
        assert base(forced).pose == pytest.approx(base(plain).pose, abs=1e-4)


class TestResistance:
    @pytest.mark.parametrize(("force", "friction"), [(60.0, 1.0), (400.0, 0.2)])
    def test_stall_force_at_a_wall(self, robot: Any, force: float, friction: float) -> None:
        bumper = "{type: Bumper, name: bumper}"
        entry = diff(f"max_force: {force}, max_torque: 5, friction: {friction}")
        world = robot(entry.replace("}]", f"}}, {bumper}]"))
        world.spawn_model("\n" + WALL, "wall", pose=(0.3, 0.0, 0.0))
        collisions = world.output("/collisions")
        drive(world, 1.0)
        world.step(400)
        [collision] = collisions.latest.collisions
        expected = min(force, friction * MASS * G)
        assert sum(collision.magnitude_forces) == pytest.approx(expected, rel=1e-3)
        assert base(world).velocity == pytest.approx((0, 0, 0), abs=1e-6)

    def test_sliding_sideways_with_coulomb_friction(self, robot: Any) -> None:
        world = robot(diff("max_force: 40, max_torque: 5, friction: 0.4"))
        base(world).set_velocity(0.0, 1.5, 0.0)
        for k in range(1, 120):
            world.step()
            expected = max(0.0, 1.5 - 0.4 * G * k * DT)
            assert base(world).velocity[1] == pytest.approx(expected, abs=1e-4)
        # The distance of the sum of steps, v0^2 / (2 mu g) less half a step.
        assert base(world).pose[1] == pytest.approx(1.5**2 / (2 * 0.4 * G) - 1.5 * DT / 2, abs=1e-3)

    def test_spinning_slows_down_by_the_friction_at_the_grip_radius(self, robot: Any) -> None:
        world = robot(diff("max_force: 40, max_torque: .inf, friction: 0.4, grip_radius: 0.2"))
        base(world).set_velocity(0.0, 0.0, 20.0)
        world.step(50)
        deceleration = 0.4 * MASS * G * 0.2 / INERTIA
        assert base(world).velocity[2] == pytest.approx(20.0 - deceleration * 0.25, abs=1e-3)

    def test_brakes_hold_below_the_force_and_yield_above(self, robot: Any) -> None:
        def displacement(push: float) -> float:
            world = robot(diff("max_force: 40, max_torque: 5"))
            for _ in range(200):
                base(world).apply_force((push, 0.0), base(world).world_center)
                world.step()
            return base(world).pose[0]

        assert abs(displacement(39.0)) < 1e-3
        # 10 N more than the brakes, which act one step later, for 200 steps.
        expected = (10.0 * 200 * 201 / 2 + 40.0 * 200) * DT**2 / MASS
        assert displacement(50.0) == pytest.approx(expected, rel=1e-3)

    def test_brakes_do_not_undo_a_small_move(self, robot: Any) -> None:
        world = robot(diff("max_force: 4000, max_torque: 500"))
        world.step(10)
        for pose in ((0.006, 0.005, 0.004), (0.006, 0.005, 0.001)):
            world.move_model("robot", pose)
            world.step(100)
            assert world.model("robot").pose == pytest.approx(pose, abs=1e-7)

    def test_a_robot_that_is_pushed_by_another(self, plugin_world: Any) -> None:
        """The stronger robot pushes the braked one with the difference of the forces."""
        plugins = diff("max_force: 90, max_torque: 50, friction: .inf")
        world = plugin_world(plugins, bodies=DISC, namespace="a")
        world.spawn_model("robot.model.yaml", "other", "b", pose=(0.5, 0.0, math.pi))
        world.command("/a/cmd_vel").set(flatland.Twist(5.0))
        other = world.model("other").bodies[0]
        limits = {"holonomic": False, "at_center": False, "grip": math.inf, "radius": 0.0}
        brakes = world.model("other").plugin("drive")._controller
        brakes.set_traction([other], max_force=95.0, max_torque=50.0, **limits)
        world.step(200)
        assert other.pose[0] == pytest.approx(0.5, abs=1e-3)
        brakes.set_traction([other], max_force=30.0, max_torque=50.0, **limits)
        world.step(20)
        before = other.velocity[0]
        world.step(100)
        assert other.velocity[0] - before == pytest.approx(60 / (2 * MASS) * 0.5, rel=0.02)

    def test_an_axle_without_motors_rolls_freely_and_does_not_slide(self, robot: Any) -> None:
        world = robot(diff("max_force: 0, max_torque: 0, friction: .inf"), pose=(0, 0, 0.5))
        base(world).set_velocity(1.0, 0.0, 0.0)
        world.step(100)
        vx, vy, omega = base(world).velocity
        along = math.cos(0.5)
        assert (vx, vy) == pytest.approx((along * math.cos(0.5), along * math.sin(0.5)), abs=1e-4)
        assert omega == pytest.approx(0.0, abs=1e-5)


def test_car_slides_out_of_a_curve_that_is_too_narrow(robot: Any) -> None:
    """The grip allows v^2 / R = mu g; a slower car follows the curve, a faster one does not."""
    car = (
        "[{type: AckermannDrive, name: drive, body: base, wheelbase: 1, rear_axle: [-0.5, 0], "
        "max_steer_angle: 1, command: steering, mode: force, max_force: 1000, friction: 0.5}]"
    )
    radius = math.hypot(1.0 / math.tan(0.3), 0.5)  # of the centre of mass
    limit = math.sqrt(0.5 * G * radius)  # of its speed

    def motion(speed: float) -> tuple[float, float]:
        """Returns the curvature of the path and the acceleration across it."""
        world = robot(car)
        rear = speed * math.cos(math.atan(0.5 * math.tan(0.3)))
        world.command("/cmd_vel").set(flatland.Twist(rear, 0.0, 0.3))
        # The car enters the curve at its speed.
        yaw_rate = rear * math.tan(0.3)
        base(world).set_velocity(rear, 0.5 * yaw_rate, yaw_rate)
        control_bodies(world, dt=1e3)  # the steering has turned
        base(world).set_velocity(rear, 0.5 * yaw_rate, yaw_rate)
        world.step(5)
        vx, vy, _ = base(world).velocity
        world.step()
        wx, wy, _ = base(world).velocity
        turn = math.atan2(vx * wy - vy * wx, vx * wx + vy * wy) / DT
        return turn / math.hypot(vx, vy), turn * math.hypot(vx, vy)

    curvature, _ = motion(0.95 * limit)
    assert curvature == pytest.approx(1 / radius, rel=0.01)
    curvature, acceleration = motion(1.3 * limit)
    assert acceleration < 0.5 * G * 1.001
    assert curvature < 0.65 / radius


@pytest.mark.parametrize(
    ("entry", "target", "expected"),
    [
        (
            "type: AckermannDrive, wheelbase: 1, max_steer_angle: 1, max_force: 60",
            (2.0, 0.0),
            (60.0 / MASS * 0.5, 0.0),
        ),
        ("type: OmniDrive, max_force: 50, max_torque: 5", (3.0, 4.0), (0.3, 0.4)),
    ],
)
def test_car_and_omni_drive_accelerate_with_their_force(
    robot: Any, entry: str, target: tuple[float, float], expected: tuple[float, float]
) -> None:
    world = robot(f"[{{name: drive, body: base, mode: force, {entry}}}]")
    drive(world, target[0], 0.0, target[1])
    world.step(100)
    assert base(world).velocity[:2] == pytest.approx(expected, abs=1e-4)


def test_tricycle_accelerates_with_its_force(plugin_world: Any) -> None:
    bodies = tricycle.BODIES.replace("density: 1,", "density: 100,")
    world = plugin_world(
        f"[{{{tricycle.DRIVE}, mode: force, max_force: 60}}]", bodies=bodies, joints=tricycle.JOINTS
    )
    wheels = sum(body.mass for body in world.model("robot").bodies[1:])
    assert wheels > 2.0
    mass = base(world).mass + wheels
    drive(world, 2.0)
    world.step(100)
    # The joints of the wheels are solved iteratively.
    assert base(world).velocity[0] == pytest.approx(60.0 / mass * 0.5, rel=1e-3)
    world.step(400)
    assert base(world).velocity[0] == pytest.approx(2.0, abs=1e-3)


def test_bodies_on_joints_are_accelerated_together(plugin_world: Any) -> None:
    arm = "{type: circle, radius: 0.1, density: 318.3098861837907, layers: []}"
    world = plugin_world(
        diff("max_force: 60, max_torque: 1000, friction: .inf"),
        bodies=f"{DISC}- {{name: arm, pose: [0, 0.3, 0], footprints: [{arm}]}}",
        joints="[{name: j, type: revolute, bodies: [{name: base, anchor: [0, 0.3]}, "
        "{name: arm, anchor: [0, 0]}]}]",
    )
    total = sum(body.mass for body in world.model("robot").bodies)
    assert total == pytest.approx(60.0, rel=1e-4)
    drive(world, 3.0)
    world.step(200)
    assert base(world).velocity[0] == pytest.approx(1.0, abs=1e-3)
