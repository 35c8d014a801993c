"""Warnings about the network: a node that nobody can reach, and another publisher of the time."""

from __future__ import annotations

import logging
import os
import time
from typing import Any, Final
from xmlrpc.client import ServerProxy

import rosgraph
import rospy

from flatland.node.clock import warn_of_other_clocks
from flatland.ros.transport.master_watch import LimitedTransport
from flatland.ros_addresses import is_only_local, master_address, own_host, remedy

_LOG = logging.getLogger("flatland")

_TIMEOUT: Final = 2.0  # s, of a call
_PERIOD: Final = 2.0  # s of wall time between two calls for the state of the system
_MAX_SHARE: Final = 0.02  # of the wall time that these calls may take; large systems take longer


class NetworkCheck:
    """Logs each of its warnings once; to be called after each poll of the master."""

    def __init__(self, *, publishes_clock: bool) -> None:
        """Prepares the checks.

        Args:
            publishes_clock: Whether this node publishes `/clock`.
        """
        self._clock = rospy.resolve_name("/clock") if publishes_clock else None
        self._is_address_checked = False
        self._due = 0.0
        self._known: set[str] = set()

    def __call__(self) -> None:
        """Makes the checks that are due; in the thread that polls the master."""
        if not self._is_address_checked:
            self._is_address_checked = True
            _check_own_address()
        start = time.monotonic()
        if self._clock is None or start < self._due:
            return
        publishers = _publishers_of(self._clock) - {rospy.get_name()} - self._known
        if publishers:
            self._known |= publishers
            warn_of_other_clocks(self._clock, sorted(publishers))
        now = time.monotonic()
        self._due = now + max(_PERIOD, (now - start) / _MAX_SHARE)


def _publishers_of(topic: str) -> set[str]:
    with ServerProxy(rosgraph.get_master_uri(), transport=LimitedTransport(_TIMEOUT)) as master:
        response: Any = master.getSystemState(rospy.get_name())
    publishers, _subscribers, _services = response[2]
    return {node for name, nodes in publishers if name == topic for node in nodes}


def _check_own_address() -> None:
    """Logs a warning if this node cannot be reached at the address that others know."""
    uri = rospy.core.get_node_uri()
    host, variable = own_host()
    problem = _call_problem(uri)
    if not problem and is_only_local(host, master_address(rosgraph.get_master_uri())[0]):
        problem = "only programs on this machine can use it, but the master is on another one"
    if problem:
        source = f"from {variable}" if variable else "with the name of this machine"
        _LOG.warning(
            "no other node can connect to this one at its address %s, %s: %s; %s",
            uri,
            source,
            problem,
            remedy(variable),
        )


def _call_problem(uri: str) -> str:
    """Returns why a call to this node fails, empty if it does not."""
    try:
        with ServerProxy(uri, transport=LimitedTransport(_TIMEOUT)) as node:
            response: Any = node.getPid(rospy.get_name())
    except Exception as error:
        return str(error) or type(error).__name__
    return "" if response[2] == os.getpid() else "it is that of another program"
