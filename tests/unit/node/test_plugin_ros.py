"""Topics, services and parameters of one plugin, with a transport that records its calls."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

import pytest

from flatland.errors import PluginError
from flatland.node.plugin_ros import PluginRos
from flatland.node.transport import CallError
from flatland.plugin_api.plugin import describe

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""


class Message:
    """A message class."""


class RecordingTransport:
    """Records what is opened, in `opened`, and what is closed, in `closed`.

    Attributes:
        callback: Callback of the last subscription or service.
    """

    def __init__(self) -> None:
        self.opened: list[tuple[Any, ...]] = []
        self.closed: list[str] = []
        self.parameters: dict[str, Any] = {}
        self.fails_to_close = ""
        self.callback: Callable[[Any], Any] = lambda _: None

    def _open(self, kind: str, name: str, *arguments: Any, **options: Any) -> Any:
        self.opened.append((kind, name, *arguments, options))

        def close() -> None:
            self.closed.append(name)
            if name == self.fails_to_close:
                raise RuntimeError("cause")

        return SimpleNamespace(name=name, close=close)

    def advertise(self, name: str, message_type: Any, **options: Any) -> Any:
        return self._open("publisher", name, message_type, **options)

    def subscribe(self, name: str, message_type: Any, callback: Any, **options: Any) -> Any:
        self.callback = callback
        return self._open("subscriber", name, message_type, **options)

    def serve(self, name: str, service_type: Any, handler: Any, **options: Any) -> Any:
        self.callback = handler
        return self._open("service", name, service_type, **options)

    def service_class(self, name: str) -> str:
        return f"class of {name}"

    def wait_for(self, future: Future[Any], requests: Any) -> Any:
        return requests, future.result(0)

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"/node/{name}"

    def parameter(self, name: str) -> Any:
        return self.parameters.get(name)


class Setup:
    """The access to ROS of a plugin of a model in the namespace `ns`."""

    def __init__(self, files: Any) -> None:
        files.write("robot.model.yaml", ROBOT)
        self.world = files.load(
            "{properties: {}, layers: [{name: 2d}],"
            " models: [{name: r, namespace: ns, model: robot.model.yaml}]}"
        )
        (self.plugin,) = self.world.model("r").plugins
        self.owner = describe(self.plugin)
        self.transport = RecordingTransport()
        self.posted: list[tuple[Future[Any], Callable[[], Any]]] = []
        self.shutting_down = False
        self.ros = PluginRos(
            self.plugin,
            self.transport,  # type: ignore[arg-type]
            self.world.requests,
            self._post,
            lambda: self.shutting_down,
        )

    def _post(self, action: Callable[[], object]) -> Future[Any]:
        future: Future[Any] = Future()
        self.posted.append((future, action))
        return future

    def run(self) -> None:
        """Runs the posted actions, as between two steps."""
        while self.posted:
            future, action = self.posted.pop(0)
            try:
                future.set_result(action())
            except Exception as error:
                future.set_exception(error)

    def raise_in_plugin(self, error: BaseException) -> Callable[[Any], Any]:
        """Returns a callback that checks that it counts as code of a plugin, and raises."""

        def fail(_message: Any) -> Any:
            assert self.world.requests.in_use
            raise error

        return fail


@pytest.fixture
def setup(files: Any) -> Setup:
    return Setup(files)


def test_names_are_those_of_the_namespace_of_the_model(setup: Setup) -> None:
    ros, owner = setup.ros, setup.owner
    assert not ros.used
    publisher = ros.advertise("a", Message)
    assert ros.used
    assert publisher.name == "ns/a"
    assert ros.advertise("/b", Message, queue_size=7, latch=True).name == "/b"
    assert ros.subscribe("c", Message, print).name == "ns/c"
    assert ros.advertise_service("d", "SpawnModel", print).name == "ns/d"
    assert ros.advertise_service("/e", Message, print).name == "/e"
    assert setup.transport.opened == [
        ("publisher", "ns/a", Message, {"queue_size": 1, "latch": False, "owner": owner}),
        ("publisher", "/b", Message, {"queue_size": 7, "latch": True, "owner": owner}),
        ("subscriber", "ns/c", Message, {"owner": owner}),
        ("service", "ns/d", "class of SpawnModel", {"owner": owner}),
        ("service", "/e", Message, {"owner": owner}),
    ]
    for method in (ros.advertise, ros.subscribe, ros.advertise_service):
        arguments = ("no name", Message, print)[: 2 if method == ros.advertise else 3]
        with pytest.raises(PluginError, match='"no name" is not a legal topic name'):
            method(*arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", ["advertise", "subscribe", "advertise_service"])
def test_each_kind_of_connection_counts_and_is_closed(setup: Setup, kind: str) -> None:
    arguments = () if kind == "advertise" else (print,)
    getattr(setup.ros, kind)("a", Message, *arguments)
    assert setup.ros.used
    setup.ros.close()
    assert setup.transport.closed == ["ns/a"]


def test_messages_arrive_between_two_steps_until_the_end(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[str] = []
    setup.ros.subscribe("a", Message, received.append)
    setup.transport.callback("first")
    assert received == []
    setup.run()
    assert received == ["first"]
    setup.transport.callback("late")
    setup.ros.close()
    setup.run()
    assert received == ["first"]
    assert caplog.records == []


def test_a_callback_that_raises_is_logged_with_its_plugin(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    setup.ros.subscribe("a", Message, setup.raise_in_plugin(RuntimeError("cause")))
    setup.transport.callback("message")
    setup.run()
    [record] = caplog.records
    assert record.levelno == logging.ERROR
    assert record.getMessage() == f"{setup.owner}: callback of topic a raised"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"


def test_a_service_is_handled_between_two_steps(
    setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[bool] = []  # by the last call

    def handle(request: str) -> str:
        used.append(setup.world.requests.in_use)
        return f"response to {request}"

    def wait_for(future: Future[Any], requests: Any) -> Any:
        assert requests is setup.world.requests
        used.clear()
        setup.run()
        return future.result(0)

    monkeypatch.setattr(setup.transport, "wait_for", wait_for)
    setup.ros.advertise_service("a", Message, handle)
    assert setup.transport.callback("request") == "response to request"
    assert used == [True]
    setup.transport.callback("another one")
    setup.ros.close()
    with pytest.raises(CallError, match=r"^service a: its model was deleted$"):
        setup.transport.callback("request")


@pytest.mark.parametrize(
    ("raised", "reported", "text"),
    [
        (SystemExit(3), CallError, r"^service a raised SystemExit\(3\)$"),
        (ValueError("cause"), ValueError, "^cause$"),
    ],
)
def test_an_error_of_a_service_is_that_of_the_call(
    setup: Setup,
    monkeypatch: pytest.MonkeyPatch,
    raised: BaseException,
    reported: type[Exception],
    text: str,
) -> None:
    def wait_for(future: Future[Any], _requests: Any) -> Any:
        setup.run()
        return future.result(0)

    monkeypatch.setattr(setup.transport, "wait_for", wait_for)
    setup.ros.advertise_service("a", Message, setup.raise_in_plugin(raised))
    with pytest.raises(reported, match=text):
        setup.transport.callback("request")


def test_parameters_are_those_of_the_namespace_of_the_model(setup: Setup) -> None:
    setup.transport.parameters = {"/node/ns/a": 0, "/b": "global"}
    assert setup.ros.param("a") == 0
    assert setup.ros.param("a", 5) == 0
    assert setup.ros.param("/b") == "global"
    assert setup.ros.param("c", None) is None
    assert setup.ros.param("c", 5) == 5
    with pytest.raises(PluginError, match='ROS parameter "/node/ns/c" is not set'):
        setup.ros.param("c")
    assert not setup.ros.used


def test_the_last_connection_is_closed_first_and_each_once(
    setup: Setup, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("a", "b", "c"):
        setup.ros.advertise(name, Message)
    setup.transport.fails_to_close = "ns/b"
    for _ in range(2):
        setup.ros.close()
    assert setup.transport.closed == ["ns/c", "ns/b", "ns/a"]
    [record] = caplog.records
    assert record.getMessage() == f"{setup.owner}: cannot close a connection"
    assert record.levelno == logging.ERROR


def test_connections_are_left_to_a_node_that_ends(setup: Setup) -> None:
    setup.ros.advertise("a", Message)
    setup.shutting_down = True
    setup.ros.close()
    setup.shutting_down = False
    setup.ros.close()
    assert setup.transport.closed == []
