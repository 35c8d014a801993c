"""The parts of a node: their arguments, their order, and the order in which they are closed."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from flatland.errors import FlatlandError
from flatland.node import browser_viewer, initial_pose, served_world
from flatland.node.parameters import read_parameters
from flatland.node.served_world import ServedWorld

PARAMETERS = {
    "world_path": "w.yaml",
    "seed": 3,
    "simplify_map": 1,
    "step_size": 0.02,
    "plugin_timeout": 4.0,
    "update_rate": 33.0,
    "max_lag": 0.5,
    "lockstep": False,
    "show_viz": True,
    "viz_pub_rate": 7.0,
    "move_keeps_odometry": True,
    "if_blocked": "allow",
    "model_states_rate": 5.0,
    "record": "/run.jsonl",
    "record_mcap": "/run.mcap",
    "web": True,
    "initialpose_model": "r",
}


class Part:
    """A part of the node that records its use."""

    def __init__(self, name: str, calls: list[Any]) -> None:
        self._name, self._calls = name, calls
        self.subscribed = f"{name}.subscribed"
        self.opened = f"{name}.opened"

    def __repr__(self) -> str:
        return self._name

    def open(self) -> None:
        self._calls.append(f"{self._name} opened")

    def close(self) -> None:
        self._calls.append(f"{self._name} closed")


class World(Part):
    path, layers, models, map_layer = "w.yaml", [SimpleNamespace(names=["2d"])], [1, 2], ""

    def record(self, path: str) -> None:
        self._calls.append(f"recorded to {path}")


class Setup:
    """What the node creates, in `calls`; `start` creates it.

    Attributes:
        created: Arguments of each part by name, in the order of creation.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: list[Any] = []
        self.created: dict[str, Any] = {}
        self.world = World("world", self.calls)
        self.record_error: OSError | None = None
        self.report: Any = None
        self.clock: Any = Part("clock", self.calls)
        self.transport: Any = SimpleNamespace(parameter="get_param", record=self._record)
        for name in (
            *("Bridge", "FrameMonitor", "DeferredTopics", "Operations", "receive_layers"),
            *("ModelStatesTopic", "Services", "HookWatchdog", "PublishedLayer"),
        ):
            monkeypatch.setattr(served_world, name, self._kind(name))
        monkeypatch.setattr(served_world, "Simulation", self._kind("Simulation"))
        monkeypatch.setattr(browser_viewer, "BrowserViewer", self._kind("BrowserViewer"))
        monkeypatch.setattr(initial_pose, "InitialPose", self._kind("InitialPose"))
        monkeypatch.setattr(served_world, "World", SimpleNamespace(from_yaml=self._load))

    def _kind(self, name: str) -> Callable[..., Part]:
        def create(*arguments: Any, **options: Any) -> Part:
            self.report = options.pop("report", None) or self.report
            self.created[name] = (*map(_named, arguments), options)
            return Part(name, self.calls)

        return create

    def _load(self, *arguments: Any, **options: Any) -> World:
        self.created["World"] = (*arguments, {**options, "observers": str(options["observers"])})
        return self.world

    def _record(self, path: str, world: World) -> Part:
        assert world is self.world
        if self.record_error is not None:
            raise self.record_error
        return Part(f"recording {path}", self.calls)

    def start(self, **changes: Any) -> ServedWorld:
        parameters = read_parameters({**PARAMETERS, **changes}.get)
        self.parameters = parameters
        return ServedWorld(parameters, self.transport, self.clock)


def _named(value: Any) -> Any:
    return repr(value) if isinstance(value, Part) else value


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> Setup:
    return Setup(monkeypatch)


def test_the_parts_are_created_from_the_parameters(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "flatland")
    served = setup.start()
    transport = setup.transport
    assert list(setup.created.items()) == [
        ("Bridge", (transport, "clock", {})),
        (
            "World",
            (
                "w.yaml",
                {
                    "seed": 3,
                    "params": "get_param",
                    "simplify_map": setup.parameters.simplify_map,
                    "step_size": 0.02,
                    "observers": "[Bridge]",
                    "plugin_timeout": 4.0,
                    "plugin_errors": "disable",
                    "on_invalid_body": "remove",
                    "model_path": setup.parameters.model_path,
                },
            ),
        ),
        ("Simulation", ("world", 33.0, {"max_lag": 0.5, "lockstep": False})),
        ("FrameMonitor", (transport, "Simulation", "Bridge.subscribed", {})),
        (
            "DeferredTopics",
            (transport, "Simulation", {"debug_rate": 7.0, "move_keeps_odometry": True}),
        ),
        (
            "Operations",
            (transport, "Simulation", "clock", "allow", {"move_keeps_odometry": True}),
        ),
        ("receive_layers", (transport, "Simulation", {})),
        ("ModelStatesTopic", (transport, "Simulation", 5.0, {})),
        (
            "Services",
            (transport, "Simulation", "clock", "Operations", "DeferredTopics.opened", {}),
        ),
        ("BrowserViewer", (transport, "Simulation", "Operations", setup.parameters, {})),
        ("InitialPose", (transport, "Simulation", "r", "allow", {})),
        ("HookWatchdog", ("world", {})),
    ]
    assert setup.calls == ["recorded to /run.jsonl", "Services opened"]
    texts = [record.getMessage() for record in caplog.records]
    assert texts[0].startswith('loaded "w.yaml" in ')
    assert texts[0].endswith(" s: 1 layers, 2 models")
    assert texts[1:] == [
        'recording the run to "/run.jsonl"',
        'recording messages to "/run.mcap"',
    ]
    caplog.clear()
    caplog.set_level("DEBUG", "flatland")
    setup.report("cycle 5")
    assert [(each.levelname, each.getMessage()) for each in caplog.records] == [
        ("DEBUG", "cycle 5")
    ]
    setup.calls.clear()
    for _ in range(2):
        served.close()
    # Plugins are closed while their topics are open; the recording has their last messages.
    assert setup.calls == [
        *("HookWatchdog closed", "BrowserViewer closed", "DeferredTopics closed"),
        *("FrameMonitor closed", "Bridge closed", "world closed"),
        *("recording /run.mcap closed", "clock closed"),
    ]


def test_parts_are_optional(setup: Setup) -> None:
    served = setup.start(record="", record_mcap="", web=False, initialpose_model="", show_viz=False)
    assert {"BrowserViewer", "InitialPose", "PublishedLayer"}.isdisjoint(setup.created)
    assert setup.created["DeferredTopics"][-1]["debug_rate"] is None
    assert setup.calls == ["Services opened"]
    served.close()
    assert "BrowserViewer closed" not in setup.calls


@pytest.mark.parametrize(
    ("parameter", "of_world", "published"),
    [("", "2d", "2d"), ("2d", "", "2d"), (False, "2d", None), ("", "", None)],
)
def test_the_map_is_that_of_the_parameter_or_of_the_world(
    setup: Setup, parameter: Any, of_world: str, published: str | None
) -> None:
    setup.world.map_layer = of_world
    setup.start(publish_map=parameter, map_frame="site", map_resolution=0.25)
    expected = (setup.transport, "world", published, "site", 0.25, {})
    assert setup.created.get("PublishedLayer") == (expected if published else None)


def test_a_recording_that_cannot_be_created_closes_what_was_started(setup: Setup) -> None:
    setup.record_error = FileNotFoundError(2, "No such file or directory")
    with pytest.raises(FlatlandError, match=r'cannot create "/run\.mcap": No such file'):
        setup.start()
    assert setup.calls == ["recorded to /run.jsonl", "world closed", "clock closed"]


@pytest.mark.parametrize("stopped", [False, True])
@pytest.mark.parametrize("duration", [None, 2.0])
def test_a_run_is_endless_or_a_benchmark(
    setup: Setup, caplog: pytest.LogCaptureFixture, duration: float | None, stopped: bool
) -> None:
    served = setup.start(**({} if duration is None else {"benchmark_duration": duration}))
    caplog.set_level("INFO", "flatland")
    caplog.clear()
    runs: list[Any] = []

    def run(*arguments: Any) -> Any:
        runs.append(arguments)
        return SimpleNamespace(steps=7, wall_time=0.5, steps_per_second=14.0)

    simulation: Any = SimpleNamespace(run=run, stopped=stopped)
    served.simulation = simulation
    served.run()
    assert runs == ([()] if duration is None else [(2.0,)])
    text = "benchmark: 7 iterations in 0.500 s of wall time, 14.0 iterations a second"
    logged = [record.getMessage() for record in caplog.records]
    assert logged == ([text] if duration is not None and not stopped else [])
