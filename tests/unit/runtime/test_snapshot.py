"""Snapshots and clones: the same steps have the same results, bit by bit."""

from __future__ import annotations

import contextlib
import functools
import gc
import queue
import re
import sys
import types
import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from observations import observations
from plugin_manifests import write_plugins

import flatland
from flatland import StaleHandleError, Twist, World, WorldError
from flatland.runtime.plugin_costs import PluginCosts

STEPS = 20
MODELS = Path(__file__).resolve().parents[3] / "bench" / "all_plugins.model.yaml"
WORLD = f"""
properties: {{}}
layers: [{{name: walls, map: room.yaml}}]
models:
  - {{name: robot, model: {MODELS}, pose: [4, 4, 0.3], namespace: robot}}
  - {{name: other, model: {MODELS}, pose: [6.2, 4.1, 2], namespace: other}}
  - {{name: box, model: minimal.model.yaml, pose: [5, 5.5, 0]}}
  - {{name: drift, model: drift.model.yaml, pose: [2, 6, 0], namespace: drift}}
plugins:
  - {{type: RandomWall, name: walls, layer: walls, robot_name: robot, num_of_walls: 2}}
"""
DRIFT = """
bodies:
  - name: base
    footprints: [{type: circle, radius: 0.2, density: 1}]
plugins:
  - type: DiffDrive
    name: diff
    body: base
    pub_rate: 50
    odom_drift: [0.1, 0.1, 0.1, 0.1]
    odom_pose_noise: [1, 1, 1]
    after_step: true
    linear_dynamics: {acceleration_limit: 1}
  - type: Laser
    name: laser
    body: base
    range: 5
    update_rate: 20
    always_publish: true
    after_step: true
    noise_model: beam
    z_short: 0.1
    lambda_short: 1
    angle: {min: -1, max: 1, increment: 0.1}
  - {type: Tween, name: door, body: base, delta: [0, 0, 0], mode: trigger, trigger_topic: go}
"""
PLUGINS = '''
import collections
import functools
import random
import threading

import numpy as np

from flatland import ModelPlugin, UpdateTimer


class Inner:
    def __init__(self, owner):
        self.owner = owner
        self.count = 0


class Slots:
    __slots__ = ("value", "unset")

    def __init__(self):
        self.value = 0


class Names(list):
    pass


class Everything(ModelPlugin):
    """Keeps its state in everything that Python has for it."""

    def on_initialize(self, config):
        self.timer = UpdateTimer(50.0)
        self.inner = Inner(self)
        self.slots = Slots()
        self.names = Names(["a"])
        self.body = self.model.bodies[0]
        self.by_body = {self.body: 0, "other": 0}
        self.all = {self.body, self}
        self.of_key_values = collections.defaultdict(int)
        self.values = self.of_key_values.values()
        self.last = collections.deque(maxlen=3)
        self.counts = collections.Counter()
        self.of_key = collections.defaultdict(list)
        self.array = np.zeros(3)
        self.view = self.array[1:]
        self.bytes = bytearray(2)
        self.random = random.Random(1)
        self.generator = np.random.Generator(np.random.Philox(5))
        self.lock = threading.RLock()
        total = 0

        def add(number=1, *, owner=self):
            nonlocal total
            total += number
            owner.inner.count += 1
            return total

        self.add = add
        self.partial = functools.partial(self.note, "partial")
        self.append = self.names.append
        self.lambdas = (lambda: self.inner.count, sum)
        self.seen = self.output("seen", int)
        self.heard = []
        self.unsubscribe = self.seen.subscribe(self.heard.append)
        self.command("value", int)

    def note(self, *names):
        for name in names:
            self.counts[name] += 1

    def before_physics_step(self, timekeeper):
        with self.lock:
            self.slots.value += 1
            if self.timer.check_update(timekeeper):
                self.slots.unset = self.add(2)
            self.by_body[self.body] += self.random.random()
            self.last.append(float(self.generator.normal()))
            self.of_key[len(self.last)].append(self.slots.value)
            self.array += self.rng.normal(size=3)
            self.view += 1.0
            self.bytes[0] = (self.bytes[0] + 1) % 256
            self.partial("more")
            self.of_key_values[self.slots.value % 7] += 1
            if self.slots.value % 10 == 0:
                self.append(str(self.slots.value))
            self.seen.emit(self.slots.value)
            self.body.apply_force((self.last[-1], self.view[0] % 1.0), self.body.world_center)

    def state(self):
        return [
            self.inner.count, self.slots.value, getattr(self.slots, "unset", None), self.names,
            self.by_body[self.body], list(self.last), self.counts, dict(self.of_key), self.array,
            self.view, self.bytes, self.random.getstate(), self.lambdas[0](), self.heard[-3:],
            list(self.values), self in self.all, self.body in self.all, self.inner.owner is self,
            self.add.__name__,
        ]


class Generating(ModelPlugin):
    """Holds what cannot be copied."""

    def on_initialize(self, config):
        self.numbers = (i for i in range(3))


class Connected(ModelPlugin):
    """Is connected to the outside, and says how it is copied."""

    def on_initialize(self, config):
        self.device = threading.Event()
        self.count = 0

    def __getstate__(self):
        return {name: value for name, value in vars(self).items() if name != "device"}

    def __setstate__(self, state):
        vars(self).update(state)
        if "device" not in vars(self):
            self.device = threading.Event()

    def before_physics_step(self, timekeeper):
        self.count += 1


class Threaded(ModelPlugin):
    def on_initialize(self, config):
        self.device = threading.Event()
'''


@pytest.fixture
def plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    manifest = write_plugins(tmp_path, PLUGINS, "snapshot_plugins")
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", manifest)
    monkeypatch.syspath_prepend(str(tmp_path))


@pytest.fixture
def world(files: Any, plugins: None) -> Iterator[World]:
    rows = ["##########", *["#........#"] * 8, "##########"]
    files.write_map("room", rows)
    files.write("drift.model.yaml", DRIFT)
    world = files.load(WORLD)
    for name in ("robot", "other"):
        world.command(f"/{name}/diff_vel").set(Twist(linear_x=0.7, angular_z=0.3))
        world.command(f"/{name}/cmd_vel").set(Twist(linear_x=0.4, angular_z=0.5))
    world.command("/drift/cmd_vel").set(Twist(linear_x=0.5, angular_z=-0.4))
    for topic in ("scan", "range", "semantic_scan", "odometry", "joint_states", "hitched"):
        world.output(f"/robot/{topic}")
    return world


@pytest.fixture
def small(files: Any, plugins: None) -> World:
    """A world with one robot that has few plugins."""
    files.write("drift.model.yaml", DRIFT)
    model = "{name: drift, model: drift.model.yaml, namespace: drift}"
    world: World = files.load(f"{{properties: {{}}, layers: [{{name: 2d}}], models: [{model}]}}")
    return world


def plugin_model(kind: str) -> str:
    return f"""
    bodies:
      - name: base
        footprints: [{{type: circle, radius: 0.2, density: 1}}]
    plugins: [{{type: "test::{kind}", name: plugin}}]
    """


def test_the_size_of_a_snapshot_grows_with_models(world: World) -> None:
    before = world.snapshot().size
    assert before > 0
    world.spawn_model("drift.model.yaml", "more", "more", (2.0, 2.0, 0.0))
    assert world.snapshot().size > before


def test_the_state_of_all_models(world: World) -> None:
    world.step(30)
    state = world.state()
    assert state.names == ("robot", "other", "box", "drift")
    assert state.poses.shape == state.velocities.shape == (4, 3)
    for number, model in enumerate(world.models):
        assert tuple(state.poses[number]) == model.pose
        assert tuple(state.velocities[number]) == model.bodies[0].velocity
    assert World().state().poses.shape == (0, 3)


def test_a_restored_world_repeats_its_steps(world: World) -> None:
    observations(world, STEPS)
    snapshot = world.snapshot()
    before = world.state_hash()
    expected = observations(world, 50)
    for steps in (50, 20):
        world.restore(snapshot)
        assert (world.state_hash(), world.time) == (before, snapshot.time)
        assert observations(world, steps) == expected[:steps]


def test_a_snapshot_of_a_clone_shares_the_copy_of_all_bodies(world: World) -> None:
    with world.clone() as clone:
        original = world.snapshot()
        shared = clone.snapshot(original=original)
        assert shared._physics is original._physics
        world.step(50)
        clone.step(20)
        with pytest.raises(ValueError, match="bodies differ"):
            clone.snapshot(original=original)
        clone.restore(shared)
        clone.step(50)
        assert clone.state_hash() == world.state_hash()
        # What the clone has done did not change the shared copy.
        world.restore(original)
        world.step(50)
        assert clone.state_hash() == world.state_hash()


def test_a_clone_of_a_clone_of_a_restored_world(world: World) -> None:
    snapshot = world.snapshot()
    expected = observations(world, STEPS)
    world.restore(snapshot)
    with world.clone() as clone, clone.clone() as second:
        inner = second.snapshot()
        assert observations(second, STEPS) == expected
        second.restore(inner)
        assert observations(second, STEPS) == expected
        assert observations(clone, STEPS) == expected


def test_a_clone_is_independent(world: World) -> None:
    world.step(20)
    before = world.state_hash()
    with world.clone() as clone:
        clone.command("/robot/cmd_vel").set(Twist(linear_x=-1.0))
        clone.step(100)
        clone.delete_model("box")
        clone.spawn_model("minimal.model.yaml", "newer", pose=(2.0, 2.0, 0.0))
        assert world.state_hash() == before
        assert [model.name for model in world.models] == ["robot", "other", "box", "drift"]
        found = reachable_worlds(clone)
        assert found == {id(clone)}


def reachable_worlds(root: World) -> set[int]:
    """Returns the worlds and physics worlds that are reachable from the parts of a world."""
    seen: set[int] = set()
    pending: list[object] = [root]
    skipped = (type, types.ModuleType, types.FrameType)
    worlds = set()
    while pending:
        found = pending.pop()
        if id(found) in seen or isinstance(found, skipped):
            continue
        seen.add(id(found))
        if isinstance(found, World):
            worlds.add(id(found))
        if isinstance(found, types.FunctionType):
            pending += [found.__closure__, found.__defaults__, found.__kwdefaults__]
        else:
            pending += gc.get_referents(found)
    return worlds


def test_clones_repeat_the_steps_of_their_closed_original_in_threads(world: World) -> None:
    world.step(20)
    clones = [world.clone() for _ in range(3)]
    assert clones[0].state_hash() == world.state_hash()
    expected = observations(world, STEPS)
    world.close()
    with ThreadPoolExecutor() as pool:
        assert list(pool.map(lambda clone: observations(clone, STEPS), clones)) == [expected] * 3
    for clone in clones:
        clone.close()


def test_restoring_after_models_were_spawned_and_deleted(world: World) -> None:
    world.step(40)
    snapshot = world.snapshot()
    robot, box = world.model("robot"), world.model("box")
    plugin, output = robot.plugin("laser"), world.output("/robot/scan")
    expected = observations(world, STEPS)
    for _ in range(2):
        world.delete_model("robot")
        world.move_model("box", (7.0, 7.0, 0.0), if_blocked="allow")
        newer = world.spawn_model("minimal.model.yaml", "newer", pose=(2.0, 2.0, 0.0))
        assert newer is not None
        world.spawn_model(MODELS, "robot", "robot", (3.0, 3.0, 0.0))
        world.step(30)
        world.restore(snapshot)
        assert [model.name for model in world.models] == ["robot", "other", "box", "drift"]
        assert world.model("robot") is robot
        assert robot.plugin("laser") is plugin
        assert world.model("box") is box
        assert world.ports.find_output("/robot/scan") is output
        with pytest.raises(StaleHandleError):
            _ = newer.pose
        world.output("/robot/scan")
        assert observations(world, STEPS) == expected


def test_observers_are_notified_of_what_is_there_again(world: World, log: Any) -> None:
    snapshot = world.snapshot()
    world.add_observer(log)
    world.step(10)
    world.restore(snapshot)
    assert log.events == []
    world.delete_model("drift")
    expected = ["model_removed newer"]
    for event in log.events:
        opposite = event.replace("closed", "opened").replace("model_removed", "model_added")
        expected.append(opposite)
    world.spawn_model("minimal.model.yaml", "newer", pose=(2.0, 2.0, 0.0))
    log.events.clear()
    world.restore(snapshot)
    assert sorted(log.events) == sorted(expected)


def test_a_reset_can_be_restored_with_its_world_plugins(world: World) -> None:
    (before,) = world.plugins
    world.step(20)
    snapshot, expected = world.snapshot(), world.state_hash()
    world.reset()
    (after,) = world.plugins
    assert after is not before
    ended: list[str] = []
    after.on_shutdown = lambda: ended.append("shutdown")  # type: ignore[method-assign]
    world.restore(snapshot)
    assert world.plugins == [before]
    assert ended == ["shutdown"]
    assert world.state_hash() == expected


class Ros:
    """Access to ROS of a plugin, as far as snapshots are concerned."""

    used = False

    def close(self) -> None:
        pass


def test_plugins_with_access_to_ros_return_unless_they_have_used_it(world: World) -> None:
    class Bridge(flatland.WorldObserver):
        def plugin_ros(self, plugin: Any) -> Ros:
            return Ros()

    world.add_observer(Bridge())
    world.delete_model("drift")
    world.spawn_model("drift.model.yaml", "drift", "drift", (2.0, 6.0, 0.0))
    snapshot = world.snapshot()
    world.delete_model("drift")
    world.restore(snapshot)
    laser = world.model("drift").plugin("laser")
    assert isinstance(laser.ros, Ros)
    laser.ros.used = True
    world.delete_model("drift")
    with pytest.raises(WorldError, match=r'"laser".*attribute "ros" holds a connection'):
        world.restore(snapshot)
    assert "drift" not in [model.name for model in world.models]


def test_observers_are_notified_of_walls_that_are_there_again(
    world: World, log: Any, files: Any
) -> None:
    snapshot, edges = world.snapshot(), world.layers[0].edges
    world.layers[0].add_edges(np.array([[4, 4, 5, 5]], np.float32))
    world.add_observer(log)
    world.restore(snapshot)
    assert log.events == ["layer_changed walls"]
    files.write_map("empty", ["####", "#..#", "####"])
    world.set_layer_map("walls", "empty.yaml")
    log.events.clear()
    world.restore(snapshot)
    assert log.events == ["layer_changed walls"]
    np.testing.assert_array_equal(world.layers[0].edges, edges)


def test_subscribers_remain_after_a_restore_and_are_not_cloned(small: World) -> None:
    received: list[float] = []
    unsubscribe = small.output("/drift/scan").subscribe(lambda scan: received.append(scan.stamp))
    snapshot = small.snapshot()
    small.step(20)
    first, received[:] = list(received), []
    small.restore(snapshot)
    small.step(20)
    assert first
    assert received == first
    with small.clone() as clone:
        received.clear()
        clone.step(20)
        assert received == []
    unsubscribe()


def test_an_output_is_wanted_as_it_is_now_after_a_restore(files: Any) -> None:
    files.write("drift.model.yaml", DRIFT.replace("always_publish: true", ""))
    world = files.load(
        "{properties: {}, layers: [], models: [{name: robot, model: drift.model.yaml}]}"
    )
    world.step(20)  # The first update is always called.
    unwanted = world.snapshot()
    received: list[Any] = []
    world.output("/scan").subscribe(received.append)
    world.step(20)
    count = len(received)
    world.restore(unwanted)
    world.step(20)
    assert len(received) == 2 * count > 0


def test_the_time_of_plugins_is_that_of_the_original_only(small: World) -> None:
    small.plugin_host.costs = costs = PluginCosts()
    with small.clone() as clone:
        clone.step(20)
        assert clone.plugin_host.costs is None
        assert costs.seconds == {}
    small.step(20)
    assert small.plugin_host.costs is costs
    assert costs.seconds


def test_a_copied_subscription_wants_what_the_original_wants(small: World) -> None:
    plugin = small.model("drift").plugins[0]
    output = small.ports.find_output("/drift/scan")
    for wants in (False, True):
        output.subscribe(plugin.before_physics_step, wants=wants)
        with small.clone() as clone:
            assert output.wanted == clone.ports.find_output("/drift/scan").wanted == wants


def test_plugins_of_third_parties_need_to_know_nothing(small: World, files: Any) -> None:
    files.write("everything.model.yaml", plugin_model("Everything"))
    small.spawn_model("everything.model.yaml", "one", pose=(2.0, 2.0, 0.0))
    small.spawn_model("everything.model.yaml", "two", "two", pose=(3.0, 2.0, 0.0))
    small.step(7)
    snapshot = small.snapshot()
    with small.clone() as clone:
        plugin, copied = small.model("one").plugin("plugin"), clone.model("one").plugin("plugin")
        expected = observations(small, STEPS)
        before = plugin.state()
        assert observations(clone, STEPS) == expected
        for _ in range(2):
            small.restore(snapshot)
            assert observations(small, STEPS) == expected
        assert copied is not plugin
        assert copied.inner.owner is copied
        assert copied.view.base is copied.array
        assert str(copied.state()) == str(before)


def test_a_plugin_that_cannot_be_copied_is_named(small: World, files: Any) -> None:
    files.write("generating.model.yaml", plugin_model("Generating"))
    files.write("threaded.model.yaml", plugin_model("Threaded"))
    small.spawn_model("threaded.model.yaml", "thread", pose=(2.0, 2.0, 0.0))
    snapshot = small.snapshot()
    text = 'type "test::Threaded" model "thread": attribute "device" holds .*threading.Event'
    with pytest.raises(WorldError, match=text):
        small.clone()
    small.restore(snapshot)
    small.delete_model("thread")
    with pytest.raises(WorldError, match='"device" holds a connection that ended'):
        small.restore(snapshot)
    small.spawn_model("generating.model.yaml", "generator", pose=(2.0, 2.0, 0.0))
    text = 'type "test::Generating" model "generator": attribute "numbers" holds .* generator'
    for method in (small.snapshot, small.clone):
        with pytest.raises(WorldError, match=text):
            method()
    small.step()


def test_a_plugin_can_define_how_it_is_copied(small: World, files: Any) -> None:
    files.write("connected.model.yaml", plugin_model("Connected"))
    model = small.spawn_model("connected.model.yaml", "robot2", pose=(2.0, 2.0, 0.0))
    assert model is not None
    plugin: Any = model.plugin("plugin")
    device = plugin.device
    small.step(5)
    snapshot = small.snapshot()
    with small.clone() as clone:
        copied: Any = clone.model("robot2").plugin("plugin")
        clone.step(2)
        assert (copied.count, plugin.count) == (7, 5)
        assert copied.device is not device
    small.step(3)
    small.restore(snapshot)
    assert plugin.count == 5
    assert plugin.device is device
    small.delete_model("robot2")
    small.restore(snapshot)
    small.step()
    assert plugin.count == 6


def test_a_recording_contains_the_number_that_a_snapshot_gets(small: World) -> None:
    numbers: list[object] = []

    class Log:
        @contextlib.contextmanager
        def change(self, kind: str, arguments: Any) -> Iterator[None]:
            numbers.append((kind, arguments["number"]))
            yield

        def world_closing(self) -> None:
            pass

    small.log_changes(Log())  # type: ignore[arg-type]
    earlier = small.post(small.snapshot)
    later = small.snapshot()
    assert (earlier.result(timeout=0).number, later.number) == (0, 1)
    assert numbers == [("snapshot", 0), ("snapshot", 1)]


def test_errors(small: World) -> None:
    snapshot = small.snapshot()
    with small.clone() as clone, pytest.raises(WorldError, match="one of another world"):
        clone.restore(snapshot)
    errors: list[BaseException] = []

    def call(_: object) -> None:
        for method in (small.snapshot, small.clone, lambda: small.restore(snapshot)):
            try:
                method()
            except WorldError as error:
                errors.append(error)

    unsubscribe = small.output("/drift/scan").subscribe(call)
    small.step(20)
    unsubscribe()
    assert {str(error).split(": ")[-1] for error in errors} == {
        f"{name} must not be called from a plugin's hook"
        for name in ("snapshot", "clone", "restore")
    }
    small.close()
    for method in (small.snapshot, small.clone, small.state, lambda: small.restore(snapshot)):
        with pytest.raises(WorldError, match="the world is closed"):
            method()


def test_a_clone_is_released(world: World) -> None:
    clone = world.clone()
    clone.step()
    reference = weakref.ref(clone)
    clone.close()
    del clone
    gc.collect()
    assert reference() is None


# -- what plugins connect to their world -------------------------------------------------------


class Helper(flatland.WorldObserver):
    """Counts values and steps on behalf of a plugin that does not refer to it."""

    def __init__(self, plugin: Any) -> None:
        self.plugin = plugin

    def add(self, scan: object) -> None:
        self.plugin.count("helper")

    def step_finished(self) -> None:
        self.plugin.count("observer")


def count_for(plugin: Any, name: str, scan: object) -> None:
    plugin.count(name)


class Connecting(flatland.ModelPlugin):
    """Connects all kinds of functions to its world: when it is loaded, or in its first step."""

    late = False
    extra: Any = None

    def on_initialize(self, config: Any) -> None:
        self.counts: dict[str, int] = {}
        self.value = self.command("value", float)
        self.on_update(self.update)
        if not self.late:
            self.connect()

    def update(self, timekeeper: Any) -> None:
        if self.late and not self.counts:
            self.counts["late"] = 1
            self.connect()

    def connect(self) -> None:
        def local(scan: object, plugin: Any = self) -> None:
            plugin.count("local")

        output = self.world.ports.find_output("/scan")
        output.subscribe(self.method)
        output.subscribe(lambda scan: self.count("lambda"))
        output.subscribe(functools.partial(self.named, "partial"))
        output.subscribe(functools.partial(count_for, self, "function"))
        output.subscribe(local, wants=False)
        output.subscribe(Helper(self).add)
        self.world.add_observer(Helper(self))  # type: ignore[attr-defined]
        self.value.on_change = lambda: self.set_before_step(lambda: self.count("command"))
        self.set_before_step(lambda: self.count("later"))
        if self.extra is not None:
            output.subscribe(self.extra())

    def method(self, scan: object) -> None:
        self.count("method")

    def named(self, name: str, scan: object) -> None:
        self.count(name)

    def count(self, name: str) -> None:
        self.counts[name] = self.counts.get(name, 0) + 1

    def state(self) -> object:
        return dict(self.counts)


class Wanting(flatland.ModelPlugin):
    """Has a scan computed, and keeps the last one."""

    def on_initialize(self, config: Any) -> None:
        self.world.ports.find_output("/scan").want("any name")
        self.on_update(self.read)
        self.last = 0

    def read(self, timekeeper: Any) -> None:
        scan = self.world.ports.find_output("/scan").latest
        self.last = -1 if scan is None else scan.stamp

    def state(self) -> object:
        return self.last


CONNECTED = """
bodies: [{{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}]
plugins:
  - {{name: laser, type: Laser, body: base, range: 5, angle: {{min: -1, max: 1, increment: 0.5}}}}
  - {{name: p, type: "test::{}"}}
"""


@pytest.fixture
def connected(files: Any, declare_plugins: Any) -> Any:
    """Loads a robot with a laser and a plugin that uses its scans."""
    declare_plugins(Connecting, Wanting)

    def load(kind: str = "Connecting") -> World:
        world: World = files.load_model(CONNECTED.format(kind))
        return world

    return load


def counts_of(world: World) -> Any:
    return world.model("robot").plugin("p").counts


@pytest.mark.parametrize("late", [False, True])
def test_a_clone_has_all_that_plugins_have_connected(
    connected: Any, monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    monkeypatch.setattr(Connecting, "late", late)
    world = connected()
    world.step(3 if late else 0)
    with world.clone() as clone, clone.clone() as second:
        assert counts_of(clone) is not counts_of(world)
        for each in (world, clone, second):
            each.command("/value").set(1.0)
            each.step(10)
        names = ["method", "lambda", "partial", "function", "local", "helper"]
        assert len({counts_of(world)[name] for name in names}) == 1
        assert counts_of(world)["observer"] >= 10
        assert counts_of(world)["command"] == counts_of(world)["later"] == 1
        assert counts_of(clone) == counts_of(second) == counts_of(world)
        assert clone.state_hash() == second.state_hash() == world.state_hash()


def test_a_clone_wants_what_its_plugins_want(connected: Any) -> None:
    world = connected("Wanting")
    world.step(2)
    with world.clone() as clone:
        for each in (world, clone):
            each.step(5)
        assert world.model("robot").plugin("p").last > 0
        assert clone.state_hash() == world.state_hash()


def test_functions_from_outside_are_not_cloned(connected: Any) -> None:
    world = connected()
    scans, plugin = types.SimpleNamespace(n=0, lock=iter([])), world.model("robot").plugin("p")

    class Watch(flatland.WorldObserver):
        def step_finished(self) -> None:
            scans.n += 1

        def output_opened(self, output: Any) -> None:
            output.subscribe(lambda value: setattr(scans, "n", scans.n + 1))

    world.output("/scan").subscribe(lambda scan: setattr(scans, "n", scans.n + len(plugin.counts)))
    world.add_observer(Watch())
    world.spawn_model(CONNECTED.format("Wanting"), "two", "two", pose=(3, 3, 0))
    with world.clone() as clone:
        clone.step(5)
        assert scans.n == 0


def uncopyable() -> Any:
    numbers = (number for number in range(3))
    return lambda scan: next(numbers)


@pytest.mark.parametrize(
    ("extra", "name", "held"),
    [
        (uncopyable, "uncopyable.<locals>.<lambda>", "generator"),
        (lambda: functools.partial(print, file=sys.stdout), "print", "EncodedFile|TextIOWrapper"),
        (lambda: queue.Queue().put, "Queue.put", "Lock|Queue|lock|Condition"),
    ],
)
def test_a_subscription_that_cannot_be_cloned_is_named(
    connected: Any, monkeypatch: pytest.MonkeyPatch, extra: Any, name: str, held: str
) -> None:
    monkeypatch.setattr(Connecting, "extra", staticmethod(extra))
    world = connected()
    text = rf'model "robot": the subscription {re.escape(name)} of output "/scan" holds .*({held})'
    with pytest.raises(WorldError, match=text):
        world.clone()
    world.step(3)
    assert counts_of(world)["lambda"] > 0


def test_what_a_plugin_has_connected_ends_and_returns_with_it(connected: Any) -> None:
    world = connected()
    for name in ("two", "three"):
        world.spawn_model(CONNECTED.format("Connecting"), name, name, pose=(3, 3, 0))
    output, plugin = world.ports.find_output("/scan"), world.model("two").plugin("p")
    world.step(2)
    snapshot, connections = world.snapshot(), output.of_plugins
    assert len(connections) == 3 * 6
    world.step(10)
    expected = dict(plugin.counts)
    world.delete_model("two")
    world.step(10)
    assert plugin.counts == expected
    for _ in range(2):
        assert len(output.of_plugins) == 2 * 6
        world.restore(snapshot)
        assert output.of_plugins == connections  # in the same order
        world.step(10)
        assert plugin.counts == expected
        world.delete_model("two")
    with world.clone() as clone:
        clone.delete_model("three")
        assert len(clone.ports.find_output("/scan").of_plugins) == 6
    world.reset()
    assert len(output.of_plugins) == 6
