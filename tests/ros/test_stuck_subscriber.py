"""A subscriber that connects and never reads does not block the simulation."""

from __future__ import annotations

import itertools
import socket
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from xmlrpc.client import ServerProxy

import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from waiting import TIMEOUT

BEAMS = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20,
     angle: {min: -2, max: 2, increment: 0.0004}}
"""
SCAN_SIZE = 40_000  # bytes, about: 10 001 beams


class StuckSubscriber:
    """A subscriber that completes the handshake of TCPROS, and then reads only on demand."""

    def __init__(self, master: Any, topic: str, message_type: type[Any]) -> None:
        (publisher,) = next(nodes for name, nodes in master.getSystemState()[0] if name == topic)
        node = ServerProxy(master.lookupNode(publisher))
        code, text, protocol = node.requestTopic("/stuck", topic, [["TCPROS"]])
        assert code == 1, text
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.settimeout(TIMEOUT)
        self.socket.connect((urlparse(f"//{protocol[1]}").hostname, protocol[2]))
        fields = {
            "callerid": "/stuck",
            "topic": topic,
            "type": message_type._type,
            "md5sum": message_type._md5sum,
            "message_definition": message_type._full_text,
        }
        lines = [f"{name}={value}".encode() for name, value in fields.items()]
        header = b"".join(struct.pack("<I", len(line)) + line for line in lines)
        self.socket.sendall(struct.pack("<I", len(header)) + header)
        assert b"md5sum" in self.read_frame()

    def read_frame(self) -> bytes:
        """Reads one message or the header."""
        (size,) = struct.unpack("<I", self._read(4))
        return self._read(size)

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self.socket.recv(size - len(data))
            assert part, "the publisher closed the connection"
            data += part
        return data


@pytest.fixture(autouse=True)
def server(launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: robot, model: beams.model.yaml}]", beams=BEAMS)
    return launcher.server(world, update_rate=1000)


@pytest.fixture
def stuck(ros: Any) -> Iterator[StuckSubscriber]:
    subscriber = StuckSubscriber(ros.master, "/scan", LaserScan)
    yield subscriber
    subscriber.socket.close()


def test_other_subscribers_receive_all_messages(ros: Any, stuck: StuckSubscriber) -> None:
    del stuck
    clock, scans = ros.topic("/clock", Clock), ros.topic("/scan", LaserScan)
    # 500 scans of 40 kB exceed the buffers of any socket.
    first = clock.next().clock.to_sec()
    clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    scans.drop()
    scans.take(10)
    # Services and the simulation are not affected either.
    assert ros.spawn("ball.model.yaml", "ball").success
    clock.drop()
    clock.next()


def test_slow_reader_receives_complete_messages_up_to_the_newest(
    ros: Any, stuck: StuckSubscriber
) -> None:
    clock = ros.topic("/clock", Clock)
    first = clock.next().clock.to_sec()
    later = clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    ros.call("/pause", Empty)
    last = [later, *clock.rest(1.0)][-1].clock.to_nsec()
    stamps = []
    while not stamps or stamps[-1] < last - 5_000_000:
        scan = LaserScan()
        scan.deserialize(stuck.read_frame())
        assert len(scan.ranges) == 10_001
        stamps.append(scan.header.stamp.to_nsec())
    # In order, without duplicates, and with gaps of dropped messages.
    assert stamps == sorted(set(stamps))
    steps = [after - before for before, after in itertools.pairwise(stamps)]
    assert max(steps) > 5_000_000


def test_closed_connection_is_removed(ros: Any, stuck: StuckSubscriber, server: Any) -> None:
    clock = ros.topic("/clock", Clock)
    first = clock.next().clock.to_sec()
    clock.until(lambda message: message.clock.to_sec() > first + 500 * 0.005)
    stuck.socket.close()
    ros.topic("/scan", LaserScan).take(5)
    assert "Traceback" not in server.output
    assert server.stop() == 0
