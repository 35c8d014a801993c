"""Runs of steps in the core: the same results as steps with calls of Python, one by one."""

from __future__ import annotations

import contextlib
import itertools
import math
import random
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from python_plugins import ContactWitness, PythonDrive, PythonTricycle, PythonTween
from waiting import TIMEOUT, wait_until

import flatland
from flatland.physics import PhysicsWorld, Run, RunEnd
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugins.diff_drive import DiffDrive
from flatland.runtime.batch import step_worlds
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation

CART = """
bodies:
  - {{name: base, footprints: [{{type: circle, radius: 0.2, density: 5, restitution: 0.3}}]}}
plugins:
  - {{type: {drive}, name: drive, body: base, linear_dynamics: {{acceleration_limit: 0.7,
     deceleration_limit: 1.3}}, angular_dynamics: {{velocity_limit: 0.9, acceleration_limit: 2.1}}}}
"""
TRICYCLE = """
bodies:
  - {{name: base, footprints: [{{type: circle, radius: 0.3, density: 5}}]}}
  - {{name: front, footprints: [{{type: circle, radius: 0.05, density: 1, layers: []}}]}}
  - {{name: left, pose: [-0.4, 0.2, 0],
     footprints: [{{type: circle, radius: 0.05, density: 1, layers: []}}]}}
  - {{name: right, pose: [-0.4, -0.2, 0],
     footprints: [{{type: circle, radius: 0.05, density: 1, layers: []}}]}}
joints:
  - {{name: front, type: revolute,
     bodies: [{{name: base, anchor: [0, 0]}}, {{name: front, anchor: [0, 0]}}]}}
  - {{name: left, type: weld,
     bodies: [{{name: base, anchor: [-0.4, 0.2]}}, {{name: left, anchor: [0, 0]}}]}}
  - {{name: right, type: weld,
     bodies: [{{name: base, anchor: [-0.4, -0.2]}}, {{name: right, anchor: [0, 0]}}]}}
plugins:
  - {{type: {drive}, name: drive, body: base, front_wheel_joint: front, rear_left_wheel_joint: left,
     rear_right_wheel_joint: right, max_steer_angle: 1.2,
     linear_dynamics: {{acceleration_limit: 0.7}},
     angular_dynamics: {{velocity_limit: 1.5, acceleration_limit: 3}}}}
"""
DOOR = """
bodies:
  - {{name: leaf,
     footprints: [{{type: polygon, density: 1,
       points: [[0, -0.1], [1, -0.1], [1, 0.1], [0, 0.1]]}}]}}
plugins:
  - {{type: {drive}, name: tween, body: leaf, delta: [0.5, -0.3, 0.7], duration: 0.37}}
"""
SENSORS = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 5, restitution: 0.3}]}
plugins:
  - {type: DiffDrive, name: drive, body: base}
  - {type: Bumper, name: bumper}
  - {type: BoolSensor, name: touch}
"""
WITNESS = "  - {type: 'test::ContactWitness', name: witness}\n"


class OnDemand(flatland.ModelPlugin):
    """Records the calls of an update, whose output nothing wants."""

    def on_initialize(self, config: Any) -> None:
        self.calls: list[Any] = []
        self.unwanted = (self.output("unwanted", float),)
        self.update = self.on_update(
            lambda timekeeper: self.calls.append("update"),
            outputs=self.unwanted,
            skipped=lambda count, stamp, poses: self.calls.append(count),
        )

    def model_moved(self, previous: Any, keep_odometry: bool) -> None:
        self.calls.append("moved")


@pytest.fixture(autouse=True)
def plugins(declare_plugins: Any) -> None:
    """Declares the plugins of this module."""
    declare_plugins(PythonDrive, PythonTricycle, PythonTween, ContactWitness, OnDemand, Slowed)


def room(files: Any, models: dict[str, str], **options: Any) -> flatland.World:
    """Loads a world of models, side by side, in a closed room."""
    files.write("room.lines", "-2 -2 9 -2\n9 -2 9 3\n9 3 -2 3\n-2 3 -2 -2\n")
    files.write("room.yaml", "type: line_segments\ndata: room.lines\nscale: 1\norigin: [0, 0, 0]\n")
    entries = ""
    for index, (name, text) in enumerate(models.items()):
        files.write(f"{name}.model.yaml", text)
        entries += f"  - {{name: {name}, namespace: {name}, model: {name}.model.yaml, "
        entries += f"pose: [{1.1 * index}, {0.2 * index}, {0.3 * index}]}}\n"
    text = f"properties: {{}}\nlayers: [{{name: 2d, map: room.yaml}}]\nmodels:\n{entries}"
    world: flatland.World = files.load(text, seed=3, **options)
    return world


def commands(seed: int) -> Iterator[flatland.Twist]:
    """Yields random commands, among them zeros and reversals."""
    rng = random.Random(seed)
    while True:
        v, omega = rng.choice([0.0, rng.uniform(-1, 1)]), rng.choice([0.0, rng.uniform(-2, 2)])
        yield flatland.Twist(linear_x=v, angular_z=omega)


def drive(world: flatland.World, lengths: list[int], single: bool = False) -> list[bytes]:
    """Drives all robots at random; returns the states of all bodies after each run of steps."""
    states, source = [], commands(7)
    topics = [topic for topic in world.ports.commands if topic.endswith("cmd_vel")]
    for n in lengths:
        for topic in topics:
            world.command(topic).set(next(source))
        if single:
            for _ in range(n):
                world.step()
        else:
            world.step(n)
        states.append(world.physics.body_states().tobytes())
    return states


LENGTHS = [1, 2, 3, 5, 8, 13, 40, 17, 90, 4, 60, 100, 33, 150]


class TestTheCoreEqualsPython:
    @pytest.mark.parametrize(
        ("model", "core", "python"),
        [
            (CART, "DiffDrive", "PythonDrive"),
            (TRICYCLE, "TricycleDrive, command: steering", "PythonTricycle, command: steering"),
            (TRICYCLE, "TricycleDrive, command: twist", "PythonTricycle, command: twist"),
            (DOOR, "Tween, easing: cubicInOut", "PythonTween"),
        ],
    )
    def test_a_motion_next_to_a_robot(self, files: Any, model: str, core: str, python: str) -> None:
        states = [
            drive(
                room(files, {"a": CART.format(drive="DiffDrive"), "b": model.format(drive=name)}),
                LENGTHS,
            )
            for name in (core, f"test::{python}")
        ]
        assert states[0] == states[1]

    def test_the_contacts_of_a_bumper(self, files: Any) -> None:
        world = room(files, {"a": SENSORS + WITNESS, "b": SENSORS, "c": SENSORS})
        found: list[Any] = []
        world.ports.outputs["/a/collisions"].subscribe(found.append)
        witness = world.model("a").plugin("witness")
        assert isinstance(witness, ContactWitness)
        drive(world, LENGTHS)
        for turn in (0.0, 0.7, -0.7):
            world.command("/a/cmd_vel").set(flatland.Twist(linear_x=-1.0, angular_z=turn))
            world.step(300)
        assert len(found) == len(witness.steps) == sum(LENGTHS) + 900
        assert any(forces for step in witness.steps for _, forces, _, _ in step)
        for value, expected in zip(found, witness.steps, strict=True):
            assert [
                (
                    [each.body_a, each.entity_b, each.body_b],
                    each.magnitude_forces.tolist(),
                    each.contact_positions.tolist(),
                    each.contact_normals.tolist(),
                )
                for each in value.collisions
            ] == expected


MIXED = {
    "a": CART.format(drive="DiffDrive, pub_rate: 33.3, odom_pose_noise: [0.1, 0.1, 0.1]"),
    "b": SENSORS,
    "door": DOOR.format(drive="Tween, easing: bounceOut"),
    "c": TRICYCLE.format(drive="TricycleDrive, command: twist"),
}


class TestRunsEqualSingleSteps:
    @pytest.mark.parametrize("witness", [False, True])
    def test_states_transforms_and_hashes(self, files: Any, witness: bool) -> None:
        models = {**MIXED, "d": SENSORS + WITNESS} if witness else MIXED
        runs, single = room(files, models), room(files, models)
        assert drive(runs, LENGTHS) == drive(single, LENGTHS, single=True)
        assert runs.transforms == single.transforms
        assert runs.state_hash() == single.state_hash()

    def test_outputs_that_become_wanted_later(self, files: Any) -> None:
        values: list[list[Any]] = []
        for single in (False, True):
            world = room(files, MIXED)
            drive(world, [37], single=single)
            found: list[Any] = []
            for topic in ("/a/odometry/filtered", "/b/collisions", "/b/bool_sensor"):
                world.ports.outputs[topic].subscribe(
                    lambda value, found=found: found.append(repr(value))
                )
            drive(world, [50], single=single)
            values.append(found)
        assert values[0] == values[1]
        assert len(values[0]) > 100

    def test_many_worlds_at_once(self, files: Any) -> None:
        worlds = [room(files, MIXED) for _ in range(3)]
        alone = [room(files, MIXED) for _ in range(3)]
        for threads in (1, 2, 0):
            for index, (world, other) in enumerate(zip(worlds, alone, strict=True)):
                for each in (world, other):
                    each.command("/a/cmd_vel").set(flatland.Twist(linear_x=0.2 * index))
            step_worlds(worlds, 57, threads)
            for other in alone:
                other.step(57)
        hashes = [world.state_hash() for world in worlds]
        assert hashes == [world.state_hash() for world in alone]
        assert len(set(hashes)) == 3

    def test_threads_may_step_the_same_worlds_in_another_order(self, files: Any) -> None:
        worlds = [room(files, MIXED) for _ in range(2)]

        def step(order: list[flatland.World]) -> None:
            for _ in range(200):
                step_worlds(order, 1)
                sum(range(20_000))  # The other thread takes the lock for which it waits.

        threads = [
            threading.Thread(target=step, args=[order], daemon=True)
            for order in (worlds, worlds[::-1])
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(TIMEOUT)
            assert not thread.is_alive()
        assert [world.timekeeper.sim_time_ns for world in worlds] == [400 * 5_000_000] * 2

    def test_an_interrupt_releases_all_worlds(self, files: Any) -> None:
        worlds = [room(files, {"a": CART.format(drive="DiffDrive")}) for _ in range(3)]

        def interrupt(_: object) -> None:
            raise KeyboardInterrupt

        worlds[1].output("/a/odometry/filtered").subscribe(interrupt)
        try:
            step_worlds(worlds, 100)
        except KeyboardInterrupt:  # whose traceback refers to all frames
            assert [world.requests.lock.is_owned for world in worlds] == [False] * 3
        else:
            pytest.fail("the interrupt was not raised")


class Slowed(DiffDrive):
    """A drive that sets the velocity after its controller."""

    calls = 0

    def before_physics_step(self, timekeeper: flatland.Timekeeper) -> None:
        super().before_physics_step(timekeeper)
        self.calls += 1
        self.body.set_velocity(0.25, 0.0, 0.0)


def test_a_subclass_that_overrides_a_hook_is_called_in_each_step(files: Any) -> None:
    world = room(files, {"a": CART.format(drive="test::Slowed")})
    plugin: Any = world.model("a").plugin("drive")
    world.command("/a/cmd_vel").set(flatland.Twist(linear_x=1.0))
    world.step(20)
    assert plugin.calls == 20
    # What the subclass set after the drive remains.
    assert plugin.body.velocity == pytest.approx((0.25, 0.0, 0.0))


class TestInterruptions:
    def test_a_request_of_another_thread_runs_between_two_steps_of_a_run(self, files: Any) -> None:
        world = room(files, {"a": CART.format(drive="DiffDrive")})

        def now() -> int:
            return world.timekeeper.sim_time_ns

        def is_processed_within_a_run() -> bool:
            times: list[int] = []
            timer = threading.Timer(0.001, world.post, [lambda: times.append(now())])
            start = now()
            timer.start()
            world.step(100_000)
            end = now()
            timer.join()
            world.step()
            return start < times[0] < end

        # On a busy machine, the thread may post its request after the run.
        wait_until("a request is processed within a run", is_processed_within_a_run)

    def test_a_request_of_a_function_runs_before_the_next_step(self, files: Any) -> None:
        world = room(files, {"a": EYE})
        stamps, times = [], []

        def request(scan: Any) -> None:
            stamps.append(scan.stamp)
            world.post(lambda: times.append(world.timekeeper.sim_time_ns))

        world.ports.find_output("/a/scan").subscribe(request)
        world.step(100)
        assert len(stamps) > 2
        assert times == [stamp + 5_000_000 for stamp in stamps]

    def test_a_pause_ends_a_run(self, files: Any) -> None:
        world = room(files, {"a": CART.format(drive="DiffDrive")})
        world.post(world.pause)
        world.step(100)
        assert world.timekeeper.sim_time_ns == 0


class TestController:
    def test_a_controller_sets_the_velocity_in_the_frame_of_the_body(self, files: Any) -> None:
        world = room(
            files, {"a": SENSORS.replace("  - {type: DiffDrive, name: drive, body: base}\n", "")}
        )
        body = world.model("a").bodies[0]
        controller = body.control_velocity(linear=(0.0, 2.0, 2.0))
        controller.set_target(0.5, 0.25, 0.0)
        world.step(10)
        assert controller.velocity == pytest.approx((0.1, 0.1, 0.0))
        world.step(50)
        yaw = body.pose[2]
        assert body.velocity[:2] == pytest.approx(
            (
                0.5 * math.cos(yaw) - 0.25 * math.sin(yaw),
                0.5 * math.sin(yaw) + 0.25 * math.cos(yaw),
            ),
            abs=1e-6,
        )

    def test_a_controller_ends_with_its_body(self) -> None:
        world = PhysicsWorld()
        body = world.create_body("dynamic", (0, 0, 0))
        controller = body.control_velocity()
        assert controller.alive
        body.destroy()
        assert not controller.alive
        with pytest.raises(flatland.StaleHandleError):
            controller.set_target(1, 0, 0)

    def test_a_velocity_that_is_not_finite_is_a_fault_of_the_plugin(self, files: Any) -> None:
        world = room(files, MIXED)
        world.step(20)
        world.ports.commands["/a/cmd_vel"][0].value = flatland.Twist(linear_x=math.nan)
        with pytest.raises(ValueError, match="velocity must be finite and within") as caught:
            world.step(20)
        assert "before_physics_step" in caught.value.__notes__[0]
        # The step of the fault is complete.
        assert world.timekeeper.sim_time_ns == 21 * 5_000_000


class TestTouches:
    def test_a_contact_is_remembered_until_it_is_cleared(self, files: Any) -> None:
        world = room(files, {"a": SENSORS})
        model = world.model("a")
        touches = model.watch_contacts()
        assert touches  # although there are none
        assert not touches.touched
        world.command("/a/cmd_vel").set(flatland.Twist(linear_x=-1.0))
        world.step(600)
        assert touches.touched
        assert len(touches) == 1
        world.command("/a/cmd_vel").set(flatland.Twist(linear_x=1.0))
        world.step(100)
        assert len(touches) == 0
        assert touches.touched
        touches.clear()
        assert not touches.touched

    def test_contacts_that_exist_already_count(self, files: Any) -> None:
        world = room(files, {"a": SENSORS})
        world.move_model("a", (-1.8, 0.0, 0.0), if_blocked="allow")
        world.command("/a/cmd_vel").set(flatland.Twist(linear_x=-1.0))
        world.step(50)
        assert world.model("a").watch_contacts().touched


RATES = [0.0, math.inf, 50.0, 10.0, 33.3, 0.1, 160.0, 192.0, 199.9, 7e-3, 1 / 3, 1e9, 1e-300]


@pytest.mark.parametrize("step_size", [0.005, 0.001, 0.0166, 1 / 3, 1e-6, 1000.0])
@pytest.mark.parametrize("is_after", [False, True])
def test_the_clock_of_the_core_agrees_with_the_timer(step_size: float, is_after: bool) -> None:
    rng = random.Random(1)
    timekeeper = flatland.Timekeeper(step_size)
    step = timekeeper.step_size_ns
    # Steps one by one, jumps, and times that are no multiples of the step size.
    numbers = [*range(100), *rng.sample(range(100, 2000), 20), 10**4, 10**4 + 1, 10**6 + 7]
    times = [*(number * step for number in numbers), 3, step + 1, 2 * step + 1, 5 * step - 1]
    # Any rates, and rates of about one update in each step.
    anything = [10 ** rng.uniform(-12, 6) for _ in range(10)]
    about_one = [rng.uniform(0.3, 1.1) / timekeeper.step_size for _ in range(10)]
    for rate in (*RATES, *anything, *about_one):
        jobs, timer = PhysicsWorld().jobs, UpdateTimer(rate)
        callback = jobs.add_callback((1, 0), timer.clock(step), is_after=is_after)
        for time in times:
            timekeeper.sim_time_ns = time + step * is_after
            run = Run(time, step, 1, timekeeper.step_size, 1, 1, calls_physics=True)
            result = jobs.run(*run)
            if result[1] == RunEnd.PHYSICS:
                result = jobs.run(*run._replace(continues=True))
            is_due = UpdateTimer(rate).check_update(timekeeper)
            assert (result[2] == [callback]) == is_due, (rate, time)


class Log(WorldObserver):
    """Records its notifications."""

    def __init__(self) -> None:
        self.events: list[tuple[str, int]] = []

    def attached(self, world: flatland.World) -> None:
        self._timekeeper = world.timekeeper

    def step_started(self) -> None:
        self.events.append(("started", self._timekeeper.sim_time_ns))

    def time_advanced(self, time_ns: int) -> None:
        self.events.append(("time", time_ns))

    def transforms_sent(self, transforms: Any) -> None:
        self.events.append(("transforms", len(transforms)))

    def step_finished(self) -> None:
        self.events.append(("finished", self._timekeeper.sim_time_ns))


class IdleLog(Log):
    """Watches no single steps."""

    watches_steps = False


def step_plainly(world: flatland.World, n: int, tmp_path: Path) -> None:
    world.step(n)


def step_in_a_batch(world: flatland.World, n: int, tmp_path: Path) -> None:
    other = world.clone()
    step_worlds([other, world], n)
    assert other.state_hash() == world.state_hash()
    other.close()


def step_with_a_rate(world: flatland.World, n: int, tmp_path: Path) -> None:
    Simulation(world, 2000.0).run(n * world.timekeeper.step_size)


def step_recorded(world: flatland.World, n: int, tmp_path: Path) -> None:
    with contextlib.closing(world.record(tmp_path / "run.log")):
        world.step(n)


WAYS = [step_plainly, step_in_a_batch, step_with_a_rate, step_recorded]
EYE = CART.format(drive="DiffDrive, pub_rate: 40") + (
    "  - {type: Laser, name: eye, body: base, range: 5, update_rate: 23, noise_std_dev: 0.1,"
    " angle: {min: -1, max: 1, increment: 0.5}}\n  - {type: Bumper, name: bumper}\n"
)


class TestOnePath:
    """All ways to step have the same results."""

    @pytest.mark.parametrize("way", WAYS[1:])
    @pytest.mark.parametrize("wants", [False, True])
    def test_states_messages_and_notifications(
        self, files: Any, tmp_path: Path, way: Any, wants: bool
    ) -> None:
        results = []
        for step in (step_plainly, way):
            log = Log()
            world = room(files, {"a": EYE, "b": EYE}, observers=[log])
            messages: list[Any] = []
            if wants:
                for output in list(world.ports.outputs.values()):
                    output.subscribe(messages.append)
            step(world, 60, tmp_path)
            results.append((world.state_hash(), list(map(repr, messages)), log.events))
            assert [time for kind, time in log.events if kind == "time"] == [
                5_000_000 * (index + 1) for index in range(60)
            ]
            world.close()
        assert results[0] == results[1]

    @pytest.mark.parametrize("way", WAYS)
    def test_an_observer_that_watches_no_single_steps_is_notified_of_each_run(
        self, files: Any, tmp_path: Path, way: Any
    ) -> None:
        log = IdleLog()
        world = room(files, {"a": EYE}, observers=[log])
        scans: list[int] = []
        world.ports.find_output("/a/scan").subscribe(lambda scan: scans.append(len(log.events)))
        way(world, 150, tmp_path)
        kinds = [kind for kind, _ in log.events if kind in ("started", "finished")]
        assert kinds == ["started", "finished"] * (len(kinds) // 2)
        # Each scan is emitted between the start and the end of a run, at the time notified last.
        assert len(scans) == 18
        for place in scans:
            kinds = [kind for kind, _ in log.events[:place]]
            assert kinds.count("started") == kinds.count("finished") + 1
        for first, second in itertools.pairwise(scans):
            assert any(kind == "finished" for kind, _ in log.events[first:second])
        times = [time for kind, time in log.events if kind == "time"]
        assert times == sorted(times)
        assert times[-1] == 150 * 5_000_000


def test_a_removed_plugin_leaves_no_clock(files: Any) -> None:
    """After many plugins with distinct rates, a further one is not called in every step."""
    world = room(files, {"a": CART.format(drive="DiffDrive")})
    for number in range(60):
        gps = f"  - {{type: Gps, name: gps, body: base, update_rate: {1 + number / 7}}}\n"
        world.spawn_model("\n" + CART.format(drive="DiffDrive") + gps, "b")
        world.step()
        world.delete_model("b")
    assert len(world.plugin_host.jobs._controllers) == 1
    calls: list[int] = []
    world.output("/a/odometry/filtered").subscribe(lambda odometry: calls.append(odometry.stamp))
    gps = "  - {type: Gps, name: gps, body: base, update_rate: 1.25}\n"
    world.spawn_model("\n" + CART.format(drive="DiffDrive, pub_rate: 0.5") + gps, "c")
    world.output("/gps/fix").subscribe(lambda fix: calls.append(fix.stamp))
    world.step(800)
    assert len(calls) <= 806


def test_a_failure_after_the_physics_step_is_reported_in_the_same_step(files: Any) -> None:
    world = room(files, {})
    path = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 5}]}
plugins:
  - {type: PathFollower, name: path, body: base, waypoints: [[1.0e+8, 0]], speed: 1.0e+6}
"""
    world.spawn_model(path, "far", "", (9.999e8, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"within \+-1e\+09, got \(1.00000") as caught:
        world.step(100)
    assert caught.value.__notes__ == [
        'raised by Model Plugin "path" type "PathFollower" model "far": after_physics_step'
    ]
    # From 9.999e8 to 1e9 m at 1e6 m/s; the limit is passed in the step that raises.
    assert world.time == pytest.approx(0.1)


def test_what_a_function_before_a_step_raises_is_a_fault_of_its_plugin(files: Any) -> None:
    world = room(files, MIXED)
    world.step(20)
    world.model("a").plugin("drive").set_before_step(lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError) as caught:
        world.step(20)
    assert 'Model Plugin "drive"' in caught.value.__notes__[0]
    assert world.timekeeper.sim_time_ns > 20 * 5_000_000


@pytest.mark.parametrize("last", ["DiffDrive", "PythonDrive"])
def test_jobs_of_the_core_and_of_python_are_in_the_order_of_the_plugins(
    files: Any, last: str
) -> None:
    drives = {
        "DiffDrive": "{type: DiffDrive, name: core, body: base, twist_sub: other}",
        "PythonDrive": "{type: 'test::PythonDrive', name: python, body: base}",
    }
    listed = [text for name, text in drives.items() if name != last] + [drives[last]]
    body = "{name: base, footprints: [{type: circle, radius: 0.2, density: 5}]}"
    world = room(files, {"a": f"bodies: [{body}]\nplugins: [{', '.join(listed)}]"})
    world.command("/a/other").set(flatland.Twist(linear_x=0.2))
    world.command("/a/cmd_vel").set(flatland.Twist(linear_x=0.1))
    world.step(2)
    speed = 0.2 if last == "DiffDrive" else 0.1
    assert world.model("a").bodies[0].velocity[:2] == pytest.approx((speed, 0.0))


@pytest.fixture
def on_demand(files: Any) -> Any:
    """A plugin whose update has been called once; the first call does not depend on demand."""
    plugins = "plugins: [{type: 'test::OnDemand', name: counter}]"
    world = room(files, {"a": f"bodies: [{{name: b, footprints: []}}]\n{plugins}"})
    world.step()
    plugin = world.model("a").plugin("counter")
    assert plugin.calls == ["update"]
    plugin.calls.clear()
    return plugin


def test_changed_outputs_of_an_update_apply_from_the_next_step_on(on_demand: Any) -> None:
    world = on_demand.world
    world.step(10)
    on_demand.update.outputs = None
    world.step(2)
    on_demand.update.outputs = on_demand.unwanted
    world.step(10)
    on_demand.update.outputs = None
    world.step()
    assert on_demand.calls == [10, "update", "update", 10, "update"]


def test_skipped_updates_are_reported_before_a_model_is_moved(on_demand: Any) -> None:
    on_demand.world.step(10)
    on_demand.world.move_model("a", (1, 0, 0))
    assert on_demand.calls == [10, "moved"]


def test_updates_and_controllers_are_declared_in_on_initialize(files: Any) -> None:
    world = room(files, {"a": CART.format(drive="DiffDrive")})
    plugin = world.model("a").plugin("drive")
    with pytest.raises(flatland.PluginError, match="on_update must be called in on_initialize"):
        plugin.on_update(print)
    with pytest.raises(flatland.PluginError, match="control must be called in on_initialize"):
        plugin.control(plugin.body.control_velocity())
