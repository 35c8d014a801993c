"""Plugins that fail: the specified errors; the world and other plugins are not affected."""

from __future__ import annotations

import logging
import re
import sys
import threading

import pytest

import flatland
from flatland import FlatlandError, ModelPlugin, PluginError, WorldLockedError, WorldPlugin
from flatland.loading.model_source import ModelSpec
from flatland.runtime.observer import WorldObserver

HOOKS = [
    "before_physics_step",
    "begin_contact",
    "pre_solve",
    "post_solve",
    "after_physics_step",
    "end_contact",
]


class _Faulty:
    """Raises in the hook named by its parameter, and counts the exceptions."""

    start_fault, fault = ValueError, RuntimeError

    def on_initialize(self, config):
        self.calls = 0
        hook = config.get("hook", "string")
        if hook == "on_initialize":
            raise self.start_fault("no device")
        setattr(self, hook, self.fail)

    def fail(self, *arguments):
        self.calls += 1
        raise self.fault(f"fault {self.calls}")


class Model(_Faulty, ModelPlugin):
    pass


class World(_Faulty, WorldPlugin):
    pass


class Exiting(_Faulty, ModelPlugin):
    """Raises the exception of `sys.exit`."""

    start_fault = fault = SystemExit
    exits_when_created = False

    def __init__(self):
        super().__init__()
        if self.exits_when_created:
            sys.exit(3)


class Recovering(ModelPlugin):
    """Succeeds in each third call."""

    calls = 0

    def before_physics_step(self, timekeeper):
        self.calls += 1
        if self.calls % 3:
            raise RuntimeError("once more")


class Witness(ModelPlugin):
    """Counts the calls of all hooks."""

    def on_initialize(self, config):
        self.calls = dict.fromkeys(HOOKS, 0)
        for hook in HOOKS:
            setattr(self, hook, lambda *arguments, hook=hook: self.count(hook))

    def count(self, hook):
        self.calls[hook] += 1

    def on_shutdown(self):
        self.calls = None


class FaultyDrive(ModelPlugin):
    """Drives its robot at 1 m/s, and fails in each step."""

    def on_initialize(self, config):
        drive = self.control(self.model.bodies[0].control_velocity())
        drive.set_target(1.0, 0.0, 0.0)

    def after_physics_step(self, timekeeper):
        raise RuntimeError("no encoder")


class Deleting(ModelPlugin):
    """Requests deletions that fail."""

    def before_physics_step(self, timekeeper):
        self.world.delete_model("nobody")
        self.world.delete_models(["nobody"])


class FaultyCount(ModelPlugin):
    """Fails when it accounts for updates without a call, unless it is asked not to."""

    def on_initialize(self, config):
        self.calls = []
        self.fails = True
        values = self.output("values", float)
        drive = self.control(self.model.bodies[0].control_velocity())
        drive.set_target(0.5, 0.0, 0.0)
        self.on_update(self.update, outputs=[values], skipped=self.count)

    def update(self, timekeeper):
        self.calls.append("update")

    def count(self, count, stamp, poses):
        self.calls.append("count")
        if self.fails:
            raise RuntimeError("no count")


class TwoFaults(ModelPlugin):
    """Has a function of each kind that fails, and others of the same hooks that succeed."""

    source = ""

    def on_initialize(self, config):
        self.calls = 0
        self.on_update(self.succeed, phase="before")
        self.on_update(self.fail_if("update"))
        self.on_update(self.succeed)
        self.drive = self.control(self.model.bodies[0].control_velocity(holonomic=False))
        self.target = 1e12 if self.source == "controller" else 0.0
        self.drive.set_target(self.target, 0.0, 0.0)
        self.on_update(self.request, phase="before")

    def fail_if(self, source):
        def call(timekeeper=None):
            if self.source == source:
                self.calls += 1
                raise RuntimeError("always")

        return call

    def request(self, timekeeper):
        self.set_before_step(self.fail_if("later"))
        self.set_before_step(self.succeed)

    def succeed(self, timekeeper=None):
        pass


class Uneven(ModelPlugin):
    """Has a controller that fails in two of three steps."""

    def on_initialize(self, config):
        self.drive = self.control(self.model.bodies[0].control_velocity(holonomic=False))
        self.on_update(self.set_target, phase="before")
        self.steps = 0

    def set_target(self, timekeeper):
        self.steps += 1
        self.drive.set_target(1e12 if self.steps % 3 else 1.0, 0.0, 0.0)


class Prepared(ModelPlugin):
    """Has updates that are prepared together, and a controller that fails in each step."""

    prepared = 0

    def on_initialize(self, config):
        drive = self.control(self.model.bodies[0].control_velocity(holonomic=False))
        drive.set_target(1e12, 0.0, 0.0)
        for _ in range(2):
            self.on_update(self.update, phase="before", prepare=Prepared.prepare)

    @staticmethod
    def prepare(plugins):
        Prepared.prepared += 1
        assert all(plugin not in plugin.world.plugin_host.disabled for plugin in plugins)

    def update(self, timekeeper):
        pass


class Starting(ModelPlugin):
    """Calls the function `act` of the test in `on_initialize`."""

    act = None

    def on_initialize(self, config):
        self.act()


class Acting(ModelPlugin):
    """Calls the function `act` of the test in `pre_solve`, and stores its exception."""

    act = None

    def on_initialize(self, config):
        self.errors = []

    def pre_solve(self, contact, old_manifold):
        if self.act is not None:
            try:
                self.act(self, contact)
            except Exception as error:
                self.errors.append(error)
                raise


ROBOT = "bodies: [{name: base, footprints: [{type: circle, radius: 0.5, density: 1}]}]\nplugins:\n"


@pytest.fixture(autouse=True)
def _plugins(declare_plugins, caplog):
    """Declares the plugins of this module."""
    declare_plugins(
        *(Model, World, Exiting, Recovering, Witness, FaultyDrive, Deleting, FaultyCount),
        *(Starting, Acting, TwoFaults, Uneven, Prepared),
    )
    caplog.set_level(logging.ERROR, "flatland")


def robot(files, *plugins, name="robot.model.yaml"):
    """Writes a model of one disc with plugins and returns its path."""
    return files.write(name, ROBOT + "".join(f"  - {{{entry}}}\n" for entry in plugins))


WITNESS = 'name: witness, type: "test::Witness"'


def bad(kind, hook=""):
    """Returns the entry of a plugin, which raises in a hook."""
    return f'name: bad, type: "test::{kind}"' + (f", hook: {hook}" if hook else "")


def alone(files, plugin, **options):
    """Loads a world with one robot `r`, which has one plugin."""
    robot(files, plugin)
    text = "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}"
    return files.load(text, **options)


def crowded(files, *plugins, world_plugins="[]", **options):
    """Loads a world whose robot, which has a `Witness`, overlaps four discs.

    Exceptions of plugins are logged, unless `options` contain another policy.
    """
    options.setdefault("plugin_errors", "disable")
    robot(files, *plugins, WITNESS)
    discs = "\n".join(
        f"  - {{name: disc{i}, model: minimal.model.yaml, pose: [{x}, {y}, 0]}}"
        for i, (x, y) in enumerate([(0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5)])
    )
    return files.load(
        "properties: {}\nlayers: []\nmodels:\n"
        f"  - {{name: robot, model: robot.model.yaml}}\n{discs}\nplugins: {world_plugins}\n",
        **options,
    )


def run_all_hooks(world):
    """Runs every hook more than three times, which the witness confirms."""
    world.step(4)
    world.move_model("robot", (20, 0, 0))
    world.step(4)
    assert all(count > 3 for count in world.model("robot").plugin("witness").calls.values())


def robots(world):
    return [model.name for model in world.models if "disc" not in model.name]


@pytest.mark.parametrize(
    ("kind", "hook"),
    [
        *((kind, hook) for kind in ("Model", "World") for hook in HOOKS),
        *(("Exiting", hook) for hook in ("before_physics_step", "pre_solve")),
    ],
)
def test_a_hook_that_always_raises_is_called_three_times(files, caplog, kind, hook):
    if kind == "World":
        world = crowded(files, world_plugins=f"[{{{bad(kind, hook)}}}]")
        [plugin] = world.plugins
        place = 'World Plugin "bad" type "test::World"'
    else:
        world = crowded(files, bad(kind, hook))
        plugin = world.model("robot").plugin("bad")
        place = f'Model Plugin "bad" type "test::{kind}" model "robot"'
    run_all_hooks(world)
    assert plugin.calls == 3
    errors = [record.getMessage() for record in caplog.records if record.name == "flatland"][-2:]
    assert errors == [
        f"{place}: {hook} raised",
        f"{place}: {hook} raised 3 times in a row, the plugin is disabled",
    ]
    # The traceback of the first exception; the other two are throttled.
    assert f"{type(plugin).fault.__name__}: fault 1" in caplog.text
    assert "in fail" in caplog.text
    assert "fault 2" not in caplog.text
    assert world.time == pytest.approx(8 * 0.005)
    # Box2D is not locked, and the faulty plugin is removed like any other.
    world.spawn_model("minimal.model.yaml", "new", pose=(0, 9, 0))
    world.delete_model("robot")
    world.step()


def test_a_disabled_plugin_no_longer_drives_its_robot(files):
    world = alone(files, bad("FaultyDrive"), plugin_errors="disable")
    body = world.model("r").bodies[0]
    world.step(3)
    assert body.velocity == pytest.approx((1.0, 0.0, 0.0))
    body.set_velocity(0.25, 0.0, 0.0)
    world.step()
    assert body.velocity == pytest.approx((0.25, 0.0, 0.0))


def test_a_request_of_a_hook_that_fails_is_logged(files, caplog):
    world = crowded(files, bad("Deleting"))
    world.step()
    text = [record.getMessage() for record in caplog.records][-2:]
    assert text[0].startswith('delete_model "nobody": Flatland World: ')
    assert text[1].startswith("delete_models: Flatland World: ")


def test_a_plugin_that_fails_to_account_for_skipped_updates_is_reported(files, caplog):
    world = crowded(files, bad("FaultyCount"))
    world.step(3)
    world.state_hash()  # for which all updates are accounted for
    assert 'type "test::FaultyCount" model "robot": after_physics_step raised' in caplog.text
    assert "RuntimeError: no count" in caplog.text


@pytest.mark.parametrize("change", ["delete", "step", "hash", "move", "restore"])
def test_a_plugin_can_be_disabled_by_whatever_has_updates_counted(files, change):
    world = crowded(files, bad("FaultyCount"))
    plugin, snapshot = world.model("robot").plugin("bad"), world.snapshot()
    bodies = world.physics.object_counts().bodies
    for _ in range(2):
        world.step(5)
        world.state_hash()
    world.step(5)
    time = world.time
    if change == "delete":
        world.delete_model("robot")
        assert robots(world) == []
        assert world.physics.object_counts().bodies == bodies - 1
    elif change == "move":
        world.move_model("robot", (20, 0, 0))
    elif change == "hash":
        world.state_hash()
    elif change == "restore":
        world.restore(snapshot)
        time = 0.0
    world.output("/values") if change == "step" else None
    world.step(3)
    assert world.time == pytest.approx(time + 3 * 0.005)
    assert plugin.calls.count("count") == (0 if change == "restore" else 3)
    assert world.model("disc0")
    if change in ("step", "hash", "move"):
        assert world.plugin_host.disabled == {plugin}
        body = world.model("robot").bodies[0]
        body.set_velocity(0.25, 0.0, 0.0)
        world.step()
        assert body.velocity[0] != pytest.approx(0.5)  # Its controller was removed.


def test_the_step_in_which_a_controller_disables_its_plugin_is_complete(files):
    Prepared.prepared = 0
    world = crowded(files, bad("Prepared"))
    for n in range(6):
        world.step()
        assert world.time == pytest.approx((n + 1) * 0.005)
    assert [plugin.name for plugin in world.plugin_host.disabled] == ["bad"]
    assert Prepared.prepared == 2
    witness = world.model("robot").plugin("witness")
    assert witness.calls["before_physics_step"] == witness.calls["after_physics_step"] == 6


@pytest.mark.parametrize("source", ["update", "later", "controller"])
def test_each_function_of_a_plugin_has_a_count_of_its_own(files, monkeypatch, caplog, source):
    monkeypatch.setattr(TwoFaults, "source", source)
    world = alone(files, bad("TwoFaults"), plugin_errors="disable")
    world.step(10)
    assert [plugin.name for plugin in world.plugin_host.disabled] == ["bad"]
    assert world.model("r").plugin("bad").calls == (0 if source == "controller" else 3)
    assert caplog.text.count("the plugin is disabled") == 1


def test_a_controller_that_succeeds_in_between_is_not_disabled(files):
    world = alone(files, bad("Uneven"), plugin_errors="disable")
    world.step(12)
    assert not world.plugin_host.disabled
    assert world.model("r").plugin("bad").steps == 12


def test_a_hook_that_succeeds_in_between_is_not_disabled(files):
    world = crowded(files, bad("Recovering"))
    world.step(12)
    assert world.model("robot").plugin("bad").calls == 12
    assert not world.plugin_host.disabled


@pytest.mark.parametrize("timeout", [None, 10])
def test_a_plugin_that_exits_during_initialization_fails_only_its_model(
    files, monkeypatch, timeout
):
    world = crowded(files, plugin_timeout=timeout)
    robot(files, WITNESS, bad("Exiting", "on_initialize"), name="bad.yaml")
    with pytest.raises(PluginError, match=r'model "second": SystemExit no device \['):
        world.spawn_model("bad.yaml", "second")
    monkeypatch.setattr(Exiting, "exits_when_created", True)
    with pytest.raises(PluginError, match=r'Exiting" cannot be instantiated: SystemExit: 3 \['):
        world.spawn_model("bad.yaml", "second")
    run_all_hooks(world)


def test_a_plugin_that_raises_in_on_initialize_fails_only_its_model(files):
    world = crowded(files)
    robot(files, WITNESS, bad("Model", "on_initialize"), name="bad.yaml")
    with pytest.raises(PluginError) as caught:
        world.spawn_model("bad.yaml", "second")
    assert re.fullmatch(
        'Flatland plugin: Model Plugin "bad" type "test::Model" model "second": no device'
        r" \[.*bad\.yaml:\d+\]",
        str(caught.value),
    )
    assert isinstance(caught.value.__cause__, ValueError)
    assert robots(world) == ["robot"]
    run_all_hooks(world)


def test_an_interrupt_during_initialization_is_raised_and_leaves_no_model(files, monkeypatch):
    world = crowded(files)
    monkeypatch.setattr(Model, "start_fault", KeyboardInterrupt)
    robot(files, WITNESS, bad("Model", "on_initialize"), name="bad.yaml")
    with pytest.raises(KeyboardInterrupt, match="no device"):
        world.spawn_model("bad.yaml", "second")
    assert robots(world) == ["robot"]
    run_all_hooks(world)


def test_a_world_plugin_that_raises_in_on_initialize_fails_the_world(files):
    with pytest.raises(PluginError) as caught:
        crowded(files, world_plugins=f"[{{{bad('World', 'on_initialize')}}}]")
    assert re.fullmatch(
        'Flatland plugin: World Plugin "bad" type "test::World": no device'
        r" \[.*world\.yaml:\d+\]",
        str(caught.value),
    )
    assert isinstance(caught.value.__cause__, ValueError)


def test_a_model_is_deleted_completely_at_an_interrupt(files, monkeypatch):
    monkeypatch.setattr(Model, "fault", KeyboardInterrupt)
    world = crowded(files, bad("Model", "on_shutdown"))
    model = world.model("robot")
    witness, counts = model.plugin("witness"), world.physics.object_counts()
    with pytest.raises(KeyboardInterrupt):
        world.delete_model("robot")
    assert witness.calls is None
    assert robots(world) == []
    assert world.physics.object_counts().bodies == counts.bodies - 1
    world.step()


def test_a_model_whose_body_was_destroyed_can_be_deleted(files):
    world = crowded(files)
    model = world.model("robot")
    model.bodies[0].destroy()
    world.delete_model("robot")
    assert robots(world) == []
    world.step()


@pytest.mark.parametrize("kind", ["Model", "Exiting"])
def test_a_plugin_that_raises_in_on_shutdown_is_removed(files, caplog, kind):
    world = crowded(files, bad(kind, "on_shutdown"))
    body = world.model("robot").body("base")
    other = world.model("robot").plugin("witness")
    world.delete_model("robot")
    assert f'"bad" type "test::{kind}" model "robot": on_shutdown raised' in caplog.text
    assert ("SystemExit" if kind == "Exiting" else "RuntimeError") + ": fault 1" in caplog.text
    assert other.calls is None
    assert not body.physics.alive
    world.step()
    assert world.contacts == []


def test_a_plugin_whose_on_initialize_does_not_return_is_interrupted(files, monkeypatch):
    """tests/unit/runtime/test_time_limit.py has other kinds of code that does not return."""
    started = []

    def block(plugin):
        started.append(plugin)
        plugin.output("early", float)
        threading.Event().wait()  # a lock, taken in C

    monkeypatch.setattr(Starting, "act", block)
    # The other plugins are loaded within this time on a busy machine, too.
    world = crowded(files, plugin_timeout=1.0)
    robot(files, WITNESS, bad("Starting"), name="bad.yaml")
    with pytest.raises(PluginError) as caught:
        world.spawn_model("bad.yaml", "second")
    assert str(caught.value).startswith(
        'Flatland plugin: Model Plugin "bad" type "test::Starting" model "second": '
        "on_initialize did not return within 1 s ["
    )
    assert world.ports.outputs == {}
    assert robots(world) == ["robot"]
    run_all_hooks(world)
    with pytest.raises(PluginError, match='plugin "bad" has ended and cannot open "late"'):
        started[0].output("late", float)
    assert world.ports.outputs == {}


def start_everything(plugin):
    """Uses all that a plugin can declare and create."""
    world, body = plugin.world, plugin.model.bodies[0]
    seen = plugin.seen = []

    def record(*arguments):
        seen.append(arguments)

    plugin.output("own", float)
    plugin.command("own_command", float)
    plugin.control(body.control_velocity()).set_target(1.0, 0.0, 0.0)
    plugin.on_update(record)
    plugin.begin_contact = plugin.before_physics_step = record
    plugin.set_before_step(record)
    plugin.send_transform("a", "b", 0.0, 0.0, 0.0)
    world.ports.find_output("/values").subscribe(record)
    world.ports.find_output("/values").subscribe(lambda value: record(plugin, value))
    world.ports.find_output("/values").want("me")
    world.add_observer(Observing())
    world.spawn_model("minimal.model.yaml", "trailer", pose=(9, 9, 0))
    own = world.physics.create_body("dynamic", (8, 8, 0))
    own.create_circle((0, 0), 0.1, density=1.0)
    world.physics.create_weld_joint(own, world.model("disc0").bodies[0], (0, 0), (0, 0))
    Starting.started.append(plugin)


class Observing(WorldObserver):
    """Counts steps."""

    steps = 0

    def step_finished(self):
        Observing.steps += 1


@pytest.mark.parametrize("how", ["raises", "job", "batch", "later_plugin"])
def test_a_failed_start_leaves_nothing_behind(files, monkeypatch, how):
    """The creation of a job fails if a body was destroyed."""
    Starting.started, Observing.steps = [], 0

    def act(plugin):
        start_everything(plugin)
        if how == "job":
            body = plugin.world.physics.create_body("static", (0, 0, 0))
            plugin.on_update(lambda timekeeper: None, bodies=[body])
            body.destroy()
        elif how != "later_plugin":
            raise ValueError("no device")

    monkeypatch.setattr(Starting, "act", act)
    world = crowded(files, bad("FaultyCount"))
    world.model("robot").plugin("bad").fails = False
    world.step()
    output = world.ports.find_output("/values")
    before = world.state_hash(), world.physics.object_counts(), set(world.ports.outputs)
    names, transforms = [model.name for model in world.models], set(world.transforms)
    later = [bad("Model", "on_initialize").replace("name: bad", "name: other")]
    robot(files, bad("Starting"), *(later if how == "later_plugin" else []), name="bad.yaml")
    good = [ModelSpec("minimal.model.yaml", "good", pose=(5, 5, 0))] if how == "batch" else []
    with pytest.raises(FlatlandError):
        world.spawn_models([*good, ModelSpec("bad.yaml", "second")])
    after = world.state_hash(), world.physics.object_counts(), set(world.ports.outputs)
    assert after == before
    assert [model.name for model in world.models] == names
    assert not output.wanted
    world.step(5)
    output.emit(1.0)
    assert len(Starting.started) == 1
    assert Starting.started[0].seen == []
    assert Observing.steps == 0
    assert set(world.transforms) == transforms


@pytest.mark.parametrize("timeout", [None, 10, 1e300, float("inf")])
def test_on_initialize_runs_in_the_loading_thread(files, monkeypatch, timeout):
    threads = []
    monkeypatch.setattr(Starting, "act", lambda _: threads.append(threading.current_thread()))
    alone(files, bad("Starting"), plugin_timeout=timeout)
    assert threads == [threading.current_thread()]


@pytest.mark.parametrize("method", ["step", "close"])
def test_on_initialize_may_not_step_or_close_the_world(files, monkeypatch, method):
    world = crowded(files)
    monkeypatch.setattr(Starting, "act", lambda plugin: getattr(plugin.world, method)())
    robot(files, bad("Starting"), name="bad.yaml")
    with pytest.raises(PluginError, match=f"{method} must not be called from a plugin's hook"):
        world.spawn_model("bad.yaml", "second")
    assert not world.closed
    assert world.time == 0.0


# -- plugin_errors="raise" -------------------------------------------------------------------


@pytest.mark.parametrize("hook", HOOKS)
def test_step_raises_the_exception_of_a_hook_after_completing_the_step(files, hook):
    world = crowded(files, bad("Model", hook), plugin_errors="raise")
    if hook == "end_contact":
        world.step()
        world.move_model("robot", (20, 0, 0))
    witness = world.model("robot").plugin("witness")
    time, calls = world.time, dict(witness.calls)
    with pytest.raises(RuntimeError, match="fault 1") as caught:
        world.step()
    place = 'Model Plugin "bad" type "test::Model" model "robot"'
    assert caught.value.__notes__ == [f"raised by {place}: {hook}"]
    assert world.time == pytest.approx(time + 0.005)
    # The hooks of the other plugins ran too, and the plugin is not disabled.
    assert witness.calls["after_physics_step"] == calls["after_physics_step"] + 1
    plugin = world.model("robot").plugin("bad")
    before = plugin.calls
    if hook != "begin_contact" and hook != "end_contact":
        for _ in range(4):
            with pytest.raises(RuntimeError, match="fault"):
                world.step()
        assert plugin.calls >= before + 4


def test_sys_exit_of_a_plugin_is_raised_as_a_plugin_error(files):
    hook = "before_physics_step"
    world = crowded(files, bad("Exiting", hook), plugin_errors="raise")
    with pytest.raises(PluginError, match=f"{hook} raised SystemExit"):
        world.step()


def test_close_raises_the_exception_of_on_shutdown_after_closing(files):
    world = crowded(files, bad("Model", "on_shutdown"), plugin_errors="raise")
    with pytest.raises(RuntimeError, match="fault 1"):
        world.close()
    assert world.closed
    world.close()


def test_an_exception_of_a_with_block_is_not_replaced_by_one_of_a_plugin(files):
    world = crowded(files, bad("Model", "on_shutdown"), plugin_errors="raise")
    with pytest.raises(KeyError), world:
        raise KeyError
    assert world.closed


def test_an_error_of_a_file_is_not_replaced_by_one_of_a_plugin(files):
    robot(files, bad("Model", "on_shutdown"))
    with pytest.raises(flatland.YamlError, match="unrecognized entry"):
        files.load(
            "properties: {}\nlayers: []\nmodels: [{name: r, model: robot.model.yaml}]\nmodel: 1\n"
        )


def test_connections_that_cannot_be_closed_are_logged(files, caplog):
    class Connections:
        def close(self):
            raise OSError("no route")

    class Node(flatland.WorldObserver):
        def plugin_ros(self, plugin):
            return Connections()

    world = alone(files, WITNESS, observers=[Node()])
    world.delete_model("r")
    (record,) = caplog.records
    assert "closing its ROS connections failed" in record.getMessage()
    assert 'model "r"' in record.getMessage()
    assert str(record.exc_info[1]) == "no route"
    assert world.models == []


LASER = "type: Laser, name: laser, body: base, range: 5, angle: {min: 0, max: 1, increment: 1}"


def fail(scan):
    raise ValueError("broken subscriber")


def test_an_exception_of_a_subscriber_is_raised_by_step_and_not_blamed_on_the_plugin(files):
    world = alone(files, LASER, plugin_errors="raise")
    output = world.output("/scan")
    unsubscribe = output.subscribe(fail)
    for _ in range(5):
        with pytest.raises(ValueError, match="broken subscriber") as caught:
            world.step()
    assert caught.value.__notes__ == ['raised by subscriber fail of output "/scan"']
    unsubscribe()
    stamp = output.latest.stamp
    world.step()
    assert output.latest.stamp > stamp


def test_an_exception_of_a_subscriber_is_logged_and_never_disables_the_plugin(files, caplog):
    world = alone(files, LASER, plugin_errors="disable")
    output = world.output("/scan")
    output.subscribe(fail)
    world.step(10)
    assert output.latest.stamp == 9 * world.timekeeper.step_size_ns
    assert caplog.text.count("ValueError: broken subscriber") == 1
    assert 'subscriber fail of output "/scan" raised' in caplog.text
    assert "disabled" not in caplog.text


# -- within the physics step -----------------------------------------------------------------


def acting(files):
    """A world whose robot calls a function in `pre_solve`."""
    world = crowded(files, 'name: acting, type: "test::Acting"')
    return world, world.model("robot").plugin("acting")


REFUSED = {
    "set_pose": lambda plugin, contact: contact.body_b.set_pose(5, 5, 0),
    "model set_pose": lambda plugin, contact: plugin.model.set_pose(5, 5, 0),
}


@pytest.mark.parametrize("what", REFUSED)
def test_pre_solve_may_not_change_the_world(files, caplog, what):
    world, plugin = acting(files)
    plugin.act = REFUSED[what]
    world.step()
    assert plugin.errors
    assert all(isinstance(error, WorldLockedError) for error in plugin.errors)
    assert '"acting" type "test::Acting" model "robot": pre_solve raised' in caplog.text
    # Box2D is intact: this step was completed, and so are the next ones.
    assert len(world.models) == 5
    assert len(world.contacts) == 4
    run_all_hooks(world)


def test_an_exception_in_pre_solve_does_not_change_the_contact(files):
    """The discs push each other apart as they do without the plugin."""
    quiet, _ = acting(files)
    quiet.step(20)
    loud, plugin = acting(files)
    plugin.act = lambda plugin, contact: 1 / 0
    loud.step(20)
    assert len(plugin.errors) == 3
    assert [model.pose for model in loud.models] == [model.pose for model in quiet.models]


def test_contacts_of_bodies_without_a_model_are_ignored(files):
    """A plugin may create bodies in the physics world; hooks are not called for them."""
    world, plugin = acting(files)
    stranger = world.physics.create_body("dynamic", (0.2, 0.2, 0))
    stranger.create_circle((0, 0), 0.1, density=1)
    seen = []
    plugin.act = lambda plugin, contact: seen.append(contact)
    world.step()
    assert len(seen) == 4
    assert world.physics.take_pre_solve_errors() == []
    assert len(world.contacts) == 4


def test_an_interrupt_in_pre_solve_is_raised_by_the_step(files):
    """Control-C often interrupts the hook, as the rest of a step runs no Python code."""
    world, plugin = acting(files)

    def act(plugin, contact):
        raise KeyboardInterrupt

    plugin.act = act
    with pytest.raises(KeyboardInterrupt):
        world.step()
    plugin.act = None
    world.step()
