"""Domains of ROS 2, which separate the nodes of one machine."""

from __future__ import annotations

import contextlib
import random
import socket
from collections.abc import Iterator
from typing import Final

from flatland.errors import FlatlandError

MAX_DOMAIN: Final = 101
"""Greatest domain whose ports are not those of outgoing connections on any system."""
_PARTICIPANTS: Final = 10  # of a domain, whose ports are checked
# By the standard of DDS, a participant receives at 7410 + 250 * domain + 2 * participant.
_FIRST_PORT: Final = 7410
_PORTS_PER_DOMAIN: Final = 250
_PORTS_PER_PARTICIPANT: Final = 2


@contextlib.contextmanager
def reserved_domain() -> Iterator[int]:
    """Reserves a random domain that is not in use on this machine, until the end of the block.

    The reservation also ends with the process.

    Raises:
        FlatlandError: All domains are in use.
    """
    for number in random.SystemRandom().sample(range(1, MAX_DOMAIN + 1), MAX_DOMAIN):
        with socket.socket(socket.AF_UNIX) as reservation:
            try:
                # An abstract name, which is no file and exists as long as the socket.
                reservation.bind(f"\0flatland-ros2-domain-{number}")
            except OSError:
                continue
            if not _has_participants(number):
                yield number
                return
    raise FlatlandError(f"all ROS domains from 1 to {MAX_DOMAIN} are in use")


def _has_participants(domain: int) -> bool:
    """Returns whether a node, of any user and program, receives at a port of a domain."""
    for participant in range(_PARTICIPANTS):
        port = _FIRST_PORT + _PORTS_PER_DOMAIN * domain + _PORTS_PER_PARTICIPANT * participant
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", port))
            except OSError:
                return True
    return False
