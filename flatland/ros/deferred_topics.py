"""Topics that are opened after the first step: markers, the pause state and diagnostics."""

from __future__ import annotations

import importlib
import logging
import threading
from concurrent.futures import Future
from typing import Any

from flatland.ros.transport.registrar import Registrar
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
        try:
            if self._debug_rate is not None:
                importlib.import_module("flatland.ros.markers.debug_topics")
                importlib.import_module("flatland.ros.markers.combined_markers")
                self._start(self._start_debug_markers, "debug markers")
            importlib.import_module("flatland.ros.pause_topic")
            self._start(self._start_pause_topic, "the pause state")
            importlib.import_module("flatland.ros.interactive.interactive_markers")
            self._start(self._start_interactive_markers, "interactive markers")
            importlib.import_module("flatland.ros.diagnostics")
            self._start(self._start_diagnostics, "diagnostics")
        except ImportError as error:
            _LOG.warning("markers or diagnostics are disabled: %s", error)

    def _start(self, action: Any, what: str) -> None:
        def log_failure(done: Future[Any]) -> None:
            error = done.exception()
            if error is not None:
                _LOG.error("cannot publish %s: %s", what, error, exc_info=error)

        self._simulation.post(action).add_done_callback(log_failure)

    def _start_debug_markers(self) -> None:
        from flatland.ros.markers.combined_markers import CombinedMarkers
        from flatland.ros.markers.debug_topics import DebugTopics

        if not self._closed and self._debug_rate is not None:
            for part in (DebugTopics, CombinedMarkers):
                self._parts.append(part(self._registrar, self._simulation, self._debug_rate))

    def _start_pause_topic(self) -> None:
        from flatland.ros.pause_topic import PauseTopic

        if not self._closed:
            self._parts.append(PauseTopic(self._registrar, self._simulation))

    def _start_interactive_markers(self) -> None:
        from flatland.ros.interactive.interactive_markers import InteractiveMarkers

        if not self._closed:
            self._parts.append(
                InteractiveMarkers(
                    self._registrar,
                    self._simulation,
                    move_keeps_odometry=self._move_keeps_odometry,
                )
            )

    def _start_diagnostics(self) -> None:
        from flatland.ros.diagnostics import Diagnostics

        if not self._closed:
            self._parts.append(Diagnostics(self._registrar, self._simulation))
