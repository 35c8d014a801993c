"""Ports for programs that must be given one, such as a ROS master."""

from __future__ import annotations

import os
import random
import socket
from pathlib import Path
from typing import Final

_RANGE: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
_used: set[int] = set()


def free_port() -> int:
    """Returns a TCP port that no program uses until the caller starts one.

    The system assigns ports of its own range to connections, and to servers without a fixed port.
    This one is below that range, and processes of one test run receive different ones.
    """
    end = int(_RANGE.read_text().split()[0])
    count = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    ports = list(range(max(end - 16_000, 1024) + number, end, count))
    random.shuffle(ports)
    for port in ports:
        with socket.socket() as probe:
            if port not in _used and probe.connect_ex(("127.0.0.1", port)):
                _used.add(port)
                return port
    raise OSError("no TCP port is free")
