"""Connections to the server that clients leave idle."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from raw_web_client import RawWebClient
from waiting import TIMEOUT

from flatland.web import WebViewer, acceptor

REQUEST = b"HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture
def connect(viewer: WebViewer) -> Iterator[Callable[[], socket.socket]]:
    """Opens connections that send nothing."""
    opened: list[socket.socket] = []

    def connect() -> socket.socket:
        opened.append(socket.create_connection(("127.0.0.1", viewer.port), TIMEOUT))
        return opened[-1]

    yield connect
    for connection in opened:
        connection.close()


def is_closed(connection: socket.socket) -> bool:
    """Waits until the server closes a connection."""
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def is_served(connection: socket.socket) -> bool:
    """Requests a file."""
    try:
        connection.sendall(REQUEST)
        return connection.recv(1000).startswith(b"HTTP/1.1 200 OK")
    except ConnectionError:
        return False


def test_a_connection_without_a_complete_header_is_closed(connect, url, monkeypatch):
    with RawWebClient(url) as client:
        served = connect()
        assert is_served(served)
        monkeypatch.setattr(acceptor, "HEADER_TIMEOUT", 0.05)
        silent, slow = connect(), connect()
        slow.sendall(REQUEST[:10])
        assert is_closed(silent)
        assert is_closed(slow)
        # Those with a request remain.
        assert is_served(served)
        client.ask("files")


def test_connections_of_an_address_are_limited(connect, monkeypatch, caplog):
    monkeypatch.setattr(acceptor, "MAX_OF_ADDRESS", 3)
    accepted = [connect() for _ in range(3)]
    assert all(map(is_served, accepted))
    assert all(is_closed(connect()) for _ in range(20))
    assert caplog.text.count("too many connections from 127.0.0.1") <= 2
    accepted.pop().close()
    while not is_served(connect()):
        pass  # The server has not received the end of the connection.


def test_a_new_connection_replaces_the_oldest_one_without_a_request(connect, monkeypatch):
    monkeypatch.setattr(acceptor, "MAX_CONNECTIONS", 4)
    oldest = connect()
    # The server accepts connections in order once a request is answered in between.
    assert is_served(connect())
    second = connect()
    assert is_served(connect())
    assert is_served(connect())
    assert is_closed(oldest)
    assert is_served(second)
    # All have requests now.
    assert is_closed(connect())


def test_the_server_waits_for_file_descriptors(connect, monkeypatch, caplog):
    silent = connect()
    assert is_served(connect())  # The server has accepted both.
    accept = socket.socket.accept
    failures = iter(range(3))

    def fail_first(listener: socket.socket) -> Any:
        if next(failures, None) is not None:
            raise OSError(errno.EMFILE, "Too many open files")
        return accept(listener)

    monkeypatch.setattr(socket.socket, "accept", fail_first)
    assert is_served(connect())
    assert is_closed(silent)
    assert caplog.text.count("cannot accept a connection: [Errno 24] Too many open files") == 1
