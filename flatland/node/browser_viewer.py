"""The viewer in the browser as a part of the node."""

from __future__ import annotations

import errno
import logging
import threading
import time
from typing import TYPE_CHECKING, Final

from flatland.errors import FlatlandError
from flatland.node.transport import REGISTRATION_TIMEOUT

if TYPE_CHECKING:
    from flatland.node.operations import Operations
    from flatland.node.parameters import NodeParameters
    from flatland.node.transport import ForeignTopicsConnection, Transport
    from flatland.simulation import Simulation
    from flatland.web import WebViewer

_LOG = logging.getLogger("flatland")

_PORT_TIMEOUT: Final = 10.0  # s; a node that this one replaces ends within this time
_PORT_POLL_PERIOD: Final = 0.2  # s


class BrowserViewer:
    """Shows the world of the node in the browser.

    The server starts after the first step and after the registration of topics and services, in a
    thread of its own, because importing its modules takes longer than loading a small world. If it
    cannot start, the simulator continues without it.
    """

    def __init__(
        self,
        transport: Transport,
        simulation: Simulation,
        operations: Operations,
        parameters: NodeParameters,
    ) -> None:
        """Schedules the start of the server.

        Args:
            transport: Registers the topics and services of the node, which comes first.
            simulation: Simulation of the world.
            operations: What clients can do.
            parameters: The parameters of the node.
        """
        self._transport = transport
        self._simulation = simulation
        self._operations = operations
        self._parameters = parameters
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._viewer: WebViewer | None = None
        self._topics: ForeignTopicsConnection | None = None
        thread = threading.Thread(target=self._start, name="flatland-web-start", daemon=True)
        # The outer action runs before the first step, the inner one after it.
        simulation.post(lambda: simulation.post(thread.start))

    def close(self) -> None:
        """Ends the server; further calls have no effect."""
        self._closing.set()
        with self._lock:
            if self._viewer is not None:
                self._viewer.close()
                self._viewer = None
            if self._topics is not None:
                self._topics.close()
                self._topics = None

    def _start(self) -> None:
        """Starts the server, or logs why it cannot start."""
        self._transport.flush(REGISTRATION_TIMEOUT)
        try:
            viewer = self._open()
        except (FlatlandError, ValueError) as error:
            self._report(str(error))
        except Exception:
            _LOG.exception("unexpected internal error of the viewer in the browser")
        else:
            with self._lock:
                if not self._closing.is_set():
                    self._viewer = viewer
                    _LOG.info("viewer in the browser: %s", viewer.url)
                    if viewer.view_url is not None:
                        _LOG.info("for viewers: %s", viewer.view_url)
                    return
            viewer.close()
            self.close()

    def _open(self) -> WebViewer:
        """Returns a server that is started.

        Raises:
            FlatlandError: A package is missing, or the server cannot listen on its port.
            ValueError: A parameter is invalid.
        """
        from flatland.web import WebViewer

        parameters = self._parameters
        viewer = WebViewer(
            parameters.web_host,
            parameters.web_port,
            token=parameters.web_token,
            view_token=parameters.web_view_token,
            read_only=parameters.web_read_only,
        )
        topics = self._topics = self._transport.load_foreign_topics()(self._simulation)
        try:
            viewer.add_world(
                self._simulation.world,
                simulation=self._simulation,
                controller=self._operations,
                foreign_topics=topics,
            )
            self._listen(viewer)
        except BaseException:
            viewer.close()
            raise
        return viewer

    def _listen(self, viewer: WebViewer) -> None:
        """Starts a server; waits while a node that this one replaces still uses the port.

        Raises:
            FlatlandError: The server cannot listen on its port.
        """
        end = time.monotonic() + _PORT_TIMEOUT
        while True:
            try:
                viewer.start()
            except FlatlandError as error:
                cause = error.__cause__
                in_use = isinstance(cause, OSError) and cause.errno == errno.EADDRINUSE
                if not in_use or time.monotonic() > end or self._closing.wait(_PORT_POLL_PERIOD):
                    raise
            else:
                return

    def _report(self, reason: str) -> None:
        if not self._closing.is_set():
            _LOG.error(
                "the viewer in the browser cannot start: %s. The simulator continues without it",
                reason,
            )
