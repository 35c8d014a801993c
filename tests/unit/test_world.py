"""A world at run time: steps, pause, changes of models, requests of threads."""

from __future__ import annotations

import math

import pytest

import flatland
from flatland import ModelPlugin, WorldError, YamlError
from flatland.loading.world_source import WorldSource
from flatland.runtime.observer import WorldObserver
from flatland.world import World

TWO_BODIES = """
bodies:
  - {name: base, pose: [1, 0, 0.1], footprints: [{type: circle, radius: 0.2, density: 1}]}
  - {name: arm, pose: [1, 1, 0.4], footprints: [{type: circle, radius: 0.1, density: 1}]}
joints:
  - {name: j, type: weld, angle: 0.3,
     bodies: [{name: base, anchor: [0.0998334, 0.9950042]}, {name: arm, anchor: [0, 0]}]}
"""
DRIVEN = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{name: drive, type: DiffDrive, body: base}]
"""


class Probe(ModelPlugin):
    """Records the calls of hooks; `act` is called in the hook named by `hook`."""

    calls: list = []  # noqa: RUF012
    hook = ""
    act = None

    def _record(self, hook):
        type(self).calls.append((self.name, hook, self.world.timekeeper.sim_time_ns))
        if self.hook == hook and type(self).act is not None:
            type(self).act(self)

    def before_physics_step(self, timekeeper):
        self._record("before")

    def after_physics_step(self, timekeeper):
        self._record("after")

    def begin_contact(self, contact):
        self._record("begin")

    def pre_solve(self, contact, old_manifold):
        self._record("pre_solve")

    def end_contact(self, contact):
        self._record("end")

    def on_shutdown(self):
        self._record("shutdown")


@pytest.fixture
def probe(files, declare_plugins):
    """The class `Probe`, declared as a plugin."""
    declare_plugins(Probe)
    Probe.calls = []
    Probe.hook = ""
    Probe.act = None
    files.write(
        "probe.model.yaml",
        """
        bodies: [{name: base, footprints: [{type: circle, radius: 0.5, density: 1}]}]
        plugins: [{name: p, type: "test::Probe"}, {name: q, type: "test::Probe"}]
        """,
    )
    return Probe


@pytest.fixture
def world(empty_world):
    return empty_world


@pytest.mark.parametrize("with_pre_solve", [False, True])
@pytest.mark.parametrize(
    ("iterations", "parted"),
    [
        # Each position iteration removes a fifth of the overlap beyond 5 mm. At the eighth the
        # overlap is below 15 mm, where Box2D stops.
        ("velocity_iterations: 10, position_iterations: 1", 0.2 * 0.045),
        ("velocity_iterations: 1, position_iterations: 10", (1 - 0.8**8) * 0.045),
    ],
)
def test_the_solver_uses_the_iterations_of_the_file(files, iterations, parted, with_pre_solve):
    world = files.load(
        f"""
        properties: {{{iterations}}}
        layers: []
        models:
          - {{name: a, model: minimal.model.yaml}}
          - {{name: b, model: minimal.model.yaml, pose: [0.35, 0, 0]}}
        """
    )
    bodies = [model.bodies[0] for model in world.models]
    if with_pre_solve:
        world.physics.pre_solve = lambda contact, old_manifold: None
        world.physics.pre_solve_bodies = {body.physics.id for body in bodies}
    world.step()
    a, b = bodies
    assert b.pose[0] - a.pose[0] - 0.35 == pytest.approx(parted, abs=1e-4)


def test_time_is_exact_after_many_steps(files):
    world = files.load("{properties: {}, layers: []}", step_size=0.001)
    world.step(12345)
    assert world.timekeeper.sim_time_ns == 12_345_000_000
    assert world.time == 12.345
    assert world.timekeeper.step_size == 0.001
    assert world.timekeeper.max_step_size == 0.001


def test_hooks_run_in_order_with_the_specified_times(probe, world):
    world.spawn_model("probe.model.yaml", "a")
    world.step(2)
    dt = 5_000_000
    assert probe.calls == [
        ("p", "before", 0),
        ("q", "before", 0),
        ("p", "after", dt),
        ("q", "after", dt),
        ("p", "before", dt),
        ("q", "before", dt),
        ("p", "after", 2 * dt),
        ("q", "after", 2 * dt),
    ]


def test_contact_hooks_have_the_time_before_the_step(probe, world):
    world.spawn_model("probe.model.yaml", "a")
    world.spawn_model("minimal.model.yaml", "b", pose=(0.3, 0, 0))
    world.step()
    assert ("p", "begin", 0) in probe.calls
    assert world.contacts[0].body_a.entity.name in ("a", "b")
    world.delete_model("b")
    assert ("p", "end", 5_000_000) in probe.calls
    assert world.contacts == []


def test_pause_stops_hooks_and_time(probe, world):
    world.spawn_model("probe.model.yaml", "a")
    world.pause()
    assert world.paused
    world.step(10)
    assert (world.time, probe.calls) == (0.0, [])
    world.toggle_pause()
    world.step()
    assert world.time == pytest.approx(0.005)
    world.toggle_pause()
    assert world.paused
    world.resume()
    assert not world.paused


def test_a_move_is_rigid_and_sets_velocities_to_zero(files, world):
    files.write("two.model.yaml", TWO_BODIES)
    model = world.spawn_model("two.model.yaml", "m", pose=(5, 5, 0.7))
    base, arm = model.bodies
    base.set_velocity(1, 2, 3)
    arm.set_velocity(1, 2, 3)
    world.move_model("m", (-1, -2, 0.1 + math.pi / 2))
    assert base.pose == pytest.approx((-1, -2, 0.1 + math.pi / 2), abs=1e-5)
    # The arm was 1 m to the left of the base in the model frame, rotated by 0.3 relative to it.
    assert arm.pose == pytest.approx((-2, -2, 0.4 + math.pi / 2), abs=1e-5)
    assert base.velocity == pytest.approx((0, 0, 0))
    assert arm.velocity == pytest.approx((0, 0, 0))
    world.step(50)
    assert base.pose == pytest.approx((-1, -2, 0.1 + math.pi / 2), abs=1e-4)


def test_a_move_that_is_invalid_for_one_body_moves_no_body(files, world):
    files.write("two.model.yaml", TWO_BODIES)
    model = world.spawn_model("two.model.yaml", "m", pose=(5, 5, 0))
    before = [body.pose for body in model.bodies]
    # The arm, 1 m to the left of the base, would be beyond the range of the physics.
    with pytest.raises(ValueError, match=r'pose of body "arm" must be finite and within \+-1e\+09'):
        model.set_pose(0.0, 1e9, 0.0)
    with pytest.raises(WorldError, match=r'failed to move model "m", pose of body "arm" must be'):
        world.move_model("m", (0.0, 1e9, 0.0), if_blocked="allow")
    assert [body.pose for body in model.bodies] == before


def test_a_request_to_a_closing_world_fails(world):
    """A request that is made while the world is closing must not wait forever."""
    future = world.post(lambda: world.spawn_model("minimal.model.yaml", "m"))
    world.close()
    with pytest.raises(WorldError, match="the world is closed"):
        future.result(timeout=0)


def test_a_spawn_that_fails_late_leaves_nothing_behind(files, probe, world):
    files.write(
        "bad.model.yaml",
        """
        bodies:
          - {name: base, footprints: [{type: circle, radius: 1, density: 1}]}
          - {name: other, footprints: []}
        joints: [{name: j, type: weld,
                  bodies: [{name: base, anchor: [0, 0]}, {name: other, anchor: [0, 0]}]}]
        plugins:
          - {name: good, type: "test::Probe"}
          - {name: drive, type: DiffDrive, body: base}
          - {name: bad, type: "test::Probe", unknown_key: 1}
        """,
    )
    with pytest.raises(flatland.PluginError) as caught:
        world.spawn_model("bad.model.yaml", "m")
    assert str(caught.value).startswith(
        'Flatland plugin: Model Plugin "bad" type "test::Probe" model "m": Flatland YAML: Entry '
        'plugin "bad" contains unrecognized entry(s) {"unknown_key"} (in model "m")'
    )
    assert isinstance(caught.value.__cause__, YamlError)
    assert world.models == []
    assert world.physics.ray_cast((-5, 0), (5, 0)) is None
    assert world.ports.outputs == {}
    assert world.ports.commands == {}
    # The plugin that was started is shut down; the one that was not is never called.
    assert probe.calls == [("good", "shutdown", 0)]
    world.step()
    assert probe.calls == [("good", "shutdown", 0)]


def test_delete_shuts_down_plugins_and_releases_everything(probe, world):
    model = world.spawn_model("probe.model.yaml", "a")
    body = model.bodies[0]
    world.delete_model("a")
    assert [call[:2] for call in probe.calls] == [("q", "shutdown"), ("p", "shutdown")]
    world.step()
    assert len(probe.calls) == 2
    assert world.models == []
    with pytest.raises(flatland.StaleHandleError):
        body.pose  # noqa: B018
    world.spawn_model("probe.model.yaml", "a")
    assert [other.name for other in world.models] == ["a"]


@pytest.mark.parametrize("hook", ["before", "after", "begin", "pre_solve"])
def test_requests_of_a_hook_run_after_the_step(probe, world, hook):
    world.spawn_model("probe.model.yaml", "a")
    world.spawn_model("minimal.model.yaml", "b", pose=(0.3, 0, 0))
    seen = []

    def act(plugin):
        probe.act = None
        assert plugin.world.spawn_model("minimal.model.yaml", "new") is None
        plugin.world.move_model("b", (7, 8, 0))
        plugin.world.delete_model("a")
        seen.extend(model.name for model in plugin.world.models)

    probe.hook, probe.act = hook, staticmethod(act)
    world.step()
    assert seen == ["a", "b"]
    assert [model.name for model in world.models] == ["b", "new"]
    assert world.model("b").pose == pytest.approx((7, 8, 0))
    world.step(10)


def test_step_and_close_raise_in_a_hook(files, probe, caplog):
    world = files.load("{properties: {}, layers: []}", plugin_errors="disable")
    world.spawn_model("probe.model.yaml", "a")
    probe.hook, probe.act = "before", staticmethod(lambda p: p.world.step())
    world.step()
    assert "step must not be called from a plugin's hook" in caplog.text
    world.delete_model("a")
    world.spawn_model("probe.model.yaml", "b")
    probe.act = staticmethod(lambda p: p.world.close())
    world.step()
    assert "close must not be called from a plugin's hook" in caplog.text
    assert world.timekeeper.sim_time_ns == 10_000_000


def test_posted_actions_run_in_order_even_while_paused(world):
    world.pause()
    done = []
    futures = [world.post(lambda i=i: done.append(i) or i) for i in range(5)]
    failing = world.post(lambda: 1 / 0)
    assert done == []
    world.step()
    assert done == [0, 1, 2, 3, 4]
    assert [future.result() for future in futures] == [0, 1, 2, 3, 4]
    assert isinstance(failing.exception(), ZeroDivisionError)


def test_a_closed_world_raises_and_may_be_closed_again(probe, world):
    body = world.spawn_model("probe.model.yaml", "a").bodies[0]
    with world as same:
        assert same is world
    assert world.closed
    assert [call[1] for call in probe.calls] == ["shutdown", "shutdown"]
    world.close()
    for action in (
        world.step,
        lambda: world.spawn_model("minimal.model.yaml", "x"),
        lambda: world.move_model("a", (0, 0, 0)),
        lambda: world.delete_model("a"),
        lambda: world.is_free((0, 0), radius=1),
        world.state,
        world.state_hash,
    ):
        with pytest.raises(WorldError, match="the world is closed"):
            action()
    with pytest.raises(flatland.StaleHandleError):
        body.pose  # noqa: B018


def test_a_command_of_a_hook_takes_effect_in_the_same_step(files, probe):
    world = files.load_model(
        DRIVEN.replace("[{name: drive", '[{name: p, type: "test::Probe"}, {name: drive')
    )
    command = world.command("/cmd_vel")
    probe.hook = "before"
    probe.act = staticmethod(lambda p: command.set(flatland.Twist(1.0)))
    world.step()
    assert world.model("robot").bodies[0].velocity == (1.0, 0.0, 0.0)


def test_ports_are_found_by_topic(files, world):
    files.write("driven.model.yaml", DRIVEN)
    world.spawn_model("driven.model.yaml", "a", "r1")
    odometry = world.output("/r1/odometry/filtered")
    assert odometry.latest is None
    assert odometry.wanted
    world.command("/r1/cmd_vel").set(flatland.Twist(linear_x=1.0))
    world.step(200)
    assert odometry.latest.pose[0] == pytest.approx(0.995, abs=0.01)
    assert world.transforms["odom", "r1_base"].x == odometry.latest.pose[0]
    with pytest.raises(WorldError, match=r'"/scan" does not exist; existing outputs: /r1/odom'):
        world.output("/scan")
    with pytest.raises(WorldError, match=r'"/cmd_vel" does not exist; existing commands: /r1/'):
        world.command("/cmd_vel")
    command = world.command("/r1/cmd_vel")
    world.delete_model("a")
    assert world.transforms == {}
    with pytest.raises(WorldError, match="closed with its model"):
        command.set(flatland.Twist())


def test_a_world_can_be_created_without_a_file(tmp_path):
    with World(seed=3, source=WorldSource(folder=tmp_path)) as world:
        (tmp_path / "m.yaml").write_text("bodies: [{name: b, footprints: []}]")
        world.spawn_model("m.yaml", "m")
        world.step(3)
        assert world.time == pytest.approx(0.015)
    with pytest.raises(ValueError, match="seed must be an integer of at least 0"):
        World(seed=-1)


def test_transforms_are_sent_only_to_observers_that_want_them(files):
    class Observer(WorldObserver):
        def __init__(self, wants):
            self.wants = wants
            self.batches = []

        @property
        def wants_transforms(self):
            return self.wants

        def transforms_sent(self, transforms):
            self.batches.append(list(transforms))

    eager, idle = Observer(True), Observer(False)
    world = files.load_model(DRIVEN, observers=[eager, idle])
    world.step(2)
    assert idle.batches == []
    assert [[each.stamp for each in batch] for batch in eager.batches] == [[0], [5_000_000]]
    assert world.transforms == {("odom", "base"): eager.batches[-1][0]}
