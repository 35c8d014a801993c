"""Topics that are opened after the first step: markers, handles, the pause state, diagnostics."""

from __future__ import annotations

import importlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from flatland.node.ticker import TickerThread
from flatland.node.transport import Connection, Transport
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")


class DeferredTopics:
    """Opens the topics that display a world, after the first step.

    The modules are imported in a background thread, because importing the marker messages takes
    longer than loading a small world.

    Attributes:
        opened: Set as soon as all topics are open, or cannot be opened.
    """

    def __init__(
        self,
        transport: Transport,
        simulation: Simulation,
        *,
        debug_rate: float | None,
        move_keeps_odometry: bool,
    ) -> None:
        """Schedules the opening of the topics.

        Args:
            transport: Publishes the topics.
            simulation: Simulation of the world.
            debug_rate: Rate of the debug markers in wall time [Hz]; None for no debug markers.
            move_keeps_odometry: Whether a drag keeps the odometry of the model.
        """
        self._move_keeps_odometry = move_keeps_odometry
        self._transport = transport
        self._simulation = simulation
        self._debug_rate = debug_rate
        self._closed = False
        self.opened = threading.Event()
        self._parts: list[Any] = []
        thread = threading.Thread(target=self._load, name="flatland-deferred-topics", daemon=True)
        # The outer action runs before the first step, the inner one after it.
        simulation.post(lambda: simulation.post(thread.start))

    def close(self) -> None:
        """Stops publishing; must be called in the thread that steps the world."""
        self._closed = True
        for part in self._parts:
            part.close()

    def _load(self) -> None:
        """Imports the modules and opens the topics of each between two steps."""
        transport, simulation = self._transport, self._simulation
        thread = TickerThread("flatland-markers", simulation.post)
        try:
            if self._debug_rate is not None:
                markers = transport.load_debug_markers()
                self._start("debug markers", markers, simulation, self._debug_rate, thread)
            states = importlib.import_module("flatland.node.states")
            self._start("the pause state", states.PauseTopic, transport, simulation)
            start_server = transport.load_handle_server()
            if start_server is not None:
                handles = importlib.import_module("flatland.node.handles")
                handles_type = partial(
                    handles.Handles, move_keeps_odometry=self._move_keeps_odometry
                )
                self._start("interactive markers", handles_type, simulation, thread, start_server)
            diagnostics = importlib.import_module("flatland.node.diagnostics")
            transport.publishable(diagnostics.Diagnostics)  # imports the message package
            self._start("diagnostics", diagnostics.DiagnosticsTopic, transport, simulation)
        except ImportError as error:
            _LOG.warning("markers or diagnostics are disabled: %s", error)
        finally:
            simulation.post(self.opened.set)

    def _start(self, what: str, part: Callable[..., Connection], *arguments: object) -> None:
        """Creates a part between two steps.

        Args:
            what: What it publishes, for the log.
            part: Its class.
            arguments: Arguments of the constructor.
        """

        def create() -> None:
            if not self._closed:
                self._parts.append(part(*arguments))

        def log_failure(done: Future[Any]) -> None:
            error = done.exception()
            if error is not None:
                _LOG.error("cannot publish %s: %s", what, error, exc_info=error)

        self._simulation.post(create).add_done_callback(log_failure)
