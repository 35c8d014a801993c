"""A subscriber without threads of its own, for tests that depend on when a message is read."""

from __future__ import annotations

import select
from typing import Any
from xmlrpc.client import ServerProxy

import tcpros


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
        self.socket = tcpros.connect((protocol[1], protocol[2]), receive_buffer)
        fields = {
            "callerid": name,
            "topic": topic,
            "type": message_type._type,
            "md5sum": message_type._md5sum,
            "message_definition": message_type._full_text,
        }
        self.socket.sendall(tcpros.header(fields))
        assert b"md5sum" in tcpros.read_frame(self.socket)

    def next(self) -> Any:
        """Reads one message."""
        return self._message_type().deserialize(tcpros.read_frame(self.socket))

    def received(self) -> list[Any]:
        """Reads the messages that have arrived, without waiting for the first byte of another."""
        messages = []
        while select.select([self.socket], [], [], 0.0)[0]:
            messages.append(self.next())
        return messages

    def close(self) -> None:
        """Closes the connection."""
        self.socket.close()
