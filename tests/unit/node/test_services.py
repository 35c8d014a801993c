"""The services of the node, without ROS."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from waiting import TIMEOUT, wait_until

from flatland.errors import WorldError
from flatland.node import services
from flatland.node.transport import REGISTRATION_TIMEOUT, CallError
from flatland.runtime import file_reads
from flatland.values import OccupancyGrid

STEP_NS = 5_000_000

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""


def pose(x: float = 0.0, y: float = 0.0, theta: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(x=x, y=y, theta=theta)


@pytest.fixture
def opening(transport: Any) -> Iterator[threading.Event]:
    """The topics that are opened after the first step wait for it."""
    event = threading.Event()
    transport.load_handle_server = lambda: not event.wait(TIMEOUT) or None
    yield event
    event.set()


@pytest.fixture
def node(serve: Any, files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return serve(lockstep=True)


def spawn(node: Any, name: str, x: float = 0.0) -> Any:
    return node.call("spawn_model", yaml_path="robot.model.yaml", name=name, ns="r", pose=pose(x))


SLOW = {"yaml_path": "slow.yaml", "name": "slow", "ns": "slow", "pose": pose()}


@pytest.fixture
def blocked_file(files: Any, block_file: Any) -> threading.Event:
    files.write("slow.yaml", ROBOT)
    return block_file("slow.yaml")


def test_a_file_that_blocks_delays_only_its_caller(
    node: Any, blocked_file: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_reads, "TIME_LIMIT", TIMEOUT)
    with ThreadPoolExecutor() as threads:
        answer = threads.submit(node.call, "spawn_model", **SLOW)
        assert node.call("step_world", duration=0.1).success
        assert spawn(node, "first").success
        assert not answer.done()
        blocked_file.set()
        assert answer.result(TIMEOUT).success
    assert node.run(lambda: [model.name for model in node.world.models]) == ["first", "slow"]


def test_a_call_fails_if_its_files_are_not_read_in_time(
    node: Any, blocked_file: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    del blocked_file
    monkeypatch.setattr(file_reads, "TIME_LIMIT", 0.01)
    late = node.call("spawn_models", models=[SimpleNamespace(**SLOW)])
    text = "Flatland World: the files were not read within 0.01 s"
    assert (late.success, late.message, late.index) == (False, text, -1)
    late = node.call(
        "set_layer_map", layer="2d", map_path="slow.yaml", grid=SimpleNamespace(data=[])
    )
    assert (late.success, late.message) == (False, text)


@pytest.mark.parametrize("toggles", [1, 2])
def test_toggles_during_a_drag_outlast_it(node: Any, toggles: int) -> None:
    holds = node.served.simulation.holds
    node.run(lambda: holds.hold("drag"))
    node.call("toggle_pause")
    assert not node.world.paused
    if toggles == 2:
        node.call("toggle_pause")
    node.run(lambda: holds.release("drag"))
    assert node.world.paused is (toggles == 2)


def test_a_node_is_ready_after_all_topics_are_open_registered_and_connected(
    opening: threading.Event, node: Any, transport: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: 10.0 + sum(slept), sleep=slept.append)
    monkeypatch.setattr(services, "time", clock)

    def message(*topics: str, timeout: float = 0.0) -> str:
        answer = node.call("wait_until_ready", topics=topics, timeout=timeout)
        assert answer.success is not hasattr(answer, "message")
        return getattr(answer, "message", "")

    opened = "the topics that are opened after the first step are not open"
    assert message("/tf") == f"not ready after 0 s: {opened}"
    opening.set()
    wait_until("the topics", lambda: opened not in message())
    transport.topics["/tf"].connect()
    transport.registers = False
    registered = "the registration with the ROS master is not complete"
    assert message("/tf") == f"not ready after 0 s: {registered}"
    assert transport.flushed[-1] == 0.01
    transport.registers = True
    assert message("/tf") == ""
    missing = "no connection to model_states, /clock"
    assert message("/tf", "model_states", "/clock") == f"not ready after 0 s: {missing}"
    assert slept == []
    missing = "no connection to /clock"
    assert message("/clock", timeout=0.5) == f"not ready after 0.5 s: {missing}"
    assert set(slept) == {0.01}
    assert sum(slept) == pytest.approx(0.5, abs=0.011)
    transport.shutting_down = True
    assert message("/clock", timeout=0.5) == "the simulator is shutting down"


def test_models_are_spawned_moved_and_deleted(node: Any) -> None:
    assert spawn(node, "a", 1.0).success
    assert node.call("move_model", name="a", pose=pose(2.0, 3.0, 0.5)).success
    answer = node.call("get_model_states", names=[])
    assert (answer.success, answer.states.names, answer.states.namespaces) == (True, ("a",), ["r"])
    assert answer.states.poses.tolist() == [[2.0, 3.0, 0.5]]
    assert node.call("delete_model", name="a").success
    node.transport.flushed.clear()
    again = node.call("delete_model", name="a")
    assert again.success is False
    assert again.message.endswith('model with name "a" does not exist')
    assert node.transport.flushed == [REGISTRATION_TIMEOUT]


def test_similar_models_are_hints(node: Any) -> None:
    spawn(node, "cart1", 1.0)
    spawn(node, "cart2", 2.0)
    missing = 'model with name "cart" does not exist'
    for call, fields, start in (
        ("delete_model", {"name": "cart"}, "failed to delete model, "),
        ("delete_models", {"names": ["cart1", "cart"]}, "names[1]: failed to delete model, "),
        ("move_model", {"name": "cart", "pose": pose(0.0, 0.0, 0.0)}, "failed to move model, "),
        ("get_model_states", {"names": ["cart"]}, ""),
    ):
        answer = node.call(call, **fields)
        assert answer.success is False
        assert answer.message == (
            f'Flatland World: {start}{missing} (hint: did you mean "cart1" or "cart2"?)'
        )


def test_appearances_are_changed(node: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    spawn(node, "a")
    (body,) = node.world.model("a").bodies
    layers: list[Any] = []
    change = node.world.set_appearance

    def set_appearance(*arguments: Any, **options: Any) -> None:
        layers.append(options["layers"])
        change(*arguments, **options)

    monkeypatch.setattr(node.world, "set_appearance", set_appearance)
    request = {"model": "a", "body": "base"}
    red = [1.0, 0.0, 0.0, 0.5]
    for color, given, number, visible in (
        (red, ["2d"], -1, False),
        ([], [], 0, False),
        ([], [], 1, True),
    ):
        answer = node.call("set_appearance", color=color, layers=given, visible=number, **request)
        assert answer.success
        assert (list(body.color), body.visible) == (red, visible)
    assert layers == [["2d"], None, None]


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (WorldError("no such model"), "no such model"),
        (KeyError("cause"), "KeyError: 'cause'"),
        (CallError("blocked"), "blocked"),
    ],
)
def test_a_failure_is_part_of_the_response(
    node: Any,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    error: Exception,
    message: str,
) -> None:
    def fail(*_: object) -> None:
        raise error

    for name in ("delete_model", "pause"):
        monkeypatch.setattr(node.world, name, fail)
    answer = node.call("delete_model", name="a")
    assert answer.success is False
    assert answer.message.endswith(message)
    with pytest.raises(CallError):  # The response has no fields.
        node.call("pause")
    expected = ["unexpected internal error in a service call"] * 2
    logged = [each.getMessage() for each in caplog.records if each.levelname == "ERROR"]
    assert logged == (expected if isinstance(error, KeyError) else [])


def test_the_time_is_controlled(node: Any) -> None:
    for name, paused in (("pause", True), ("resume", False), ("toggle_pause", True)):
        assert vars(node.call(name)) == {}
        assert node.world.paused is paused
    node.call("step_world", duration=0.1)
    for seed, keep_time, expected in ((-1, True, (1, 20)), (0, False, (0, 0))):
        assert node.call("reset_world", seed=seed, keep_time=keep_time).success
        assert (node.world.seed, node.world.timekeeper.sim_time_ns // STEP_NS) == expected


def test_states_are_published_in_each_step_without_a_rate(serve: Any) -> None:
    node = serve(lockstep=True, model_states_rate=0)
    topic = node.transport.topics["model_states"]
    topic.connect()
    node.run(topic.sent.clear)
    node.call("step_world", duration=0.1)
    assert len(topic.sent) == 20


def test_batches_succeed_or_name_the_item(node: Any) -> None:
    def spec(name: str, x: float, path: str = "robot.model.yaml") -> SimpleNamespace:
        return SimpleNamespace(yaml_path=path, name=name, ns=f"n{name}", pose=pose(x, 1.0, 2.0))

    failed = node.call("spawn_models", models=[spec("a", 0.0), spec("b", 0.0, "none.model.yaml")])
    assert (failed.success, failed.index) == (False, 1)
    assert node.world.models == []
    done = node.call("spawn_models", models=[spec("a", 0.0), spec("b", 3.0)])
    poses = [(0.0, 1.0, 2.0), (3.0, 1.0, 2.0)]
    assert (done.success, done.message, done.index, done.poses) == (True, "", -1, poses)
    assert node.call("get_model_states", names=[]).states.namespaces == ["na", "nb"]
    done = node.call("move_models", models=[spec("b", 5.0), spec("a", 6.0)])
    poses = [(5.0, 1.0, 2.0), (6.0, 1.0, 2.0)]
    assert (done.success, done.message, done.index, done.poses) == (True, "", -1, poses)
    assert node.call("move_models", models=[spec("c", 0.0)]).index == 0
    assert node.call("delete_models", names=["a", "c"]).index == 1
    assert node.call("delete_models", names=["a"]).index == -1
    assert [model.name for model in node.world.models] == ["b"]


@pytest.mark.parametrize(
    ("duration", "steps"), [(0.0, 1), (0.005, 1), (0.1, 20), (0.0050000001, 1), (1.0, 200)]
)
def test_a_duration_is_a_number_of_steps(node: Any, duration: float, steps: int) -> None:
    before = node.call("step_world", duration=0.0).stamp
    answer = node.call("step_world", duration=duration)
    assert (answer.success, answer.message) == (True, "")
    assert answer.stamp == before + steps * STEP_NS


def test_all_messages_of_the_steps_are_sent_before_the_response(node: Any) -> None:
    assert spawn(node, "a").success
    topics = node.transport.topics
    for name in ("/clock", "/tf", "r/odometry/filtered"):
        topics[name].connect()
        topics[name].sent.clear()
    end = node.call("step_world", duration=0.1).stamp
    assert not node.transport.is_delayed
    assert topics["/clock"].sent == list(range(STEP_NS, end + 1, STEP_NS))
    odometry = topics["r/odometry/filtered"].sent
    assert [value.stamp for value in odometry] == list(range(0, end, STEP_NS))


def test_a_limited_clock_is_sent_before_the_response(serve: Any) -> None:
    node = serve(lockstep=True, clock_rate=1e-3)
    clock = node.transport.topics["/clock"]
    clock.connect()
    for number in range(1, 4):
        assert node.call("step_world", duration=0.1).stamp == number * 20 * STEP_NS
        assert clock.sent[-1] == number * 20 * STEP_NS
    assert len(clock.sent) < 10


def test_steps_of_a_running_world_are_additional(serve: Any) -> None:
    node = serve(update_rate=1e-3)  # The second step is due after 1000 s.
    wait_until("the first step", lambda: node.world.timekeeper.sim_time_ns == STEP_NS)
    assert node.call("step_world", duration=0.1).stamp == 21 * STEP_NS
    node.call("pause")
    assert node.call("step_world", duration=0.0).stamp == 22 * STEP_NS


@pytest.mark.parametrize(
    ("duration", "message"),
    [
        (-0.005, "duration must be finite and not negative [s], got -0.005"),
        (math.nan, "duration must be finite and not negative [s], got nan"),
        (math.inf, "duration must be finite and not negative [s], got inf"),
        (-math.inf, "duration must be finite and not negative [s], got -inf"),
        (0.0075, "duration must be a multiple of the step size, 0.005 s, got 0.0075"),
        (1e-9, "duration must be a multiple of the step size, 0.005 s, got 1e-09"),
        (5e-324, "duration must be a multiple of the step size, 0.005 s, got 5e-324"),
        (3600.005, "duration must be at most 3600 s, got 3600.005"),
        (1e308, "duration must be at most 3600 s, got 1e+308"),
    ],
)
def test_an_invalid_duration_is_refused(node: Any, duration: float, message: str) -> None:
    node.call("step_world", duration=0.01)
    answer = node.call("step_world", duration=duration)
    assert (answer.success, answer.message, answer.stamp) == (False, message, 10_000_000)


def test_steps_end_before_the_longest_time(node: Any) -> None:
    start = 2**61 - 2 * STEP_NS
    node.run(lambda: setattr(node.world.timekeeper, "sim_time_ns", start))
    assert node.call("step_world", duration=0.005).stamp == start + STEP_NS
    for duration in (0.0, 0.01):
        answer = node.call("step_world", duration=duration)
        message = "the simulated time must remain below 2305843009 s (73 years)"
        assert (answer.success, answer.message) == (False, message)


def test_steps_report_dropped_messages(node: Any) -> None:
    lost = {("/scan", "/slow"): 3, ("/clock", "/slow"): 9, ("/odom", "/slow"): 1}
    node.transport.lost.update(lost)
    answer = node.call("step_world", duration=0.0)
    assert answer.message == (
        "1 messages of /odom to /slow were dropped, 3 messages of /scan to /slow were dropped"
    )
    assert (answer.success, answer.stamp) == (True, 5_000_000)
    assert node.call("step_world", duration=0.0).message == ""


class GridMessage(OccupancyGrid):
    """A grid with the field that the service reads of a message."""

    @property
    def data(self) -> Any:
        return self.cells.ravel()


def test_maps_are_received_and_read(node: Any, files: Any) -> None:
    grid = GridMessage((1.0, 2.0, 0.0), 0.5, np.full((1, 1), 100, np.int8))
    empty = SimpleNamespace(data=[])
    request = {"layer": "2d", "map_path": ""}
    assert node.call("set_layer_map", grid=grid, **request).success
    assert len(node.world.layers[0].edges) == 4
    request["map_path"] = files.write_map("room", ["#"])
    assert node.call("set_layer_map", grid=empty, **request).success
    assert len(node.world.layers[0].edges) == 4
    for path, given in (("", empty), (request["map_path"], grid)):
        answer = node.call("set_layer_map", layer="2d", map_path=path, grid=given)
        assert answer.success is False
        assert answer.message == "exactly one of map_path and grid must be given"


@pytest.mark.parametrize(
    ("service", "name", "values", "must"),
    [
        (
            "wait_until_ready",
            "timeout",
            (-1.0, math.nan, math.inf),
            "be finite and not negative [s]",
        ),
        ("set_rate", "update_rate", (-1.0, math.nan, -math.inf), "not be negative"),
        ("reset_world", "seed", (-2, -(2**63)), "be at least 0, or -1 for the current one"),
        ("set_appearance", "visible", (3,), "be 0 (KEEP), 1 (SHOW) or -1 (HIDE)"),
    ],
)
def test_invalid_values_are_refused(
    node: Any, service: str, name: str, values: Any, must: str
) -> None:
    others = {"topics": [], "keep_time": False, "model": "a", "body": "", "color": [], "layers": []}
    for value in values:
        answer = node.call(service, **others, **{name: value})
        assert (answer.success, answer.message) == (False, f"{name} must {must}, got {value}")


def test_the_rate_of_a_node_in_lockstep_cannot_be_set(node: Any) -> None:
    assert "in lockstep" in node.call("set_rate", update_rate=5.0).message
