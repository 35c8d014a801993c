"""The services of the node, without ROS."""

from __future__ import annotations

import math
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from waiting import TIMEOUT, wait_until

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


def test_a_second_toggle_during_a_drag_keeps_the_world_paused(node: Any) -> None:
    holds = node.served.simulation.holds
    node.run(lambda: holds.hold("drag"))
    node.call("toggle_pause")
    assert not node.world.paused
    node.call("toggle_pause")
    node.run(lambda: holds.release("drag"))
    assert node.world.paused


def test_one_toggle_during_a_drag_resumes_the_world(node: Any) -> None:
    holds = node.served.simulation.holds
    node.run(lambda: holds.hold("drag"))
    node.call("toggle_pause")
    node.run(lambda: holds.release("drag"))
    assert not node.world.paused


def test_wait_until_ready_returns_after_the_connection_of_a_topic(node: Any) -> None:
    def answer(timeout: float, *topics: str) -> tuple[bool, str]:
        answer = node.call("wait_until_ready", topics=topics, timeout=timeout)
        return answer.success, getattr(answer, "message", "")

    assert answer(TIMEOUT) == (True, "")
    missing = (False, "not ready after 0 s: no connection to /tf, model_states")
    assert answer(0, "/tf", "model_states") == missing
    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(answer, TIMEOUT, "/tf")
        node.transport.topics["/tf"].connect()
        assert waiting.result(TIMEOUT) == (True, "")


@pytest.mark.parametrize("timeout", [-1.0, math.nan, math.inf])
def test_wait_until_ready_with_an_invalid_time_limit(node: Any, timeout: float) -> None:
    answer = node.call("wait_until_ready", topics=[], timeout=timeout)
    assert answer.success is False
    assert answer.message == f"timeout must be finite and not negative [s], got {timeout}"


def test_models_are_spawned_moved_and_deleted(node: Any) -> None:
    assert spawn(node, "a", 1.0).success
    assert node.call("move_model", name="a", pose=pose(2.0)).success
    answer = node.call("get_model_states", names=[])
    assert (answer.success, answer.states.names, answer.states.namespaces) == (True, ("a",), ["r"])
    assert answer.states.poses.tolist() == [[2.0, 0.0, 0.0]]
    assert node.call("delete_model", name="a").success
    again = node.call("delete_model", name="a")
    assert again.success is False
    assert again.message.endswith('model with name "a" does not exist')


@pytest.mark.parametrize(("rate", "count"), [(50, 5), (0, 20)])
def test_states_are_published_at_a_rate_of_simulated_time(
    serve: Any, rate: float, count: int
) -> None:
    node = serve(lockstep=True, model_states_rate=rate)
    topic = node.transport.topics["model_states"]
    topic.connect()
    node.run(topic.sent.clear)
    node.call("step_world", duration=0.1)
    assert len(topic.sent) == count


def test_failed_batches_name_the_item(node: Any) -> None:
    spec = SimpleNamespace(yaml_path="robot.model.yaml", name="a", ns="", pose=pose())
    missing = SimpleNamespace(yaml_path="none.model.yaml", name="b", ns="", pose=pose())
    failed = node.call("spawn_models", models=[spec, missing])
    assert (failed.success, failed.index) == (False, 1)
    assert node.world.models == []
    done = node.call("spawn_models", models=[spec])
    assert (done.success, done.index, done.poses) == (True, -1, [(0.0, 0.0, 0.0)])
    assert node.call("move_models", models=[SimpleNamespace(name="c", pose=pose())]).index == 0
    assert node.call("delete_models", names=["a", "c"]).index == 1
    assert node.call("delete_models", names=["a"]).index == -1


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


def test_clients_are_served_one_after_the_other(node: Any) -> None:
    def client() -> list[int]:
        return [node.call("step_world", duration=0.01).stamp for _ in range(25)]

    with ThreadPoolExecutor(4) as pool:
        answers = [pool.submit(client) for _ in range(4)]
        times = [answer.result(TIMEOUT) for answer in answers]
    assert all(mine == sorted(mine) for mine in times)
    together = sorted(time for mine in times for time in mine)
    assert together == [n * 2 * STEP_NS for n in range(1, 101)]


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
    node.transport.lost.update({("/scan", "/slow"): 3, ("/clock", "/slow"): 9})
    answer = node.call("step_world", duration=0.0)
    assert answer.message == "3 messages of /scan to /slow were dropped"
    assert (answer.success, answer.stamp) == (True, 5_000_000)
    assert node.call("step_world", duration=0.0).message == ""


@pytest.mark.parametrize("rate", [-1.0, math.nan, -math.inf])
def test_an_invalid_rate_is_refused(node: Any, rate: float) -> None:
    answer = node.call("set_rate", update_rate=rate)
    assert answer.message == f"update_rate must not be negative, got {rate}"
    assert answer.success is False


@pytest.mark.parametrize("seed", [-2, -(2**63)])
def test_an_invalid_seed_is_refused(node: Any, seed: int) -> None:
    answer = node.call("reset_world", seed=seed, keep_time=False)
    assert answer.message == f"seed must be at least 0, or -1 for the current one, got {seed}"
    assert answer.success is False


class GridMessage(OccupancyGrid):
    """A grid with the field that the service reads of a message."""

    @property
    def data(self) -> Any:
        return self.cells.ravel()


def test_a_map_of_one_cell_is_received(node: Any) -> None:
    grid = GridMessage((1.0, 2.0, 0.0), 0.5, np.full((1, 1), 100, np.int8))
    assert node.call("set_layer_map", layer="2d", map_path="", grid=grid).success
    assert len(node.world.layers[0].edges) == 4


def test_invalid_requests(node: Any) -> None:
    assert "in lockstep" in node.call("set_rate", update_rate=5.0).message
    request = {"model": "a", "body": "", "color": [], "layers": [], "visible": 3}
    assert node.call("set_appearance", **request).message == (
        "visible must be 0 (KEEP), 1 (SHOW) or -1 (HIDE), got 3"
    )
    empty = SimpleNamespace(data=[])
    assert node.call("set_layer_map", layer="2d", map_path="", grid=empty).message == (
        "exactly one of map_path and grid must be given"
    )
