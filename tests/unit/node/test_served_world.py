"""A node without ROS: its topics, its services, and the end of a node that cannot start."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.errors import FlatlandError
from flatland.node.clock import SimulatedClock
from flatland.node.parameters import ParameterError, read_parameters
from flatland.node.served_world import ServedWorld
from flatland.node.services import SERVICES

WORLD = "{properties: {}, layers: [{name: 2d}]}"


def test_a_running_world_has_its_topics_and_services(serve: Any, transport: Any) -> None:
    transport.parameters = {}
    node = serve()
    assert set(transport.services) == {service.name for service in SERVICES}
    assert {"/clock", "/tf", "model_states"} <= set(transport.topics)
    assert node.run(lambda: node.world.closed) is False


@pytest.mark.parametrize("show_viz", [False, True])
def test_debug_markers_are_opened_with_show_viz(
    serve: Any, transport: Any, monkeypatch: pytest.MonkeyPatch, show_viz: bool
) -> None:
    opened: list[float] = []

    def open_markers(_simulation: object, rate: float, _thread: object) -> Any:
        opened.append(rate)
        return SimpleNamespace(close=lambda: None)

    monkeypatch.setattr(transport, "load_debug_markers", lambda: open_markers)
    node = serve(show_viz=show_viz, viz_pub_rate=7)
    assert node.call("wait_until_ready", topics=[], timeout=TIMEOUT).success
    assert opened == ([7.0] if show_viz else [])


@pytest.mark.parametrize(
    ("world", "parameters", "error"),
    [
        ("{properties: {}, layers: 7}", {}, FlatlandError),
        (WORLD, {"publish_map": "none"}, ParameterError),
        (WORLD, {"record_mcap": "/no/folder/a.mcap"}, FlatlandError),
    ],
    ids=["world", "map", "recording"],
)
def test_a_node_that_cannot_start_leaves_no_thread_and_no_world(
    files: Any,
    transport: Any,
    monkeypatch: pytest.MonkeyPatch,
    world: str,
    parameters: dict[str, Any],
    error: type[Exception],
) -> None:
    closed: list[flatland.World] = []
    opened: list[flatland.World] = []
    load, close = flatland.World.from_yaml, flatland.World.close
    monkeypatch.setattr(
        flatland.World,
        "from_yaml",
        lambda *args, **options: opened.append(load(*args, **options)) or opened[-1],
    )
    monkeypatch.setattr(flatland.World, "close", lambda self: closed.append(self) or close(self))

    def fail(path: str, _world: object) -> None:
        raise FileNotFoundError(2, "No such file or directory", path)

    monkeypatch.setattr(transport, "record", fail)
    before = set(threading.enumerate())
    given = {"world_path": files.write("world.yaml", world), **parameters}
    with pytest.raises(error):
        ServedWorld(read_parameters(given.get), transport, SimulatedClock(transport))
    for thread in set(threading.enumerate()) - before:
        thread.join(TIMEOUT)
        assert not thread.is_alive(), thread
    assert all(world in closed for world in opened)
    assert transport.topics["/clock"].closed


def test_a_recording_of_messages_is_closed_with_the_world(serve: Any, transport: Any) -> None:
    node = serve(record_mcap="/run.mcap")
    assert not transport.topics["/run.mcap"].closed
    node.close()
    assert transport.topics["/run.mcap"].closed


def test_the_end_stops_all_threads(serve: Callable[..., Any]) -> None:
    before = set(threading.enumerate())
    node = serve()
    for _ in range(2):  # The thread that opens further topics is started by a request.
        node.run(lambda: None)
    for thread in threading.enumerate():
        if thread.name == "flatland-deferred-topics":
            thread.join(TIMEOUT)
    node.served.simulation.stop()
    node.served.close()
    for thread in set(threading.enumerate()) - before:
        thread.join(TIMEOUT)
        assert not thread.is_alive(), thread


def test_a_map_is_simplified_on_request(serve: Any, files: Any) -> None:
    pixels = np.full((60, 60), 255, np.uint8)
    cv2.circle(pixels, (30, 30), 25, 0, thickness=-1)
    cv2.imwrite(str(files.folder / "disc.png"), pixels)
    files.write(
        "disc.yaml", "{image: disc.png, resolution: 0.1, origin: [0, 0, 0], occupied_thresh: 0.65}"
    )
    world = "{properties: {}, layers: [{name: disc, map: disc.yaml}]}"
    nodes = [serve(world, simplify_map=kind, lockstep=True) for kind in (0, 1)]
    exact, simplified = (
        node.run(lambda node=node: len(node.world.layers[0].edges)) for node in nodes
    )
    assert simplified < exact / 2


def test_a_running_world_is_reset(serve: Any) -> None:
    node = serve(update_rate=0)
    timekeeper = node.world.timekeeper
    for _ in range(5):
        wait_until("steps", lambda: timekeeper.sim_time > 0.3)
        assert node.call("reset_world", keep_time=False, seed=-1).success
        node.call("pause")
        assert node.call("reset_world", keep_time=False, seed=-1).success
        assert timekeeper.sim_time_ns == 0
        node.call("resume")


def test_a_lower_and_a_higher_rate_take_effect(serve: Any, transport: Any) -> None:
    node = serve()
    timekeeper = node.world.timekeeper
    assert node.call("set_rate", update_rate=0.001).success
    assert transport.parameters["~update_rate"] == 0.001
    assert node.call("set_rate", update_rate=math.inf).success
    # One step at the old rate would take a quarter of an hour.
    start = timekeeper.sim_time
    wait_until("steps", lambda: timekeeper.sim_time > start + 5.0)
    assert transport.parameters["~update_rate"] == 0.0


def test_parameters_of_the_world(serve: Any, tmp_path: Path) -> None:
    record = tmp_path / "run.jsonl"
    node = serve(step_size=0.02, update_rate=33.0, seed=7, record=str(record))
    assert node.world.seed == 7
    assert record.exists()
    assert node.world.timekeeper.step_size == 0.02
    assert node.served.simulation.rate == pytest.approx(33.0)


def test_a_benchmark_logs_its_speed(serve: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    serve(benchmark_duration=0.05)
    wait_until("the end", lambda: "benchmark: " in caplog.text)
    found = re.search(r"benchmark: 10 iterations in ([\d.]+) s of wall time, ([\d.]+)", caplog.text)
    assert found is not None
    assert 10 / float(found[2]) == pytest.approx(float(found[1]), abs=0.002)
