"""A subscriber without threads of its own, for tests that depend on when a message is read."""

from __future__ import annotations

import select
import socket
import struct
from typing import Any
from urllib.parse import urlparse
from xmlrpc.client import ServerProxy

from waiting import TIMEOUT


class RawSubscriber:
    """A subscriber that completes the handshake of TCPROS, and then reads only on demand."""

    def __init__(
        self,
        master: Any,
        topic: str,
        message_type: type[Any],
        receive_buffer: int | None = None,
        name: str = "/raw",
        publisher: str = "/flatland_server",
    ) -> None:
        """Connects to the publisher of a topic.

        Args:
            master: Proxy of the ROS master.
            topic: Resolved name of the topic.
            message_type: ROS message class.
            receive_buffer: Size of the receive buffer of the socket [bytes]; None for the default.
            name: Name of the node; a publisher keeps one connection for each name.
            publisher: Node to connect to if several nodes publish the topic: that of another test
                may not have been unregistered.
        """
        self._message_type = message_type
        nodes = next(nodes for name, nodes in master.getSystemState()[0] if name == topic)
        (only,) = nodes if len(nodes) == 1 else [node for node in nodes if node == publisher]
        node = ServerProxy(master.lookupNode(only))
        code, text, protocol = node.requestTopic(name, topic, [["TCPROS"]])
        assert code == 1, text
        self.socket = socket.socket()
        if receive_buffer is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(TIMEOUT)
        self.socket.connect((urlparse(f"//{protocol[1]}").hostname, protocol[2]))
        fields = {
            "callerid": name,
            "topic": topic,
            "type": message_type._type,
            "md5sum": message_type._md5sum,
            "message_definition": message_type._full_text,
        }
        lines = [f"{name}={value}".encode() for name, value in fields.items()]
        header = b"".join(struct.pack("<I", len(line)) + line for line in lines)
        self.socket.sendall(struct.pack("<I", len(header)) + header)
        assert b"md5sum" in self.read_frame()

    def next(self) -> Any:
        """Reads one message."""
        return self._message_type().deserialize(self.read_frame())

    def received(self) -> list[Any]:
        """Reads the messages that have arrived, without waiting for the first byte of another."""
        messages = []
        while select.select([self.socket], [], [], 0.0)[0]:
            messages.append(self.next())
        return messages

    def read_frame(self) -> bytes:
        """Reads the bytes of one message, or of the header."""
        (size,) = struct.unpack("<I", self._read(4))
        return self._read(size)

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self.socket.recv(size - len(data))
            assert part, "the publisher closed the connection"
            data += part
        return data

    def close(self) -> None:
        """Closes the connection."""
        self.socket.close()
