"""Topics that are opened after the first step: markers, the pause state and diagnostics."""

from __future__ import annotations

import importlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ticker import TickerThread
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")


class DeferredTopics:
    """Opens the topics that display a world, after the first step.

    The modules are imported in a background thread, because importing the marker messages takes
    longer than loading a small world.
    """

    def __init__(
        self,
        registrar: Registrar,
        simulation: Simulation,
        *,
        debug_rate: float | None,
        move_keeps_odometry: bool = False,
    ) -> None:
        """Schedules the opening of the topics.

        Args:
            registrar: Registers the topics with the ROS master.
            simulation: Simulation of the world.
            debug_rate: Rate of the debug markers in wall time [Hz]; None for no debug markers.
            move_keeps_odometry: Whether a drag keeps the odometry of the model.
        """
        self._move_keeps_odometry = move_keeps_odometry
        self._registrar = registrar
        self._simulation = simulation
        self._debug_rate = debug_rate
        self._closed = False
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
        markers = "flatland.ros.markers"
        thread = TickerThread("flatland-markers", self._simulation.post)
        try:
            if self._debug_rate is not None:
                debug = [
                    importlib.import_module(f"{markers}.debug_topics").DebugTopics,
                    importlib.import_module(f"{markers}.combined_markers").CombinedMarkers,
                ]
                self._start("debug markers", *debug, rate=self._debug_rate, thread=thread)
            pause_topic = importlib.import_module("flatland.ros.pause_topic")
            self._start("the pause state", pause_topic.PauseTopic)
            interactive = importlib.import_module("flatland.ros.interactive.interactive_markers")
            self._start(
                "interactive markers",
                interactive.InteractiveMarkers,
                thread=thread,
                move_keeps_odometry=self._move_keeps_odometry,
            )
            diagnostics = importlib.import_module("flatland.ros.diagnostics")
            self._start("diagnostics", diagnostics.Diagnostics)
        except ImportError as error:
            _LOG.warning("markers or diagnostics are disabled: %s", error)

    def _start(self, what: str, *parts: Callable[..., Any], **options: object) -> None:
        """Creates parts between two steps.

        Args:
            what: What they publish, for the log.
            parts: Their classes.
            options: Arguments of their constructors.
        """

        def create() -> None:
            if not self._closed:
                for part in parts:
                    self._parts.append(part(self._registrar, self._simulation, **options))

        def log_failure(done: Future[Any]) -> None:
            error = done.exception()
            if error is not None:
                _LOG.error("cannot publish %s: %s", what, error, exc_info=error)

        self._simulation.post(create).add_done_callback(log_failure)
