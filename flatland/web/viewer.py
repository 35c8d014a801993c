"""The public class of the viewer: a server that runs in a separate thread."""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import numpy as np
from aiohttp import WSCloseCode, web

from flatland.checks import checked_count, checked_range
from flatland.defaults import WEB_HOST, WEB_PORT
from flatland.errors import FlatlandError
from flatland.geometry import IDENTITY, FloatArray
from flatland.runtime.observer import WorldObserver
from flatland.scene.description import LayerDescription
from flatland.simulation import Simulation
from flatland.web.acceptor import Acceptor
from flatland.web.access import Access
from flatland.web.controller import WorldController, controller_of
from flatland.web.feed import WorldFeed
from flatland.web.foreign_topics import ForeignTopics
from flatland.web.hub import Hub
from flatland.web.server import Server
from flatland.world import World

_LOG = logging.getLogger("flatland")

_CLOSE_TIMEOUT: Final = 5.0  # s
_SHUTDOWN_TIMEOUT: Final = 1.0  # s, for requests that are being answered
_KEEP_ALIVE: Final = 15.0  # s between two requests of a connection


@dataclass(frozen=True, slots=True, eq=False)
class WorldHandle:
    """A world that a viewer shows; returned by `WebViewer.add_world`.

    Attributes:
        index: Index of the world in the protocol.
        name: Name of the world for users.
    """

    index: int
    name: str


class WebViewer:
    """Shows worlds in browsers; the server runs in a separate thread.

    Without clients, nothing is computed. With clients, the state of a world is copied between two
    steps, at most 30 times per second of wall time.
    """

    def __init__(
        self,
        host: str = WEB_HOST,
        port: int = WEB_PORT,
        *,
        token: str | None = None,
        view_token: str | None = None,
        read_only: bool = False,
        title: str = "flatland",
        embeddable: bool = False,
    ) -> None:
        """Creates a viewer that is not started.

        Args:
            host: Address to listen on; `0.0.0.0` for all addresses of the machine.
            port: TCP port; 0 for any free one.
            token: Token that clients must send, of at least 16 characters. None for no token if
                `host` is a loopback address and there is no `view_token`, otherwise for a random
                token.
            view_token: Another token, for clients that cannot change a world.
            read_only: Whether to refuse all requests of clients that change a world.
            title: Title of the page.
            embeddable: Whether pages of all other sites may show the page in a frame; otherwise
                only pages of this machine, if `host` is a loopback address.

        Raises:
            ValueError: The port is out of range, a token is too short, or both are equal.
        """
        checked_range("port", port, 0, 65535)
        port = checked_count("port", port, 0)
        self._access = Access.for_host(host, token, view_token, read_only=read_only)
        self._port = port
        self._embeddable = embeddable
        self._loop: asyncio.AbstractEventLoop | None = None
        self._before_start: list[Callable[[], object]] = []
        self._hub = Hub(title)
        self._ids = itertools.count(1)  # of models, bodies and lasers of all worlds
        self._shown: dict[WorldHandle, tuple[WorldFeed, WorldObserver]] = {}
        self._thread: threading.Thread | None = None
        self._stop = asyncio.Event()
        self._closed = False
        self._lock = threading.Lock()

    def __enter__(self) -> WebViewer:
        """Starts the viewer; the end of the block closes the viewer."""
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Closes the viewer."""
        self.close()

    @property
    def url(self) -> str:
        """Address of the page, with the token if there is one."""
        return self._access.url(self.port, self.token)

    @property
    def view_url(self) -> str | None:
        """Address of the page with the token of viewers, None without such a token."""
        token = self._access.view_token
        return None if token is None else self._access.url(self.port, token)

    @property
    def port(self) -> int:
        """TCP port; 0 before the start if any free one is to be used."""
        return self._port

    @property
    def token(self) -> str | None:
        """Token that clients must send, None if no token is required."""
        return self._access.token

    @property
    def is_watched(self) -> bool:
        """Whether a browser shows a world."""
        with self._lock:
            return any(not feed.audience.empty for feed, _ in self._shown.values())

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
        for handle in list(self._shown):
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
        acceptor = Acceptor(listener)
        server = Server(
            self._hub, self._access, acceptor.received_request, embeddable=self._embeddable
        )
        # Requests that are not HTTP result in status 400, without a log entry.
        silent = logging.Logger("flatland.web", logging.CRITICAL)
        runner = web.AppRunner(
            server.application(),
            access_log=None,
            logger=silent,
            handle_signals=False,
            keepalive_timeout=_KEEP_ALIVE,
        )
        await runner.setup()
        connections = cast("web.Server", runner.server)
        acceptor.start(connections)
        watch = asyncio.create_task(self._hub.commands.watch())
        try:
            await self._stop.wait()
            await self._hub.disconnect(WSCloseCode.GOING_AWAY, "the viewer ends")
        finally:
            watch.cancel()
            acceptor.close()
            await self._hub.close()
            await connections.shutdown(_SHUTDOWN_TIMEOUT)
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
        foreign_topics: ForeignTopics | None = None,
    ) -> WorldHandle:
        """Shows a world; safe from any thread.

        Args:
            world: The world; removed from the viewer when it is closed.
            name: Name of the world for users; by default the name of the world file, or of the
                folder of a file `world.yaml`.
            simulation: The simulation that steps the world, if there is one.
            controller: Performs the requests of clients; None for a controller that acts on the
                world and the simulation.
            foreign_topics: Topics of other programs that clients can show, None for none.

        Returns:
            The handle for `remove_world`.

        Raises:
            FlatlandError: The viewer or the world is closed.
        """
        world.check_open()
        name = name or _name_of(world.path)
        if controller is None:
            controller = controller_of(world, simulation)
        with self._lock:
            if self._closed:
                raise FlatlandError("the viewer is closed")
            used = {handle.index for handle in self._shown}
            index = next(n for n in range(len(used) + 1) if n not in used)
            handle = WorldHandle(index, name)
            feed = WorldFeed(index, name, world, controller, self._ids, foreign_topics)
            observer = _FeedObserver(
                layer_changed=lambda: self._call(feed.layers_changed),
                detached=lambda: self.remove_world(handle),
            )
            self._shown[handle] = (feed, observer)
        self._call(lambda: self._hub.add(feed))
        world.between_steps(lambda: world.add_observer(observer))
        return handle

    def remove_world(self, handle: WorldHandle) -> None:
        """Removes a world; further calls have no effect. Safe from any thread."""
        with self._lock:
            found = self._shown.pop(handle, None)
        if found is None:
            return
        feed, observer = found
        world = feed.world
        self._call(lambda: self._hub.remove(feed))
        if not world.closed:
            world.post(lambda: world.remove_observer(observer))

    def draw_lines(
        self, handle: WorldHandle, name: str, color: Sequence[float], edges: FloatArray
    ) -> None:
        """Shows lines that are not part of a world, such as goals; safe from any thread.

        Args:
            handle: The world; without effect if the world was removed.
            name: Name of the lines for users; replaces lines of the same name.
            color: (r, g, b, a), each in [0, 1].
            edges: (x1, y1, x2, y2) in the world frame [m], shape (n, 4).

        Raises:
            ValueError: The edges have the wrong shape.
        """
        lines = np.array(edges, np.float32)
        if lines.ndim != 2 or lines.shape[1] != 4:
            raise ValueError(f"edges must have the shape (n, 4), got {lines.shape}")
        r, g, b, a = map(float, color)
        description = LayerDescription(name, (r, g, b, a), IDENTITY, lines)
        with self._lock:
            shown = self._shown.get(handle)
        if shown is not None:
            self._call(lambda: shown[0].draw(description))

    def _call(self, action: Callable[[], object]) -> None:
        """Calls a function in the thread of the loop: after the start, and not after the end."""
        with self._lock:
            if self._loop is None:
                self._before_start.append(action)
                return
        with suppress(RuntimeError):  # The loop is closed.
            self._loop.call_soon_threadsafe(action)


class _FeedObserver(WorldObserver):
    """Calls functions when the layers of a world change, and at the end of the world."""

    def __init__(self, layer_changed: Callable[[], None], detached: Callable[[], None]) -> None:
        self._layer_changed = layer_changed
        self._detached = detached

    def layer_changed(self, layer_name: str) -> None:  # noqa: ARG002
        """Calls the first function."""
        self._layer_changed()

    def detached(self) -> None:
        """Calls the second function."""
        self._detached()


def _name_of(path: str) -> str:
    """Returns the name of a world for users, from the path of its file."""
    file = Path(path)
    is_plain = file.stem in ("", "world")
    return (file.absolute().parent.name if is_plain and path else file.stem) or "world"
