"""Topics, services and parameters of one plugin, without ROS."""

from __future__ import annotations

import logging
import threading
from typing import Any

import pytest

from flatland.errors import PluginError
from flatland.node.plugin_ros import PluginRos
from flatland.node.transport import CallError

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""
WORLD = """
properties: {}
layers: [{name: 2d}]
models: [{name: r, namespace: ns, model: robot.model.yaml}]
"""
OWNER = 'Model Plugin "drive" type "DiffDrive" model "r"'


class Message:
    """A message class."""


@pytest.fixture
def node(serve: Any, files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return serve(WORLD, lockstep=True)


@pytest.fixture
def ros(node: Any) -> PluginRos:
    """The access to ROS of a plugin of a model in the namespace `ns`."""
    (plugin,) = node.world.model("r").plugins
    return node.run(lambda: plugin.ros)  # type: ignore[no-any-return]


def errors(caplog: pytest.LogCaptureFixture) -> list[logging.LogRecord]:
    return [record for record in caplog.records if record.levelno == logging.ERROR]


def test_names_are_those_of_the_namespace_of_the_model(ros: Any) -> None:
    opened = [
        ros.advertise("a", Message),
        ros.advertise("/b", Message, queue_size=7, latch=True),
        ros.subscribe("c", Message, print),
        ros.advertise_service("d", "SpawnModel", print),
        ros.advertise_service("/e", Message, print),
    ]
    assert [each.topic for each in opened] == ["ns/a", "/b", "ns/c", "ns/d", "/e"]
    assert opened[3].options.pop("type").__name__ == "SpawnModel"
    assert [each.options for each in opened] == [
        {"type": Message, "queue_size": 1, "latch": False, "owner": OWNER},
        {"type": Message, "queue_size": 7, "latch": True, "owner": OWNER},
        {"type": Message, "owner": OWNER},
        {"owner": OWNER},
        {"type": Message, "owner": OWNER},
    ]
    for method in (ros.advertise, ros.subscribe, ros.advertise_service):
        arguments = ("no name", Message, print)[: 2 if method == ros.advertise else 3]
        with pytest.raises(PluginError, match='"no name" is not a legal topic name'):
            method(*arguments)


@pytest.mark.parametrize("kind", ["advertise", "subscribe", "advertise_service"])
def test_each_kind_of_connection_counts_and_is_closed(node: Any, ros: Any, kind: str) -> None:
    arguments = () if kind == "advertise" else (print,)
    assert not ros.used
    connection = getattr(ros, kind)("a", Message, *arguments)
    assert ros.used
    assert node.call("delete_model", name="r").success
    assert connection.closed


def test_messages_arrive_between_two_steps_until_the_end(
    node: Any, ros: Any, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[tuple[str, threading.Thread]] = []
    ros.subscribe(
        "a", Message, lambda message: received.append((message, threading.current_thread()))
    )
    receive = node.transport.callbacks["ns/a"]
    receive("first")
    loop = node.run(threading.current_thread)
    assert received == [("first", loop)]
    # A message that arrives before the end, and is due after it.
    node.run(lambda: (receive("late"), ros.close()))
    node.run(lambda: None)
    assert received == [("first", loop)]
    assert errors(caplog) == []


def test_a_callback_that_raises_is_logged_with_its_plugin(
    node: Any, ros: Any, caplog: pytest.LogCaptureFixture
) -> None:

    def fail(_message: Any) -> None:
        assert node.world.requests.in_use  # It counts as code of a plugin.
        raise RuntimeError("cause")

    ros.subscribe("a", Message, fail)
    node.transport.callbacks["ns/a"]("message")
    node.run(lambda: None)
    [record] = errors(caplog)
    assert record.getMessage() == f"{OWNER}: callback of topic a raised"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "cause"


def test_a_service_is_handled_between_two_steps(node: Any, ros: Any) -> None:
    handled: list[tuple[threading.Thread, bool]] = []

    def handle(request: str) -> str:
        handled.append((threading.current_thread(), node.world.requests.in_use))
        return f"response to {request}"

    ros.advertise_service("a", Message, handle)
    call = node.transport.services["ns/a"]
    assert call("request") == "response to request"
    assert handled == [(node.run(threading.current_thread), True)]
    assert node.call("delete_model", name="r").success
    with pytest.raises(CallError, match=r"^service a: its model was deleted$"):
        call("request")


@pytest.mark.parametrize(
    ("raised", "reported", "text"),
    [
        (SystemExit(3), CallError, r"^service a raised SystemExit\(3\)$"),
        (ValueError("cause"), ValueError, "^cause$"),
    ],
)
def test_an_error_of_a_service_is_that_of_the_call(
    node: Any, ros: Any, raised: BaseException, reported: type[Exception], text: str
) -> None:
    def fail(_request: Any) -> None:
        raise raised

    ros.advertise_service("a", Message, fail)
    with pytest.raises(reported, match=text):
        node.transport.services["ns/a"]("request")


def test_parameters_are_those_of_the_namespace_of_the_model(node: Any, ros: Any) -> None:
    node.transport.parameters.update({"/ns/a": 0, "/b": "global"})
    assert ros.param("a") == 0
    assert ros.param("a", 5) == 0
    assert ros.param("/b") == "global"
    assert ros.param("c", None) is None
    assert ros.param("c", 5) == 5
    with pytest.raises(PluginError, match='ROS parameter "/ns/c" is not set'):
        ros.param("c")
    assert not ros.used


def test_the_last_connection_is_closed_first_and_each_once(
    node: Any, ros: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    closed: list[str] = []

    def close(connection: Any) -> None:
        closed.append(connection.topic)
        if connection.topic == "ns/b":
            raise RuntimeError("cause")

    monkeypatch.setattr(type(node.transport.topics["/tf"]), "close", close)
    for name in ("a", "b", "c"):
        ros.advertise(name, Message)
    for _ in range(2):
        ros.close()
    assert closed == ["ns/c", "ns/b", "ns/a"]
    [record] = errors(caplog)
    assert record.getMessage() == f"{OWNER}: cannot close a connection"


def test_connections_are_left_to_a_node_that_ends(node: Any, ros: Any) -> None:
    publisher = ros.advertise("a", Message)
    node.close()
    ros.close()
    assert not publisher.closed
