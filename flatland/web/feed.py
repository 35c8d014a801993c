"""What clients see of one world: captured at most 30 times a second while a client looks."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any, Final

from flatland.entities.model import Model
from flatland.errors import PLUGIN_FAULTS, WorldError
from flatland.web.audience import Audience
from flatland.web.capture import Capture, Captured
from flatland.web.client_view import Seen, View
from flatland.web.controller import WorldController
from flatland.web.extras import Extras
from flatland.web.scan_state import ScanState
from flatland.web.scene import LayerContents
from flatland.web.status import STALE_AFTER, Status
from flatland.web.world_requests import UnawaitedRequests, between_steps, wait_for
from flatland.web.world_state import WorldState
from flatland.world import World

_LOG = logging.getLogger("flatland")

PERIOD: Final = 1 / 30  # s of wall time between two captures


class WorldFeed:
    """The latest state of one world in the thread of the server.

    Attributes:
        index: Index of the world in messages.
        name: Name of the world for users.
        world: The world.
        controller: Carries out what clients request.
        holds: Models that clients hold; used between two steps only.
        state: Its layers, models and poses.
    """

    def __init__(
        self,
        index: int,
        name: str,
        world: World,
        controller: WorldController,
        ids: Iterator[int],
    ) -> None:
        """Creates a feed that nobody looks at.

        Args:
            index: Index of the world in messages.
            name: Name of the world for users.
            world: The world.
            controller: Carries out what clients request.
            ids: Returns ids that have not been used.
        """
        self.index, self.name, self.world, self.controller = index, name, world, controller
        self.holds = controller.holds
        self._audience = Audience()
        self._requests = UnawaitedRequests(world)
        self._capture = Capture(world, controller, ids)
        self._layers_changed = True
        self.state = WorldState(index, name)
        self._scans = ScanState(index)
        self._status = Status(index)
        self._extras = Extras(index, world)
        self._stale_timer: asyncio.TimerHandle

    # -- clients ---------------------------------------------------------------------------

    def look(self, wake: Callable[[], None], view: View) -> None:
        """Adds a client, or changes what it looks at.

        Args:
            wake: Called when there is something new; identifies the client.
            view: What it looks at.
        """
        self._audience.add(wake, view)

    def look_away(self, wake: Callable[[], None]) -> None:
        """Removes a client."""
        self._audience.remove(wake)

    def next_message(self, seen: Seen, view: View) -> str | bytes | None:
        """Returns the next message for a client, None if it has received everything.

        Args:
            seen: What the client has received; updated.
            view: What it looks at.
        """
        state = self.state
        if not state.tick:
            return None
        message = state.next_contents(seen) or self._status.next_message(seen)
        message = message or state.next_poses(seen)
        if message is None and view.scans:
            message = self._scans.next_message(seen, state.revision, state.time)
        return message or self._extras.next_message(seen, view)

    # -- requests --------------------------------------------------------------------------

    def find_model(self, number: int) -> Model:
        """Returns the model of an id; to be called between two steps.

        Raises:
            WorldError: It was deleted.
        """
        known = self._capture.scene.models.get(number)
        if known is None or known.model not in self.world.models:
            raise WorldError("the model does not exist any more")
        return known.model

    async def wait_for(self, future: Future[Any]) -> None:
        """Waits for a future that is completed between two steps, without blocking the loop.

        Raises:
            Exception: The exception of the future.
        """
        await wait_for(self.world, future)

    def post(self, action: Callable[[], None]) -> None:
        """Has an action carried out between two steps, even if the server ends before."""
        self._requests.post(action)

    def layers_changed(self) -> None:
        """Copies the layers again at the next capture."""
        self._layers_changed = True

    def draw(self, lines: LayerContents) -> None:
        """Shows lines in addition to the layers, instead of earlier lines of the same name."""
        self.state.draw(lines)
        self._layers_changed = True

    # -- captures --------------------------------------------------------------------------

    async def run(self) -> None:
        """Captures the state while a client looks, until the world is closed."""
        loop = asyncio.get_running_loop()
        try:
            while not self.world.closed:
                if self._audience.empty:
                    self._rest()
                    await self._audience.wait()
                began = loop.time()
                await self._update(began)
                self._audience.wake()
                await asyncio.sleep(max(began + PERIOD - loop.time(), 0.001))
        finally:
            if not self.world.closed:
                self.world.post(self._capture.end)

    def _rest(self) -> None:
        """Ends everything that costs something; nobody looks."""
        if not self.world.closed:
            self.world.post(self._capture.end)
        self._status.rest()
        self._scans.clear()
        self._extras.clear()

    async def _update(self, now: float) -> None:
        demand = self._audience.demand(now, self._layers_changed)
        self._layers_changed = False
        loop = asyncio.get_running_loop()
        self._stale_timer = loop.call_later(STALE_AFTER, self._tell_stale)
        try:
            captured = await between_steps(self.world, lambda: self._capture.take(demand))
            await self._extras.read_parameters(captured.details)
            self._apply(captured, now, loop.time())
        except PLUGIN_FAULTS as error:
            self._layers_changed = self._layers_changed or demand.layers
            if not self.world.closed:
                _LOG.warning("web viewer: the world cannot be captured: %s", error)
                await asyncio.sleep(1.0)
        finally:
            self._stale_timer.cancel()

    def _tell_stale(self) -> None:
        """Tells the clients, again and again, that the simulator does not answer."""
        loop = asyncio.get_running_loop()
        self._status.renew(loop.time())
        self._audience.wake()
        self._stale_timer = loop.call_later(STALE_AFTER, self._tell_stale)

    def _apply(self, captured: Captured, asked: float, answered: float) -> None:
        """Takes over a captured state, requested and received at these times of the loop [s]."""
        state = self.state
        state.apply(captured)
        if captured.change.layout:
            self._scans.keep_only(state.laser_ids())
        self._scans.apply(captured.scans, state.tick)
        self._extras.apply(captured, state.tick)
        self._status.apply(captured, asked, answered)
