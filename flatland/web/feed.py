"""What clients see of one world: captured at most 30 times a second while there are clients."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from typing import Final

from flatland.entities.model import Model
from flatland.errors import PLUGIN_FAULTS, WorldError
from flatland.scene.description import LayerDescription
from flatland.web.capture import CapturedWorld, WorldCapture
from flatland.web.contents import WorldContents
from flatland.web.controller import WorldController
from flatland.web.foreign_topics import ForeignTopics
from flatland.web.history import MAX_AGE, History, Timeline
from flatland.web.latest_scans import LatestScans
from flatland.web.optional_messages import OptionalMessages
from flatland.web.status import STALE_TIMEOUT, WorldStatus
from flatland.web.topic_messages import TopicMessages
from flatland.web.views import Audience, Demand, Received, View
from flatland.web.world_requests import WorldRequests
from flatland.world import World

_LOG = logging.getLogger("flatland")

PERIOD: Final = 1 / 30  # s of wall time between two captures


class WorldFeed:
    """The latest state of one world, in the thread of the server.

    Attributes:
        index: Index of the world in messages.
        name: Name of the world for users.
        world: The world.
        controller: Performs the requests of clients.
        audience: The clients that look at the world.
        requests: Requests of the server to the world.
        contents: Layers, models and poses of the world.
        history: Earlier states of the world; used between two steps.
        foreign_topics: Topics of other programs, None without a connection to them.
    """

    def __init__(
        self,
        index: int,
        name: str,
        world: World,
        controller: WorldController,
        ids: Iterator[int],
        foreign_topics: ForeignTopics | None = None,
    ) -> None:
        """Creates a feed without clients, in any thread.

        Args:
            index: Index of the world in messages.
            name: Name of the world for users.
            world: The world.
            controller: Performs the requests of clients.
            ids: Returns ids that have not been used.
            foreign_topics: Topics of other programs.
        """
        self.index, self.name, self.world, self.controller = index, name, world, controller
        self.audience = Audience()
        self.requests = WorldRequests(world)
        self.contents = WorldContents(index, name)
        self.history = History(world)
        self._capture = WorldCapture(world, controller, ids)
        self._layers_changed = True
        self._scans = LatestScans()
        self._status = WorldStatus(index)
        self._optional = OptionalMessages(index, world)
        self._stale_timer: asyncio.TimerHandle
        self.foreign_topics = foreign_topics
        self._topics: TopicMessages | None = None
        if foreign_topics is not None:
            self._topics = TopicMessages(
                index, foreign_topics, self.audience.notify, lambda: self.contents.head.time
            )

    def next_message(self, received: Received, view: View) -> str | bytes | None:
        """Returns the next message for a client, None if the client has received all.

        Args:
            received: What the client has received; updated.
            view: What the client looks at.
        """
        contents = self.contents
        if not contents.tick:
            return None
        message = contents.next_contents(received) or self._status.next_message(received)
        message = message or contents.next_poses(received)
        if message is None and view.scans:
            message = self._scans.next_message(received, contents.head, compact=view.compact_scans)
        message = message or self._optional.next_message(received, view)
        if message is None and self._topics is not None:
            message = self._topics.next_message(received, view, contents.head)
        return message

    def find_model(self, number: int) -> Model:
        """Returns the model with an id; must be called between two steps.

        Raises:
            WorldError: The model was deleted.
        """
        tracked = self._capture.tracker.models.get(number)
        if tracked is None or tracked.model not in self.world.models:
            raise WorldError("the model does not exist any more")
        return tracked.model

    def layers_changed(self) -> None:
        """Makes the next capture copy the layers."""
        self._layers_changed = True

    def draw(self, lines: LayerDescription) -> None:
        """Shows lines in addition to the layers; replaces lines of the same name."""
        self.contents.set_lines(lines)
        self._layers_changed = True

    # -- captures --------------------------------------------------------------------------

    async def run(self) -> None:
        """Captures the world while there are clients, until the world is closed."""
        loop = asyncio.get_running_loop()
        topics = None if self._topics is None else asyncio.create_task(self._topics.run())
        try:
            while not self.world.closed:
                if self.audience.empty:
                    self._suspend()
                    await self._wait_for_audience()
                began = loop.time()
                await self._update(began)
                self.audience.notify()
                await asyncio.sleep(max(began + PERIOD - loop.time(), 0.001))
        finally:
            if topics is not None:
                topics.cancel()
            self._end_capture()

    async def _wait_for_audience(self) -> None:
        """Waits until there is a client; drops the history when all of it is too old."""
        try:
            async with asyncio.timeout(MAX_AGE):
                await self.audience.wait()
        except TimeoutError:
            self.requests.post(self.history.clear)
            await self.audience.wait()

    def _suspend(self) -> None:
        """Withdraws the demand for outputs and releases data that no client needs."""
        self._end_capture()
        self._status.restart()
        self._scans.clear()
        self._optional.clear()
        if self._topics is not None:
            self._topics.want(None)

    def _end_capture(self) -> None:
        if not self.world.closed:
            self.world.post(self._capture.end)

    async def _update(self, now: float) -> None:
        demand = self.audience.demand(now, self._layers_changed)
        if self._topics is not None:
            self._topics.want(self.audience.topic_demand())
        self._layers_changed = False
        loop = asyncio.get_running_loop()
        self._stale_timer = loop.call_later(STALE_TIMEOUT, self._report_stale)
        try:
            captured, timeline = await self.requests.run(lambda: self._take(demand))
            await self._optional.read_parameters(captured.details)
            self._apply(captured, now, loop.time())
            if timeline is not None:
                self._optional.set_timeline(timeline, self.contents.tick)
        except PLUGIN_FAULTS as error:
            self._layers_changed = self._layers_changed or demand.layers
            if not self.world.closed:
                _LOG.warning("web viewer: the world cannot be captured: %s", error)
                await asyncio.sleep(1.0)
        finally:
            self._stale_timer.cancel()

    def _take(self, demand: Demand) -> tuple[CapturedWorld, Timeline | None]:
        """Captures the world, and its history if it is demanded; called between two steps."""
        captured = self._capture.take(demand)
        if not demand.history:
            return captured, None
        self.history.update()
        return captured, self.history.timeline

    def _report_stale(self) -> None:
        """Sends the time without an answer of the simulator, repeatedly until there is one."""
        loop = asyncio.get_running_loop()
        self._status.renew(loop.time())
        self.audience.notify()
        self._stale_timer = loop.call_later(STALE_TIMEOUT, self._report_stale)

    def _apply(self, captured: CapturedWorld, asked: float, answered: float) -> None:
        """Passes a capture to the sources of messages.

        Args:
            captured: The captured world.
            asked: Time of the loop at which the capture was requested [s].
            answered: Time of the loop at which the capture was received [s].
        """
        contents = self.contents
        contents.apply(captured)
        if captured.changes.layout:
            self._scans.keep_only(contents.laser_ids())
        self._scans.apply(captured.scans, contents.tick)
        self._optional.apply(captured, contents.tick)
        self._status.apply(captured, asked, answered)
