"""Starts what shows a world: interactive markers and pause always, debug markers where wanted."""

from __future__ import annotations

import importlib
import logging
import threading
from concurrent.futures import Future
from typing import Any

from flatland.ros.registrar import Registrar
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")


class Visualization:
    """Shows a world from its first step on.

    The modules are loaded in the background after the first step: the messages of markers take
    longer to import than a small world to load.
    """

    def __init__(
        self, registrar: Registrar, simulation: Simulation, *, debug_rate: float | None
    ) -> None:
        """Starts soon.

        Args:
            registrar: Talks to the ROS master.
            simulation: Whose world to show.
            debug_rate: Debug markers of each model in a second of wall time [Hz]; None for no
                debug markers.
        """
        self._registrar = registrar
        self._simulation = simulation
        self._debug_rate = debug_rate
        self._closed = False
        self._parts: list[Any] = []
        thread = threading.Thread(target=self._load, name="flatland-visualization", daemon=True)
        # What an action posts runs after the step that the action ran before.
        simulation.post(lambda: simulation.post(thread.start))

    def close(self) -> None:
        """Shows nothing any more; in the thread that steps the world."""
        self._closed = True
        for part in self._parts:
            part.close()

    def _load(self) -> None:
        """Imports the modules, and starts each part between two steps."""
        try:
            if self._debug_rate is not None:
                importlib.import_module("flatland.ros.markers.debug_topics")
                importlib.import_module("flatland.ros.markers.combined_markers")
                self._start(self._start_debug_markers, "debug markers")
            importlib.import_module("flatland.ros.pause_topic")
            self._start(self._start_pause_topic, "the pause topic")
            importlib.import_module("flatland.ros.interactive.interactive_markers")
            self._start(self._start_interactive_markers, "interactive markers")
        except ImportError as error:
            _LOG.warning("markers are off: %s", error)

    def _start(self, action: Any, what: str) -> None:
        def report(done: Future[Any]) -> None:
            error = done.exception()
            if error is not None:
                _LOG.error("%s are off: %s", what, error, exc_info=error)

        self._simulation.post(action).add_done_callback(report)

    def _start_debug_markers(self) -> None:
        from flatland.ros.markers.combined_markers import CombinedMarkers
        from flatland.ros.markers.debug_topics import DebugVisualization

        if not self._closed and self._debug_rate is not None:
            for part in (DebugVisualization, CombinedMarkers):
                self._parts.append(part(self._registrar, self._simulation, self._debug_rate))

    def _start_pause_topic(self) -> None:
        from flatland.ros.pause_topic import PauseTopic

        if not self._closed:
            self._parts.append(PauseTopic(self._registrar, self._simulation))

    def _start_interactive_markers(self) -> None:
        from flatland.ros.interactive.interactive_markers import InteractiveMarkers

        if not self._closed:
            self._parts.append(InteractiveMarkers(self._registrar, self._simulation))
