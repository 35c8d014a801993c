"""Connections of ROS clients, accepted by servers whose events the tests handle one by one."""

from __future__ import annotations

import errno
import logging
import resource
import socket
import struct
from collections.abc import Callable, Iterator
from http.client import HTTPConnection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from waiting import TIMEOUT

pytest.importorskip("rospy", reason="ROS is not installed")

import rosgraph.xmlrpc
import rospy.impl.tcpros_base
import tcpros

from flatland.ros.transport import inbound
from flatland.ros.transport.inbound import TcprosServer, XmlRpcServer
from flatland.runtime.client_limits import EXHAUSTED_PERIOD

CLOCK = {"topic": "/clock", "callerid": "/reader"}
DELETE = {"service": "/delete_model", "callerid": "/caller"}
_MAX_ROUNDS = 100  # of a server, until a client has received what was sent


class Handlers:
    """The topics and services of a node, which refuse connections with a reason.

    Attributes:
        refusal: The reason, empty to accept a connection, or an error.
        accepted: Kind, header and connection of each call.
    """

    def __init__(self) -> None:
        self.refusal: str | Exception = ""
        self.accepted: list[tuple[str, dict[str, str], socket.socket]] = []

    def handle(self, *_: Any) -> None:
        raise NotImplementedError

    def topic_connection_handler(self, *arguments: Any) -> str:
        return self._accept("topic", *arguments)

    def service_connection_handler(self, *arguments: Any) -> str:
        return self._accept("service", *arguments)

    def _accept(self, kind: str, connection: Any, address: Any, header: dict[str, str]) -> str:
        assert address[0] == "127.0.0.1"
        if isinstance(self.refusal, Exception):
            raise self.refusal
        self.accepted.append((kind, header, connection))
        return self.refusal


class Port:
    """A server of TCPROS whose events the test handles."""

    def __init__(self, handlers: Handlers) -> None:
        self.server = TcprosServer(handlers.handle)
        self.server.is_shutdown = True
        self.server.run()  # creates the state only
        self.server.is_shutdown = False
        self._clients: list[socket.socket] = []

    def connect(self, data: bytes = b"") -> socket.socket:
        """Connects a client, which sends data, and accepts it."""
        client = socket.create_connection(("127.0.0.1", self.server.port), TIMEOUT)
        client.sendall(data)
        self._clients.append(client)
        before = list(self.server._pending)
        self.serve_until(lambda: list(self.server._pending) != before or _has_input(client))
        return client

    def serve(self) -> None:
        self.server._serve(self.server.server_sock.fileno())

    def serve_until(self, condition: Callable[[], Any]) -> None:
        for _ in range(_MAX_ROUNDS):
            if condition():
                return
            self.serve()
        assert condition()

    def response(self, client: socket.socket) -> bytes:
        """Returns what a client receives until its connection is closed."""
        self.serve_until(lambda: _has_input(client))
        data = b""
        while part := client.recv(4096):
            data += part
        return data

    def close(self) -> None:
        self.server.shutdown()
        for client in (*self._clients, *(each.socket for each in self.server._pending.values())):
            client.close()


def _failing(number: int) -> Any:
    """Returns a listening socket that accepts no connections."""

    def accept() -> Any:
        raise OSError(number, "cause")

    return SimpleNamespace(accept=accept)


def _has_input(client: socket.socket) -> bool:
    """Returns whether a client has received data or the end of its connection."""
    client.setblocking(False)
    try:
        client.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except ConnectionResetError:  # by a server that has not read everything
        return True
    finally:
        client.settimeout(TIMEOUT)
    return True


@pytest.fixture
def handlers(monkeypatch: pytest.MonkeyPatch) -> Iterator[Handlers]:
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: False)
    monkeypatch.setattr(inbound, "_POLL_PERIOD", 0.1)
    for limit in ("MAX_CLIENTS", "MAX_CONNECTIONS"):
        monkeypatch.setattr(inbound, limit, 2)
    handlers = Handlers()
    yield handlers
    for *_, connection in handlers.accepted:
        connection.close()


@pytest.fixture
def port(handlers: Handlers) -> Iterator[Port]:
    """A server with at most two incomplete headers and two connections."""
    port = Port(handlers)
    yield port
    port.close()


@pytest.fixture
def warnings_of(caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    caplog.set_level(logging.DEBUG, "flatland")

    def messages() -> list[str]:
        found = [record.getMessage() for record in caplog.records if record.name == "flatland"]
        caplog.clear()
        return found

    return messages


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times for which a server has slept [s]; its clock is that of the test."""
    slept: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: 100.0 + sum(slept), sleep=slept.append)
    monkeypatch.setattr(inbound, "time", clock)
    return slept


def test_limits_are_those_of_the_documentation(checkout: Path) -> None:
    text = " ".join((checkout / "docs" / "ros.md").read_text(encoding="utf-8").split())
    for sentence in (
        f"whose header is incomplete after {inbound.HANDSHAKE_TIMEOUT:g} s",
        f"the oldest one beyond {inbound.MAX_CONNECTIONS} such connections",
        f"beyond {inbound.MAX_CLIENTS:_} connections".replace("_", " "),
        f"{inbound._MAX_FILES:_} at most".replace("_", " "),
    ):
        assert sentence in text


# -- TCPROS ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "fields"), [("topic", CLOCK), ("service", DELETE)])
def test_a_complete_header_is_passed_on_without_what_follows_it(
    port: Port, handlers: Handlers, warnings_of: Any, kind: str, fields: dict[str, str]
) -> None:
    data = tcpros.header(fields)
    client = port.connect(data[:2])
    for part in (data[2:4], data[4:11], data[11:-1]):
        client.sendall(part)
        port.serve()
        assert handlers.accepted == []
    client.sendall(data[-1:] + b"request")
    port.serve_until(lambda: handlers.accepted)
    [(found, header, connection)] = handlers.accepted
    assert (found, header) == (kind, fields)
    assert connection.gettimeout() is None
    assert connection.recv(100) == b"request"
    assert port.server._pending == {}
    client.sendall(b"more")  # The server no longer watches the connection.
    assert port.server._poll.poll(0) == []
    connection.sendall(b"response")
    assert client.recv(100) == b"response"
    assert warnings_of() == []


@pytest.mark.parametrize(
    ("fields", "refusal", "expected", "client"),
    [
        (CLOCK, "no such topic", "no such topic", "/reader"),
        ({"service": "/none"}, "no such service", "no such service", "127.0.0.1"),
        ({"callerid": "/other"}, "", "no topic or service name detected", "/other"),
    ],
)
def test_a_refused_connection_receives_the_reason(
    port: Port,
    handlers: Handlers,
    warnings_of: Any,
    fields: dict[str, str],
    refusal: str,
    expected: str,
    client: str,
) -> None:
    handlers.refusal = refusal
    connection = port.connect(tcpros.header(fields))
    assert port.response(connection) == tcpros.header({"error": expected})
    assert warnings_of() == [f"refused a connection of {client}: {expected}"]
    assert len(port.server._clients) == 0


def test_a_connection_whose_handler_fails_is_closed(
    port: Port, handlers: Handlers, warnings_of: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    handlers.refusal = RuntimeError("cause")
    assert port.response(port.connect(tcpros.header(CLOCK))) == b""
    assert warnings_of() == ["a connection from 127.0.0.1 failed: cause"]
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: True)
    assert port.response(port.connect(tcpros.header(CLOCK))) == b""
    handlers.refusal = "no such topic"
    response = port.response(port.connect(tcpros.header(CLOCK)))
    assert response == tcpros.header({"error": "node shutting down"})
    assert warnings_of() == []


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (struct.pack("<I", 2**20 + 1), "header of 1048577 bytes"),
        (b"\x08\0\0\0\x04\0\0\0\xff\xfe=\xfd", "'utf-8' codec can't decode byte 0xff"),
        (b"\x05\0\0\0\x01\0\0\0a", "Invalid line in handshake header: [a]"),
    ],
)
def test_data_that_is_no_header_is_reported(
    port: Port, warnings_of: Any, data: bytes, reason: str
) -> None:
    client = port.connect(data[:3])
    [handshake] = port.server._pending.values()
    client.sendall(data[3:])
    assert port.response(client) == b""
    assert handshake.socket.fileno() == -1
    [message] = warnings_of()
    start = "closed a connection from 127.0.0.1: not a header of TCPROS: "
    assert message.startswith(f"{start}{reason}")
    assert port.server._pending == {}


def test_a_header_of_the_largest_size_is_accepted(port: Port, handlers: Handlers) -> None:
    fields = {**CLOCK, "text": ""}
    fields["text"] = "x" * (2**20 + 4 - len(tcpros.header(fields)))
    data = tcpros.header(fields)
    client = port.connect(data[:4])
    for start in range(4, len(data), 10_000):
        client.sendall(data[start : start + 10_000])
        port.serve()
    port.serve_until(lambda: handlers.accepted)


def test_a_client_that_ends_before_its_header_is_forgotten(port: Port, warnings_of: Any) -> None:
    client = port.connect(b"\x08\0")
    [handshake] = port.server._pending.values()
    client.close()
    port.serve_until(lambda: not port.server._pending)
    assert handshake.socket.fileno() == -1
    assert warnings_of() == []


def test_the_oldest_of_too_many_incomplete_headers_is_closed(port: Port, warnings_of: Any) -> None:
    first, second = port.connect(b"a"), port.connect(b"b")
    oldest, _ = port.server._pending.values()
    third = port.connect(b"c")
    assert oldest.socket.fileno() == -1
    assert port.response(first) == b""
    assert not _has_input(second)
    assert not _has_input(third)
    assert len(port.server._pending) == 2
    assert warnings_of() == ["closed a connection from 127.0.0.1: its header is not complete"]


def test_an_incomplete_header_has_a_time_limit(
    port: Port, handlers: Handlers, pauses: list[float]
) -> None:
    slow = port.connect(b"a")
    pauses.append(inbound.HANDSHAKE_TIMEOUT)
    late = port.connect(b"b")
    assert len(port.server._pending) == 2
    pauses.append(0.1)
    late.sendall(b"c")  # an event
    port.serve()
    assert port.response(slow) == b""
    assert len(port.server._pending) == 1
    assert not _has_input(late)


def test_connections_beyond_the_limit_are_refused_until_others_end(
    port: Port, handlers: Handlers, warnings_of: Any
) -> None:
    for number in (1, 2):
        port.connect(tcpros.header(CLOCK))
        port.serve_until(lambda number=number: len(handlers.accepted) == number)
    text = "the node has 2 connections already"
    assert port.response(port.connect(tcpros.header(CLOCK))) == tcpros.header({"error": text})
    assert warnings_of() == [f"refused a connection of 127.0.0.1: {text}"]
    handlers.accepted[0][2].close()
    port.connect(tcpros.header(DELETE))
    port.serve_until(lambda: len(handlers.accepted) == 3)
    assert warnings_of() == []


def test_exhausted_descriptors_end_the_oldest_connection(
    port: Port, warnings_of: Any, pauses: list[float]
) -> None:
    client = port.connect(b"a")
    server_sock = port.server.server_sock

    def fail(number: int) -> None:
        port.server.server_sock = _failing(number)
        port.server._accept()
        port.server.server_sock = server_sock

    fail(errno.ECONNABORTED)
    assert (warnings_of(), pauses) == ([], [])
    assert not _has_input(client)
    text = f"cannot accept connections of ROS clients: [Errno {errno.EMFILE}] cause"
    closed = "closed a connection from 127.0.0.1: its header is not complete"
    fail(errno.EMFILE)
    assert (warnings_of(), pauses) == ([text, closed], [])
    assert port.response(client) == b""
    fail(errno.EMFILE)
    assert (warnings_of(), pauses) == ([text], [EXHAUSTED_PERIOD])


def test_the_thread_continues_after_an_unexpected_error(
    handlers: Handlers, warnings_of: Any, pauses: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []

    def serve(server: TcprosServer, _number: int) -> None:
        calls.append(1)
        server.is_shutdown = len(calls) == 3
        raise RuntimeError("cause")

    monkeypatch.setattr(TcprosServer, "_serve", serve)
    server = TcprosServer(handlers.handle)
    server.run()
    assert len(calls) == 3
    assert pauses == [EXHAUSTED_PERIOD] * 2
    assert warnings_of() == ["cannot accept connections of ROS clients"] * 2
    server.server_sock.close()


def test_many_connections_can_wait_to_be_accepted(port: Port) -> None:
    # Field tcpi_sacked of a listening socket is the number of connections that can wait.
    info = port.server.server_sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 32)
    assert struct.unpack_from("<I", info, 28)[0] > 100
    assert port.server.server_sock.gettimeout() == 0.0


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((1024, 4096), (4096, 4096)),
        ((1024, resource.RLIM_INFINITY), (65_536, resource.RLIM_INFINITY)),
        ((1024, 200_000), (65_536, 200_000)),
        ((100_000, 200_000), (100_000, 200_000)),
        ((resource.RLIM_INFINITY, resource.RLIM_INFINITY), None),
    ],
)
def test_rospy_uses_these_servers_and_may_open_more_files(
    monkeypatch: pytest.MonkeyPatch, before: tuple[int, int], after: tuple[int, int] | None
) -> None:
    limits: list[tuple[int, int]] = []
    for module, name in (
        (rospy.impl.tcpros_base, "TCPServer"),
        (rosgraph.xmlrpc, "ThreadingXMLRPCServer"),
    ):
        monkeypatch.setattr(module, name, None)
    monkeypatch.setattr(resource, "getrlimit", lambda _: before)
    monkeypatch.setattr(resource, "setrlimit", lambda _, limit: limits.append(limit))
    inbound.install()
    assert limits == ([] if after is None else [after])
    assert rospy.impl.tcpros_base.TCPServer is TcprosServer
    assert rosgraph.xmlrpc.ThreadingXMLRPCServer is XmlRpcServer


# -- XML-RPC ---------------------------------------------------------------------------------------


class Rpc:
    """A server of XML-RPC whose connections the test accepts."""

    def __init__(self) -> None:
        self.server = XmlRpcServer(("127.0.0.1", 0))
        self._clients: list[Any] = []

    def connect(self) -> tuple[socket.socket, socket.socket]:
        """Returns both ends of a new connection, that of the client first."""
        client = socket.create_connection(self.server.server_address, TIMEOUT)
        accepted, _ = self.server.get_request()
        self._clients += [client, accepted]
        return client, accepted

    def close(self) -> None:
        for each in self._clients:
            each.close()
        self.server.server_close()


@pytest.fixture
def rpc(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rpc]:
    monkeypatch.setattr(inbound, "MAX_CONNECTIONS", 2)
    rpc = Rpc()
    yield rpc
    rpc.close()


def test_the_connection_without_a_request_for_the_longest_time_is_closed(rpc: Rpc) -> None:
    first, second = rpc.connect(), rpc.connect()
    assert not _has_input(first[0])
    with rpc.server.handling(first[1]):
        pass  # from here on, the second one has waited for longer
    third = rpc.connect()
    assert [_has_input(each[0]) for each in (first, second, third)] == [False, True, False]
    # A request in progress is not interrupted, and the connection counts.
    with rpc.server.handling(first[1]), rpc.server.handling(third[1]):
        fourth = rpc.connect()
        assert [_has_input(each[0]) for each in (first, third, fourth)] == [False, False, True]
    # One that has ended does not count.
    rpc.server.close_request(first[1])
    rpc.connect()
    assert not _has_input(third[0])
    rpc.connect()
    assert _has_input(third[0])


def test_a_connection_closed_during_its_request_does_not_count(rpc: Rpc) -> None:
    first, second = rpc.connect(), rpc.connect()
    with rpc.server.handling(first[1]):
        rpc.server.close_request(first[1])
        rpc.connect()
        assert not _has_input(second[0])


def test_exhausted_descriptors_end_an_idle_connection_of_xmlrpc(
    rpc: Rpc, warnings_of: Any, pauses: list[float]
) -> None:
    client, _ = rpc.connect()
    listening = rpc.server.socket

    def fail(number: int) -> None:
        rpc.server.socket = _failing(number)
        with pytest.raises(OSError, match="cause"):
            rpc.server.get_request()
        rpc.server.socket = listening

    fail(errno.ECONNABORTED)
    assert (warnings_of(), pauses) == ([], [])
    text = f"cannot accept connections of ROS clients: [Errno {errno.EMFILE}] cause"
    fail(errno.EMFILE)
    assert _has_input(client)
    fail(errno.EMFILE)
    assert warnings_of()[0] == text
    assert pauses == [inbound._CLOSE_PERIOD, EXHAUSTED_PERIOD]


@pytest.mark.parametrize(
    ("length", "status"), [(f"{2**24}", 200), (f"{2**24 + 1}", 413), ("many", 200)]
)
def test_a_request_that_is_too_large_is_refused(
    rpc: Rpc, monkeypatch: pytest.MonkeyPatch, length: str, status: int
) -> None:
    seen: list[set[socket.socket]] = []

    def handle(handler: Any) -> None:
        seen.append(set(rpc.server._busy))
        handler.send_response(200)
        handler.send_header("content-length", "0")
        handler.end_headers()
        handler.close_connection = True

    base = rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler
    monkeypatch.setattr(base, "do_POST", handle)
    client = HTTPConnection(*rpc.server.server_address, timeout=TIMEOUT)
    client.putrequest("POST", "/")
    client.putheader("content-length", length)
    client.endheaders()
    request, address = rpc.server.get_request()
    rpc.server.finish_request(request, address)
    response = client.getresponse()
    assert response.status == status
    assert status == 200 or response.headers["connection"] == "close"
    assert request.gettimeout() == 30.0
    assert seen == ([{request}] if status == 200 else [])
    assert rpc.server._busy == set()
    client.close()
    rpc.server.close_request(request)
