"""A subscriber that reads the messages of a node and discards them, without rospy."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections.abc import Iterator
from xmlrpc.client import ServerProxy

TIMEOUT = 20.0  # s
_SIZE = struct.Struct("<I")
_TIME = struct.Struct("<II")
NANOSECONDS = 1_000_000_000


def connected(uri: str, topic: str) -> socket.socket:
    """Subscribes to a topic.

    Args:
        uri: Address of the XML-RPC server of the node.
        topic: The topic.

    Raises:
        RuntimeError: The node does not publish the topic.
    """
    with ServerProxy(uri) as node:
        code, text, protocol = node.requestTopic("/light_reader", topic, [["TCPROS"]])
    if code != 1:
        raise RuntimeError(f"{topic}: {text}")
    _, host, port = protocol
    connection = socket.create_connection((host, port), TIMEOUT)
    fields = {"callerid": "/light_reader", "topic": topic, "type": "*", "md5sum": "*"}
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    content = b"".join(_SIZE.pack(len(line)) + line for line in lines)
    connection.sendall(_SIZE.pack(len(content)) + content)
    _read_frame(connection)
    return connection


def _read_frame(connection: socket.socket) -> bytes:
    """Reads one message or header."""
    (size,) = _SIZE.unpack(_read(connection, _SIZE.size))
    return _read(connection, size)


def _read(connection: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise RuntimeError("the node has closed the connection")
        data += part
    return data


def simulated_time(uri: str) -> float:
    """Returns the time of the next message of /clock of a node [s].

    Args:
        uri: Address of its XML-RPC server.
    """
    with connected(uri, "/clock") as connection:
        seconds, nanoseconds = _TIME.unpack(_read_frame(connection))
    return float(seconds + nanoseconds / NANOSECONDS)


@contextlib.contextmanager
def light_reader(uri: str, topics: tuple[str, ...]) -> Iterator[None]:
    """Reads topics of a node, in a thread for each.

    Args:
        uri: Address of the XML-RPC server of the node.
        topics: The topics.
    """
    connections = [connected(uri, topic) for topic in topics]
    threads = [threading.Thread(target=_discard, args=(each,)) for each in connections]
    for connection, thread in zip(connections, threads, strict=True):
        connection.settimeout(None)
        thread.start()
    try:
        yield
    finally:
        for connection, thread in zip(connections, threads, strict=True):
            connection.shutdown(socket.SHUT_RDWR)
            thread.join()
            connection.close()


def _discard(connection: socket.socket) -> None:
    buffer = bytearray(1 << 16)
    with contextlib.suppress(OSError):
        while connection.recv_into(buffer):
            pass
