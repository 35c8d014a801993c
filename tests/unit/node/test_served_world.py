"""A node without ROS: its topics, its services, and the end of a node that cannot start."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.errors import FlatlandError, PluginError
from flatland.node import served_world
from flatland.node.clock import SimulatedClock
from flatland.node.parameters import ParameterError, read_parameters
from flatland.node.served_world import ServedWorld
from flatland.node.services import SERVICES
from flatland.simulation import Simulation

WORLD = "{properties: {}, layers: [{name: 2d}]}"


class Plugin(flatland.ModelPlugin):
    """A plugin whose only hooks are those that a test sets."""

    def on_initialize(self, config: Any) -> None:
        self.last = self.output("/last", float)
        self.start()

    def start(self) -> None:
        """Does what a test sets."""


@pytest.fixture
def world_of_plugin(files: Any, declare_plugins: Any) -> str:
    """The text of a world with a model with a plugin, and of a layer whose name is a parameter."""
    declare_plugins(Plugin)
    files.write(
        "robot.model.yaml",
        """
        bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
        plugins: [{type: "test::Plugin", name: plugin}]
        """,
    )
    return """
        properties: {}
        layers: [{name: '$eval param("/layer", "none")'}]
        models: [{name: r, model: robot.model.yaml}]
        """


def test_a_running_world_has_its_topics_and_services(serve: Any, transport: Any) -> None:
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
    ("world", "parameters", "error", "text"),
    [
        ("{properties: {}, layers: 7}", {}, FlatlandError, "layers"),
        (WORLD, {"publish_map": "none"}, ParameterError, "publish_map"),
        (
            WORLD,
            {"record_mcap": "/no/folder/a.mcap"},
            FlatlandError,
            '^cannot create "/no/folder/a.mcap": No such file or directory$',
        ),
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
    text: str,
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
    with pytest.raises(error, match=text):
        ServedWorld(read_parameters(given.get), transport, SimulatedClock(transport))
    for thread in set(threading.enumerate()) - before:
        thread.join(TIMEOUT)
        assert not thread.is_alive(), thread
    assert all(world in closed for world in opened)
    assert transport.topics["/clock"].closed


def test_plugins_end_before_their_topics_the_recording_and_the_clock(
    serve: Any, transport: Any, world_of_plugin: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_topics: list[set[str]] = []

    def end(plugin: Any) -> None:
        plugin.last.emit(1.0)
        open_topics.append({name for name, topic in transport.topics.items() if not topic.closed})

    monkeypatch.setattr(Plugin, "on_shutdown", end)
    node = serve(world_of_plugin, record_mcap="/run.mcap")
    topics = transport.topics
    topics["/last"].connect()
    for _ in range(2):
        node.close()
    assert open_topics == [set(topics)]
    assert topics["/last"].sent == [1.0]
    # The transport closes topics of the world all at once.
    assert {name for name in topics if topics[name].closed} == {"/run.mcap", "/clock"}


def test_the_end_stops_all_threads(serve: Callable[..., Any]) -> None:
    before = set(threading.enumerate())
    node = serve()
    for _ in range(2):  # The thread that opens further topics is started by a request.
        node.run(lambda: None)
    for thread in threading.enumerate():
        if thread.name == "flatland-deferred-topics":
            thread.join(TIMEOUT)
    node.close()
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


def test_parameters_of_the_world(
    serve: Any, transport: Any, tmp_path: Path, world_of_plugin: str, caplog: Any
) -> None:
    caplog.set_level("INFO", "flatland")
    record = tmp_path / "run.jsonl"
    transport.parameters["/layer"] = "2d"
    given = {"step_size": 0.02, "update_rate": 33.0, "max_lag": 0.5, "seed": 7}
    node = serve(
        world_of_plugin,
        record=str(record),
        record_mcap="/run.mcap",
        model_path=str(tmp_path),
        **given,
    )
    assert node.world.seed == 7
    assert [layer.name for layer in node.world.layers] == ["2d"]
    assert node.world.model_path == (str(tmp_path),)
    assert node.world.timekeeper.step_size == 0.02
    assert node.served.simulation.rate == pytest.approx(33.0)
    assert node.served.simulation._max_lag == 0.5
    # Other faults do not end a node.
    assert (node.world.plugin_errors, node.world.on_invalid_body) == ("disable", "remove")
    assert record.exists()
    path = re.escape(str(tmp_path / "world.yaml"))
    assert re.search(rf'loaded "{path}" in \d+\.\d\d s: 1 layers, 1 models', caplog.text)
    assert f'recording the run to "{record}"' in caplog.text
    assert 'recording messages to "/run.mcap"' in caplog.text


def test_the_start_of_a_plugin_is_limited(
    serve: Any, world_of_plugin: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = threading.Event()
    monkeypatch.setattr(Plugin, "start", lambda _plugin: end.wait(TIMEOUT))
    with pytest.raises(PluginError, match=r"on_initialize did not return within 0\.01 s"):
        serve(world_of_plugin, plugin_timeout=0.01)
    end.set()


def test_a_benchmark_logs_its_speed_at_its_end(serve: Any, caplog: Any) -> None:
    caplog.set_level("INFO")
    serve(benchmark_duration=1e4).close()
    assert "benchmark: " not in caplog.text
    serve(benchmark_duration=0.05)
    wait_until("the end", lambda: "benchmark: " in caplog.text)
    found = re.search(r"benchmark: 10 iterations in ([\d.]+) s of wall time, ([\d.]+)", caplog.text)
    assert found is not None
    assert 10 / float(found[2]) == pytest.approx(float(found[1]), abs=0.002)


def test_the_performance_of_the_loop_is_logged_for_developers(
    serve: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(served_world, "Simulation", partial(Simulation, report_period=0.01))
    caplog.set_level("DEBUG", "flatland")
    serve()
    wait_until("a report", lambda: [each for each in caplog.records if each.levelname == "DEBUG"])
