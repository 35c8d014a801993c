"""What services pass to the simulation, and what its results and failures become."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest

from flatland.errors import BatchError, WorldError
from flatland.loading.model_source import ModelSpec
from flatland.node import services
from flatland.node.services import SERVICES, Services
from flatland.node.transport import CallError

POSES = [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)]


class Recorder:
    """Records the calls of all methods, and returns or raises what the test sets.

    Attributes:
        calls: Name, arguments and keyword arguments of each call.
        result: Returned by each call; an error is raised.
    """

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.result: Any = None

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            self.calls.append((name, *arguments, options) if options else (name, *arguments))
            if isinstance(self.result, Exception):
                raise self.result
            return self.result

        return call


class Setup:
    """The services of a simulation that records what it is asked for.

    Attributes:
        flushed: Limits of the waits for registrations [s].
    """

    def __init__(self) -> None:
        self.operations, self.world = Recorder(), Recorder()
        self.world.requests = "requests"
        self.world.source = SimpleNamespace(
            read_models_ahead=lambda paths: ("models", paths),
            read_map_ahead=lambda path: ("map", path),
            inputs=SimpleNamespace(using=self._using),
        )
        self.stores: list[Any] = []
        self.flushed: list[float] = []
        self.served: dict[str, tuple[str, Any]] = {}
        self.opened = threading.Event()
        self.registers = True
        self.shutting_down = False
        simulation = SimpleNamespace(world=self.world, post=self._post)
        self.services = Services(
            self,  # type: ignore[arg-type]
            simulation,  # type: ignore[arg-type]
            SimpleNamespace(),  # type: ignore[arg-type]
            self.operations,  # type: ignore[arg-type]
            self.opened,
        )
        self.services.open()

    def _post(self, action: Callable[[], Any]) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(action())
        except Exception as error:
            future.set_exception(error)
        return future

    def _using(self, store: Any) -> Callable[[Callable[[], Any]], Callable[[], Any]]:
        self.stores.append(store)
        return lambda action: action

    # -- the transport

    def dropped(self) -> Callable[[], dict[Any, int]]:
        return lambda: {("/b", "/rviz"): 2, ("/a", "/rviz"): 1, ("/clock", "/rviz"): 5}

    def serve(self, name: str, service_type: str, handler: Any) -> None:
        self.served[name] = (service_type, handler)

    def wait_for(self, future: Future[Any], requests: Any) -> Any:
        assert requests == "requests"
        return future.result(0)

    def flush(self, timeout: float) -> bool:
        self.flushed.append(timeout)
        return self.registers

    def is_connected(self, topic: str) -> bool:
        return topic == "/tf"

    # -- calls

    def call(self, service: str, /, **fields: Any) -> dict[str, Any]:
        response: dict[str, Any] = self.served[service][1](SimpleNamespace(**fields))
        return response


@pytest.fixture
def setup() -> Setup:
    return Setup()


def pose(number: int) -> SimpleNamespace:
    x, y, theta = POSES[number]
    return SimpleNamespace(x=x, y=y, theta=theta)


def model(number: int) -> SimpleNamespace:
    return SimpleNamespace(
        yaml_path=f"{number}.yaml", name=f"m{number}", ns=f"n{number}", pose=pose(number)
    )


def test_all_services_are_offered_with_their_types(setup: Setup) -> None:
    assert {name: kind for name, (kind, _) in setup.served.items()} == {
        service.name: service.type for service in SERVICES
    }
    assert setup.served["spawn_models"][0] == "flatland/SpawnModels"
    assert setup.served["toggle_pause"][0] == "std_srvs/Empty"


def test_models_are_spawned_moved_and_deleted(setup: Setup) -> None:
    operations = setup.operations
    operations.result = "moved \udc80"
    text = {"success": True, "message": "moved ?"}
    assert setup.call("spawn_model", **vars(model(0))) == text
    assert setup.call("move_model", name="a", pose=pose(1)) == text
    assert setup.call("delete_model", name="a") == {"success": True}
    operations.result = ("moved \udc80", POSES)
    placed = {**text, "index": -1, "poses": POSES}
    assert setup.call("spawn_models", models=[model(0), model(1)]) == placed
    moves = [SimpleNamespace(name=f"m{number}", pose=pose(number)) for number in range(2)]
    assert setup.call("move_models", models=moves) == placed
    assert operations.calls == [
        ("spawn", "0.yaml", "m0", "n0", POSES[0]),
        ("move", "a", POSES[1]),
        ("delete", "a"),
        ("spawn_all", [ModelSpec(f"{n}.yaml", f"m{n}", f"n{n}", POSES[n]) for n in range(2)]),
        ("move_all", [("m0", POSES[0]), ("m1", POSES[1])]),
    ]
    assert setup.stores == [("models", ["0.yaml"]), ("models", ["0.yaml", "1.yaml"])]
    assert setup.call("delete_models", names=["a", "b"]) == {"success": True, "index": -1}
    assert setup.world.calls == [("delete_models", ["a", "b"])]
    assert set(setup.flushed) == {services.REGISTRATION_TIMEOUT}
    assert len(setup.flushed) == 6


def test_the_time_is_controlled(setup: Setup) -> None:
    assert setup.call("set_rate", update_rate=0.0) == {"success": True}
    assert setup.call("reset_world", seed=-1, keep_time=True) == {"success": True}
    assert setup.call("reset_world", seed=0, keep_time=False) == {"success": True}
    for name in ("pause", "resume", "toggle_pause"):
        assert setup.call(name) == {}
    assert setup.operations.calls == [
        ("set_rate", 0.0),
        ("reset", None, {"keep_time": True}),
        ("reset", 0, {"keep_time": False}),
        ("pause",),
        ("resume",),
        ("toggle_pause",),
    ]


@pytest.mark.parametrize(("number", "visible"), [(0, None), (1, True), (-1, False)])
def test_appearances_are_changed(setup: Setup, number: int, visible: bool | None) -> None:
    request = {"model": "m", "body": "b", "visible": number}
    assert setup.call("set_appearance", color=[1, 0, 0, 1], layers=["2d"], **request)["success"]
    assert setup.call("set_appearance", color=[], layers=[], **request)["success"]
    first = {"color": [1.0, 0.0, 0.0, 1.0], "layers": ["2d"], "visible": visible}
    second = {"color": None, "layers": None, "visible": visible}
    assert setup.world.calls == [
        ("set_appearance", "m", "b", first),
        ("set_appearance", "m", "b", second),
    ]


def test_the_map_of_a_layer_is_read_ahead(setup: Setup) -> None:
    empty = SimpleNamespace(data=[])
    assert setup.call("set_layer_map", layer="2d", map_path="m.yaml", grid=empty)["success"]
    assert setup.world.calls == [("set_layer_map", "2d", "m.yaml")]
    assert setup.stores == [("map", "m.yaml")]
    both = setup.call(
        "set_layer_map", layer="2d", map_path="m.yaml", grid=SimpleNamespace(data=[1])
    )
    assert both == {"success": False, "message": "exactly one of map_path and grid must be given"}


@pytest.mark.parametrize(
    ("error", "message", "index"),
    [
        (WorldError("no such model"), "no such model", -1),
        (BatchError("models[1]", 1, WorldError("no such model")), "no such model", 1),
        (KeyError("cause"), "KeyError: 'cause'", -1),
        (CallError("blocked"), "blocked", -1),
    ],
)
def test_a_failure_is_part_of_the_response(
    setup: Setup,
    caplog: pytest.LogCaptureFixture,
    error: Exception,
    message: str,
    index: int,
) -> None:
    setup.operations.result = error
    response = setup.call("spawn_models", models=[model(0)])
    assert response["success"] is False
    assert response["message"].endswith(message)
    assert response["index"] == index
    assert setup.call("delete_model", name="a")["success"] is False
    with pytest.raises(CallError):  # The response has no fields.
        setup.call("pause")
    assert len(setup.flushed) == 3
    expected = ["unexpected internal error in a service call"] * 3
    logged = [record.getMessage() for record in caplog.records]
    assert logged == (expected if isinstance(error, KeyError) else [])


def test_dropped_messages_are_described_in_order(setup: Setup) -> None:
    assert setup.services._describe_dropped() == (
        "1 messages of /a to /rviz were dropped, 2 messages of /b to /rviz were dropped"
    )


def test_a_node_is_ready_after_all_topics_are_open_registered_and_connected(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: 10.0 + sum(slept), sleep=slept.append)
    monkeypatch.setattr(services, "time", clock)

    def message(*topics: str, timeout: float = 0.0) -> Any:
        return setup.call("wait_until_ready", topics=topics, timeout=timeout).get("message")

    opened = "the topics that are opened after the first step are not open"
    assert message("/tf") == f"not ready after 0 s: {opened}"
    setup.opened.set()
    setup.registers = False
    registered = "the registration with the ROS master is not complete"
    assert message("/tf") == f"not ready after 0 s: {registered}"
    setup.registers = True
    assert message("/tf") is None
    assert message("/tf", "/a", "/b") == "not ready after 0 s: no connection to /a, /b"
    assert slept == []
    assert message("/a", timeout=0.5) == "not ready after 0.5 s: no connection to /a"
    assert set(slept) == {0.01}
    assert sum(slept) == pytest.approx(0.5, abs=0.011)
    setup.shutting_down = True
    assert message("/a", timeout=0.5) == "the simulator is shutting down"
    assert "timeout must be finite" in message(timeout=-0.1)
