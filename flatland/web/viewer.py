"""The public class of the viewer: a server in a thread of its own."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final

import numpy as np
from aiohttp import WSCloseCode, web

from flatland.defaults import WEB_HOST, WEB_PORT
from flatland.errors import FlatlandError
from flatland.geometry import FloatArray
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation
from flatland.web.access import Access
from flatland.web.controller import DefaultController, WorldController
from flatland.web.hub import Hub
from flatland.web.scene import LayerContents
from flatland.web.server import Server
from flatland.world import World

_LOG = logging.getLogger("flatland")

_CLOSE_TIMEOUT: Final = 5.0  # s


@dataclass(frozen=True, slots=True, eq=False)
class WorldHandle:
    """A world that is shown; returned by `WebViewer.add_world`.

    Attributes:
        index: Index of the world in the protocol.
        name: Its name for users.
    """

    index: int
    name: str


class WebViewer:
    """Shows worlds in browsers; the server runs in a thread of its own.

    While nobody looks, nothing is computed. Clients that look receive a copy of the state that is
    taken between two steps, at most 30 times per second of wall time.
    """

    def __init__(
        self,
        host: str = WEB_HOST,
        port: int = WEB_PORT,
        *,
        token: str | None = None,
        read_only: bool = False,
        title: str = "flatland",
    ) -> None:
        """Creates a viewer that is not started.

        Args:
            host: Address to listen on; `0.0.0.0` for all addresses of the machine.
            port: TCP port; 0 for any free one.
            token: What clients have to know. None for no token if `host` is an address of the
                machine itself (loopback), else for a random one.
            read_only: Whether clients may only look.
            title: Title of the page.

        Raises:
            ValueError: The port is out of range, or the token is empty.
        """
        if not 0 <= port <= 65535:
            raise ValueError(f"port must be from 0 to 65535, got {port}")
        if token is not None and not token:
            raise ValueError("token must not be empty")
        self._access = Access.for_host(host, token)
        self._port = port
        self._loop: asyncio.AbstractEventLoop | None = None
        self._before_start: list[Callable[[], object]] = []
        self._hub = Hub(title, read_only)
        self._handles: dict[WorldHandle, tuple[World, _LayerObserver]] = {}
        self._thread: threading.Thread | None = None
        self._stop = asyncio.Event()
        self._closed = False
        self._lock = threading.Lock()

    def __enter__(self) -> WebViewer:
        """Starts the viewer, which is closed at the end of the block."""
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Closes the viewer."""
        self.close()

    @property
    def url(self) -> str:
        """Address of the page, with the token if there is one."""
        return self._access.url(self.port)

    @property
    def port(self) -> int:
        """TCP port; 0 before the start if any free one is to be used."""
        return self._port

    @property
    def token(self) -> str | None:
        """What clients have to know, None if they need nothing."""
        return self._access.token

    # -- start and end ---------------------------------------------------------------------

    def start(self) -> None:
        """Listens on the port and starts the thread; further calls have no effect.

        Raises:
            FlatlandError: The port cannot be used, or the viewer is closed.
        """
        with self._lock:
            if self._closed:
                raise FlatlandError("the viewer is closed")
            if self._thread is not None:
                return
            listener = self._listen()
            self._port = listener.getsockname()[1]
            self._loop = asyncio.new_event_loop()
            for action in self._before_start:
                self._loop.call_soon(action)
            self._thread = threading.Thread(
                target=self._run, args=[self._loop, listener], name="flatland-web", daemon=True
            )
            self._thread.start()

    def _listen(self) -> socket.socket:
        host, port = self._access.host, self._port
        try:
            return socket.create_server(
                (host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET
            )
        except (OSError, OverflowError, UnicodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            reason = str(reason).partition(" (while")[0]
            raise FlatlandError(
                f"the viewer cannot listen on port {port} of {host!r}: {reason}",
                hint="choose another port; 0 for any free one",
            ) from error

    def close(self) -> None:
        """Disconnects all clients and ends the thread; further calls have no effect."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            thread = self._thread
        for handle in list(self._handles):
            self.remove_world(handle)
        if thread is None:
            return
        self._call(self._stop.set)
        thread.join(_CLOSE_TIMEOUT)
        if thread.is_alive():
            _LOG.warning("the thread of the web viewer did not end")

    def _run(self, loop: asyncio.AbstractEventLoop, listener: socket.socket) -> None:
        asyncio.set_event_loop(loop)
        try:
            loop.run_until_complete(self._serve(listener))
        except Exception:
            _LOG.exception("unexpected internal error in the web viewer")
        finally:
            loop.close()

    async def _serve(self, listener: socket.socket) -> None:
        application = Server(self._hub, self._access).application()
        # Requests that are not HTTP are answered by status 400, and are not worth a log entry.
        silent = logging.Logger("flatland.web", logging.CRITICAL)
        runner = web.AppRunner(application, access_log=None, logger=silent, handle_signals=False)
        await runner.setup()
        await web.SockSite(runner, listener, shutdown_timeout=1.0).start()
        watch = asyncio.create_task(self._hub.watch())
        try:
            await self._stop.wait()
            await self._hub.disconnect(WSCloseCode.GOING_AWAY, "the viewer ends")
        finally:
            watch.cancel()
            await self._hub.close()
            await runner.cleanup()
            rest = asyncio.all_tasks() - {asyncio.current_task()}
            for task in rest:
                task.cancel()
            await asyncio.gather(*rest, return_exceptions=True)
            await asyncio.get_running_loop().shutdown_default_executor()

    # -- worlds ----------------------------------------------------------------------------

    def add_world(
        self,
        world: World,
        name: str = "",
        simulation: Simulation | None = None,
        controller: WorldController | None = None,
    ) -> WorldHandle:
        """Shows a world; safe from any thread.

        Args:
            world: The world. If it is closed, it is removed.
            name: Name for users; by default that of its file, or of its folder for `world.yaml`.
            simulation: The simulation that steps the world, if there is one.
            controller: Carries out what clients request; None for one that acts on the world and
                the simulation.

        Returns:
            The handle for `remove_world`.

        Raises:
            FlatlandError: The viewer or the world is closed.
        """
        world.check_open()
        name = name or _name_of(world.path)
        if controller is None:
            controller = DefaultController(world, simulation)
        with self._lock:
            if self._closed:
                raise FlatlandError("the viewer is closed")
            used = {handle.index for handle in self._handles}
            index = next(n for n in range(len(used) + 1) if n not in used)
            handle = WorldHandle(index, name)
            observer = _LayerObserver(self, handle)
            self._handles[handle] = (world, observer)
        self._call(lambda: self._hub.add(index, name, world, controller))
        world.between_steps(lambda: world.add_observer(observer))
        return handle

    def remove_world(self, handle: WorldHandle) -> None:
        """Removes a world; further calls have no effect. Safe from any thread."""
        with self._lock:
            found = self._handles.pop(handle, None)
        if found is None:
            return
        world, observer = found
        self._call(lambda: self._hub.remove(handle.index))
        observer.active = False
        if not world.closed:
            world.post(lambda: world.remove_observer(observer))

    def draw_lines(
        self, handle: WorldHandle, name: str, color: Sequence[float], edges: FloatArray
    ) -> None:
        """Shows lines that are not part of a world, such as goals; safe from any thread.

        Args:
            handle: The world. If it was removed, the call has no effect.
            name: Name for users; lines of the same name are replaced.
            color: (r, g, b, a), each in [0, 1].
            edges: (x1, y1, x2, y2) in the world frame [m], shape (n, 4).

        Raises:
            ValueError: The edges have the wrong shape.
        """
        lines = np.array(edges, np.float32)
        if lines.ndim != 2 or lines.shape[1] != 4:
            raise ValueError(f"edges must have the shape (n, 4), got {lines.shape}")
        contents = LayerContents(name, tuple(map(float, color)), (0.0, 0.0, 0.0), lines)
        self._call(lambda: self._hub.draw(handle.index, contents))

    def _layers_changed(self, handle: WorldHandle) -> None:
        self._call(lambda: self._hub.layers_changed(handle.index))

    def _call(self, action: Callable[[], object]) -> None:
        """Calls a function in the thread of the loop, when it has started and has not ended."""
        with self._lock:
            if self._loop is None:
                self._before_start.append(action)
                return
        with suppress(RuntimeError):  # The loop is closed.
            self._loop.call_soon_threadsafe(action)


class _LayerObserver(WorldObserver):
    """Notifies a viewer of changed layers and of the end of a world; costs nothing in steps."""

    def __init__(self, viewer: WebViewer, handle: WorldHandle) -> None:
        self._viewer = viewer
        self._handle = handle
        self.active = True

    def layer_changed(self, layer_name: str) -> None:
        """Has the layers copied again."""
        del layer_name
        if self.active:
            self._viewer._layers_changed(self._handle)

    def detached(self) -> None:
        """Removes the world."""
        if self.active:
            self._viewer.remove_world(self._handle)


def _name_of(path: str) -> str:
    """Returns the name of a world file for users."""
    file = Path(path)
    is_plain = file.stem in ("", "world")
    return (file.absolute().parent.name if is_plain and path else file.stem) or "world"
