"""Registers the node again when the ROS master returns after a failure.

rospy registers each topic and service once. A new master has no entry of the node, although its
existing connections still work.
"""

from __future__ import annotations

import contextlib
import http.client
import logging
import threading
from collections.abc import Callable
from typing import Any, Final
from xmlrpc.client import MultiCall, ServerProxy, Transport

import rosgraph
import rospy
from rospy.impl.registration import (
    Registration,
    get_registration_listeners,
    get_service_manager,
    get_topic_manager,
)

from flatland.ros.transport.registrar import Registrar

_LOG = logging.getLogger("flatland")

POLL_PERIOD: Final = 1.0  # s of wall time between two calls to the master
_TIMEOUT: Final = 10.0  # s without a response after which the master counts as lost


class MasterWatch:
    """Polls the ROS master in a separate thread.

    When the master responds again after a failure, or is another process than before, parameters,
    topics, subscriptions and services of the node are registered in the thread of the registrar,
    in order with all other registrations.
    """

    def __init__(
        self,
        registrar: Registrar,
        on_replaced: Callable[[], object],
        check_network: Callable[[], None] = lambda: None,
    ) -> None:
        """Starts the thread; must be called after `rospy.init_node`.

        Args:
            registrar: Makes the calls to the master.
            on_replaced: Called once if another node has the name of this node.
            check_network: Called after each successful poll, in the thread.
        """
        self._registrar = registrar
        self._on_replaced = on_replaced
        self._check_network = check_network
        self._uri: str = rosgraph.get_master_uri()
        self._pid: int | None = None  # of the master, None before the first response
        self._registering = 0  # registrations of the whole node that are not complete
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="flatland-master-watch", daemon=True).start()

    def close(self) -> None:
        """Ends the thread."""
        self._closed.set()

    def _run(self) -> None:
        while not self._closed.wait(POLL_PERIOD):
            try:
                pid, node_uri = self._ask()
            except Exception as error:
                if not self._registrar.master_lost and not self._closed.is_set():
                    self._registrar.master_lost = True
                    _LOG.warning(
                        "the ROS master at %s does not respond (%s): the simulation continues; the "
                        "node registers again when the master is back",
                        self._uri,
                        error,
                    )
                continue
            if self._closed.is_set():
                return
            if node_uri and node_uri != rospy.core.get_node_uri():
                self._on_replaced()
                return
            is_new = self._registrar.master_lost or self._pid not in (None, pid)
            self._registrar.master_lost, self._pid = False, pid
            if is_new or (not node_uri and not self._registering):
                self._registering += 1
                self._registrar.submit(self._register)
            # Without a response, which the next poll finds out, the check is made later.
            with contextlib.suppress(OSError, http.client.HTTPException):
                self._check_network()

    def _ask(self) -> tuple[int, str]:
        """Returns the process of the master, and the URI of the node, empty if it is unknown."""
        # A new connection for each call, since a lasting one would hide that the master is gone.
        with ServerProxy(self._uri, transport=LimitedTransport(_TIMEOUT)) as master:
            calls = MultiCall(master)
            name = rospy.get_name()
            calls.getPid(name)
            calls.lookupNode(name, name)
            responses: Any = calls()
            pid, (code, _, uri) = responses[0][2], responses[1]
        return pid, uri if code == 1 else ""

    def _register(self) -> None:
        """Registers the whole node; called in the thread of the registrar."""
        try:
            self._registrar.restore_parameters()
            topics, services = get_topic_manager(), get_service_manager()
            registrations = [
                (Registration.PUB, topics.get_publications()),
                (Registration.SUB, topics.get_subscriptions()),
                (Registration.SRV, services.get_services()),
            ]
            listeners = get_registration_listeners()
            for kind, entries in registrations:
                for name, type_or_uri in entries:
                    listeners.notify_added(name, type_or_uri, kind)
            _LOG.warning(
                "the ROS master at %s is back: registered %d topics, %d subscriptions and "
                "%d services again",
                self._uri,
                *(len(entries) for _, entries in registrations),
            )
        finally:
            self._registering -= 1


class LimitedTransport(Transport):
    """Calls that do not wait for a server that accepts a connection and never responds."""

    def __init__(self, timeout: float) -> None:
        """Limits the time of each call [s]."""
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """Returns a connection with the time limit; called for each call to the server."""
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection
