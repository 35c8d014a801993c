"""The render mode `human`: a viewer in the browser that all environments of a process share."""

from __future__ import annotations

import math
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from gymnasium.error import DependencyNotInstalled

from flatland.checks import checked_count, shown
from flatland.defaults import WEB_PORT
from flatland.errors import FlatlandError
from flatland.extras import MissingPackageError, require
from flatland.geometry import Vector2

if TYPE_CHECKING:
    from flatland.geometry import FloatArray
    from flatland.web import WebViewer, WorldHandle
    from flatland.world import World

PORT_VARIABLE: Final = "FLATLAND_WEB_PORT"
_MAX_PORT: Final = 65535
_GOALS: Final = "goals"
_GOAL_COLOR: Final = (0.17, 0.63, 0.17, 1.0)
_GOAL_EDGES: Final = 24


def check_live_view(port: int | None) -> None:
    """Checks that environments can be shown in the browser.

    Args:
        port: The argument `web_port` of an environment.

    Raises:
        DependencyNotInstalled: aiohttp is missing.
        ValueError: The port is invalid.
    """
    try:
        require("aiohttp", 'render_mode "human" requires')
    except MissingPackageError as error:
        raise DependencyNotInstalled(str(error)) from error
    _find_port(port)


def checked_port(port: int) -> int:
    """Returns the argument `web_port` of an environment.

    Raises:
        ValueError: The port is invalid.
    """
    try:
        return checked_count("web_port", port, 0, _MAX_PORT)
    except ValueError:
        raise ValueError(
            f"web_port must be an integer from 0 to {_MAX_PORT}, got {shown(port)}"
        ) from None


def _find_port(port: int | None) -> int | None:
    """Returns the port of an argument or of the environment variable, None if neither is given.

    Raises:
        ValueError: The port is invalid.
    """
    if port is not None:
        return checked_port(port)
    text = os.environ.get(PORT_VARIABLE, "")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and int(text) <= _MAX_PORT):
        raise ValueError(f"{PORT_VARIABLE} must be an integer from 0 to {_MAX_PORT}, got {text!r}")
    return int(text)


class SharedViewer:
    """A viewer of several users in this process, which is open while they show worlds.

    The viewer is read-only, because the actions of agents alone determine an episode.
    """

    def __init__(self) -> None:
        """Creates a viewer that is not open."""
        self._lock = threading.Lock()
        self._process = os.getpid()
        self._viewer: WebViewer | None = None
        self._shown = 0

    def add(
        self, worlds: Sequence[World], names: Sequence[str], port: int | None
    ) -> tuple[WebViewer, list[WorldHandle]]:
        """Shows worlds; the first call opens the viewer and prints its address.

        Args:
            worlds: The worlds.
            names: Their names for users.
            port: Port of a viewer that this call opens, 0 for any free one. None for the port of
                the environment variable or, if the variable is not set, a default or any free
                port.

        Returns:
            The viewer, and the handles of the worlds for `remove`.

        Raises:
            FlatlandError: The viewer cannot listen on the port.
        """
        with self._lock:
            if self._process != os.getpid():
                # A child process does not have the thread of the viewer of its parent.
                self._process, self._viewer, self._shown = os.getpid(), None, 0
            if self._viewer is None:
                self._viewer = _open_viewer(port)
            viewer = self._viewer
            handles: list[WorldHandle] = []
            try:
                for world, name in zip(worlds, names, strict=True):
                    handles.append(viewer.add_world(world, name))
                    self._shown += 1
            except BaseException:
                self._remove(viewer, handles)
                raise
            return viewer, handles

    def replace(
        self, viewer: WebViewer, handle: WorldHandle, world: World, name: str
    ) -> WorldHandle:
        """Shows a world in the place of another one.

        Args:
            viewer: The viewer of the other world.
            handle: The handle of the other world.
            world: The world.
            name: Its name for users.

        Returns:
            The handle of the world.
        """
        with self._lock:
            viewer.remove_world(handle)
            return viewer.add_world(world, name)

    def remove(self, viewer: WebViewer, handles: Sequence[WorldHandle]) -> None:
        """Removes worlds; the viewer is closed with the last one."""
        with self._lock:
            if viewer is self._viewer and self._process == os.getpid():
                self._remove(viewer, handles)

    def _remove(self, viewer: WebViewer, handles: Sequence[WorldHandle]) -> None:
        for handle in handles:
            viewer.remove_world(handle)
        self._shown -= len(handles)
        if self._shown == 0:
            viewer.close()
            self._viewer = None


SHARED: Final = SharedViewer()
"""The viewer of all environments of this process."""


class EpisodeView:
    """Shows the worlds of an environment with their goals, in real time."""

    def __init__(
        self,
        worlds: Sequence[World],
        names: Sequence[str],
        dt: float,
        port: int | None,
    ) -> None:
        """Prepares the view, which opens with the first call of `show`.

        Args:
            worlds: The worlds; their list may change.
            names: Their names for users.
            dt: Simulated time of a step of the environment [s].
            port: See `SharedViewer.add`.
        """
        self._worlds = worlds
        self._shown: list[World] = []
        self._names = names
        self._dt = dt
        self._port = port
        self._opened: tuple[WebViewer, list[WorldHandle]] | None = None
        self._goals: list[Sequence[Vector2]] = [()] * len(worlds)
        self._due = 0.0

    def show(self, goals: Sequence[Sequence[Vector2]], radius: float) -> None:
        """Shows the current state, at the earliest the time of a step after the previous call.

        Args:
            goals: The goals in each world [m].
            radius: Distance at which an agent has arrived [m].

        Raises:
            FlatlandError: The viewer cannot listen on its port.
        """
        if self._opened is None:
            self._opened = SHARED.add(self._worlds, self._names, self._port)
            self._shown = list(self._worlds)
            self._due = time.monotonic()
        viewer, handles = self._opened
        for number, world in enumerate(self._worlds):
            if world is not self._shown[number]:
                name = self._names[number]
                handles[number] = SHARED.replace(viewer, handles[number], world, name)
                self._shown[number] = world
                self._goals[number] = ()
        for number, (handle, places) in enumerate(zip(handles, goals, strict=True)):
            if places != self._goals[number]:
                self._goals[number] = places
                viewer.draw_lines(handle, _GOALS, _GOAL_COLOR, _circles(places, radius))
        now = time.monotonic()
        self._due = max(self._due + self._dt, now)
        time.sleep(self._due - now)

    def close(self) -> None:
        """Ends the view; further calls have no effect."""
        if self._opened is not None:
            SHARED.remove(*self._opened)
            self._opened = None


def _open_viewer(port: int | None) -> WebViewer:
    """Opens a viewer, prints its address, and shows it if there is a display.

    Raises:
        FlatlandError: The viewer cannot listen on the port.
    """
    from flatland.web import WebViewer

    wanted = _find_port(port)
    viewer = WebViewer(port=WEB_PORT if wanted is None else wanted, read_only=True)
    try:
        viewer.start()  # A viewer that does not start leaves nothing behind.
    except FlatlandError:
        if wanted is not None:
            raise
        viewer = WebViewer(port=0, read_only=True)  # Another program uses the default.
        viewer.start()
    print(f"flatland: {viewer.url}", file=sys.stderr, flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(viewer.url)
    return viewer


def _circles(centers: Sequence[Vector2], radius: float) -> FloatArray:
    """Returns circles as edges, shape (n, 4)."""
    angles = np.linspace(0.0, math.tau, _GOAL_EDGES + 1)
    ring = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    edges = np.concatenate([ring[:-1], ring[1:]], axis=1)
    offsets = np.tile(np.asarray(centers, np.float64).reshape(-1, 2), 2)
    circles: FloatArray = (offsets[:, None, :] + edges).reshape(-1, 4).astype(np.float32)
    return circles
