"""Warnings about the network, with a real master and a real server of a node."""

from __future__ import annotations

import os
from collections.abc import Iterator
from threading import Thread
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from free_ports import free_port

pytest.importorskip("rospy", reason="ROS is not installed")

import rosgraph
import rospy

from flatland.ros.transport import network_check
from flatland.ros.transport.network_check import NetworkCheck


class NodeServer:
    """The server of a node.

    Attributes:
        uri: Its address.
        pid: The process that it names.
    """

    def __init__(self) -> None:
        self.pid = os.getpid()
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._server.register_function(lambda _caller: [1, "", self.pid], "getPid")
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}/"
        Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def stop(self) -> None:
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def own(master: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeServer]:
    """The node of this process."""
    server = NodeServer()
    monkeypatch.setattr(rospy, "get_name", lambda: "/sim")
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name)
    monkeypatch.setattr(rospy.core, "get_node_uri", lambda: server.uri)
    monkeypatch.setattr(network_check, "_PERIOD", 0.0)
    monkeypatch.setattr(network_check, "_MAX_SHARE", 1e9)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    publish("/sim")
    yield server
    server.stop()


def publish(node: str) -> None:
    """Registers a publisher of the time."""
    rosgraph.Master(node).registerPublisher("/clock", "rosgraph_msgs/Clock", "http://127.0.0.1:1")


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.name == "flatland"]


def test_other_publishers_of_the_time_are_named_once(
    own: NodeServer, caplog: pytest.LogCaptureFixture
) -> None:
    check = NetworkCheck(publishes_clock=True)
    for _ in range(2):
        check()
    assert warnings(caplog) == []
    publish("/player")
    publish("/other/sim")
    for _ in range(2):
        check()
    publish("/late")
    check()
    names = ["/other/sim, /player", "/late"]
    assert [text.split(": ")[0] for text in warnings(caplog)] == [
        f"/clock is also published by {name}" for name in names
    ]


def test_a_node_without_a_clock_does_not_look_for_others(
    own: NodeServer, caplog: pytest.LogCaptureFixture
) -> None:
    publish("/player")
    NetworkCheck(publishes_clock=False)()
    assert warnings(caplog) == []


def test_the_state_of_a_large_system_is_requested_rarely(
    own: NodeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(network_check.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(network_check, "_PERIOD", 2.0)
    monkeypatch.setattr(network_check, "_MAX_SHARE", 0.02)
    calls: list[float] = []

    def publishers(topic: str) -> set[str]:
        assert topic == "/clock"
        calls.append(now[0])
        now[0] += 0.1
        return {"/sim"}

    monkeypatch.setattr(network_check, "_publishers_of", publishers)
    check = NetworkCheck(publishes_clock=True)
    for _ in range(11):
        check()
        now[0] += 1.0
    assert calls == pytest.approx([100.0, 105.1, 110.2])


def test_an_address_that_does_not_lead_to_the_node_is_reported_once(
    own: NodeServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    own.pid = 1
    check = NetworkCheck(publishes_clock=True)
    check()
    check()
    own.uri = f"http://127.0.0.1:{free_port()}/"
    monkeypatch.delenv("ROS_IP")
    NetworkCheck(publishes_clock=True)()
    first, second = warnings(caplog)
    assert "from ROS_IP: it is that of another program; set ROS_IP to" in first
    assert "with the name of this machine: [Errno 111] Connection refused; add the name" in second
