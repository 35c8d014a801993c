"""Clients that speak TCPROS byte by byte, for calls and faults that rospy does not make."""

from __future__ import annotations

import socket
import struct
from collections.abc import Mapping
from io import BytesIO
from typing import Any
from urllib.parse import urlparse
from xmlrpc.client import ServerProxy

from waiting import TIMEOUT


def header(fields: Mapping[str, str]) -> bytes:
    """Returns the bytes of a header."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    content = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(content)) + content


def connect(address: tuple[str, int], receive_buffer: int | None = None) -> socket.socket:
    """Opens a connection."""
    connection = socket.socket()
    connection.settimeout(TIMEOUT)
    if receive_buffer is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    connection.connect(address)
    return connection


def read(connection: socket.socket, size: int) -> bytes:
    """Reads a number of bytes; raises ConnectionError if the connection ends before."""
    data = b""
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise ConnectionError(f"closed after {len(data)} of {size} bytes")
        data += part
    return data


def read_frame(connection: socket.socket) -> bytes:
    """Reads one message or header."""
    (size,) = struct.unpack("<I", read(connection, 4))
    return read(connection, size)


def is_closed(connection: socket.socket) -> bool:
    """Waits until the other end closes the connection."""
    try:
        while connection.recv(4096):
            pass
    except ConnectionResetError:
        pass
    return True


def node_uri(master: Any, node: str) -> str:
    """Returns the address of the XML-RPC server of a node."""
    return str(master.lookupNode(node))


def xmlrpc_address(master: Any, node: str) -> tuple[str, int]:
    """Returns host and port of the XML-RPC server of a node."""
    return _address(node_uri(master, node))


def service_address(master: Any, service: str) -> tuple[str, int]:
    """Returns host and port of the TCPROS server of the node with a service."""
    return _address(str(master.lookupService(service)))


def _address(uri: str) -> tuple[str, int]:
    parsed = urlparse(uri)
    assert parsed.hostname is not None
    assert parsed.port is not None
    return parsed.hostname, parsed.port


class ServiceClient:
    """Calls a service, over one connection or over a new one for each call."""

    def __init__(
        self, address: tuple[str, int], name: str, service_type: type[Any], *, persistent: bool
    ) -> None:
        self._address = address
        self._type = service_type
        self._fields = {
            "callerid": "/client",
            "service": name,
            "md5sum": service_type._md5sum,
            "persistent": "1" if persistent else "0",
        }
        self._persistent = persistent
        self._connection: socket.socket | None = None

    def call(self, *arguments: Any) -> Any:
        """Sends a request and waits for the response."""
        self.send([arguments])
        response = self.receive()
        if not self._persistent:
            self.close()
        return response

    def send(self, requests: list[tuple[Any, ...]]) -> None:
        """Sends requests without waiting for the responses."""
        data = b""
        if self._connection is None:
            self._connection = connect(self._address)
            data = header(self._fields)
            self._new = True
        for arguments in requests:
            buffer = BytesIO()
            self._type._request_class(*arguments).serialize(buffer)
            data += struct.pack("<I", len(buffer.getvalue())) + buffer.getvalue()
        self._connection.sendall(data)
        if self._new:
            assert b"md5sum" in read_frame(self._connection)
            self._new = False

    def receive(self) -> Any:
        """Waits for a response; raises RuntimeError if it is an error."""
        assert self._connection is not None
        succeeded = read(self._connection, 1) == b"\1"
        data = read_frame(self._connection)
        if not succeeded:
            raise RuntimeError(data.decode())
        return self._type._response_class().deserialize(data)

    def close(self) -> None:
        """Closes the connection."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None


class Subscriber:
    """Completes the handshake of a topic, and then reads only on demand."""

    def __init__(
        self, master: Any, topic: str, message_type: type[Any], *, node: str = "", **fields: str
    ) -> None:
        if not node:
            (node,) = next(nodes for name, nodes in master.getSystemState()[0] if name == topic)
        proxy = ServerProxy(node_uri(master, node))
        code, text, protocol = proxy.requestTopic("/stuck", topic, [["TCPROS"]])
        assert code == 1, text
        self.socket = connect((protocol[1], protocol[2]), receive_buffer=4096)
        given = {
            "callerid": "/stuck",
            "topic": topic,
            "type": message_type._type,
            "md5sum": message_type._md5sum,
            "message_definition": message_type._full_text,
            **fields,
        }
        self.socket.sendall(header(given))
        self.response = read_frame(self.socket)
