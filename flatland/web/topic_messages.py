"""Messages about topics of other programs: their list, drawings and values."""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import Callable
from typing import Any, Final

from flatland.errors import PLUGIN_FAULTS
from flatland.web import encoding
from flatland.web.encoding import Head, text_message
from flatland.web.foreign_topics import Cells, ForeignTopics, Grid, Marks, TopicDemand, TopicUpdate
from flatland.web.messages import MAX_NAME
from flatland.web.views import Received, View

_LOG = logging.getLogger("flatland")

PERIOD: Final = 0.1  # s of wall time between two updates
WORKING_SHARE: Final = 0.2
"""Largest share of wall time in which drawings are converted and compressed."""
_RETRY_PERIOD: Final = 1.0  # s until the next update after a failure


class TopicMessages:
    """The latest state of the topics that clients look at, in the thread of the loop.

    Updates, with all conversions, run in a helper thread. A client receives the newest drawing of
    each topic only.
    """

    def __init__(
        self,
        index: int,
        source: ForeignTopics,
        notify: Callable[[], None],
        now: Callable[[], float],
    ) -> None:
        """Creates an object without topics.

        Args:
            index: Index of the world in messages.
            source: The topics.
            notify: Notifies all clients of new messages.
            now: Returns the simulated time of the last capture [s].
        """
        self._index = index
        self._source = source
        self._notify = notify
        self._now = now
        self._numbers: dict[str, int] = {}  # number of each topic in messages
        self._next_number = itertools.count(1)
        self._ticks = itertools.count(1)
        self._demand: TopicDemand | None = None
        self._wanted = asyncio.Event()
        self._list: tuple[int, str] = (-1, "")  # tick, message
        self._fields: dict[str, Any] = {}  # of the last list
        self._drawings: dict[str, tuple[int, int, bytes]] = {}  # tick, kind, content
        self._values: dict[str, tuple[int, str]] = {}  # tick, message
        self._compressed: dict[str, tuple[Cells, bytes]] = {}

    def want(self, demand: TopicDemand | None) -> None:
        """Changes what is demanded.

        Args:
            demand: What clients look at, None if no client shows topics.
        """
        self._demand = demand
        if demand is not None:
            self._wanted.set()

    async def run(self) -> None:
        """Updates the topics while they are demanded; runs until it is cancelled."""
        while True:
            await self._wanted.wait()
            period = PERIOD
            began = time.monotonic()
            try:
                if self._demand is None:
                    self._wanted.clear()
                    await asyncio.to_thread(self._source.suspend)
                    self._clear()
                    continue
                self._apply(*await asyncio.to_thread(self._update, self._demand))
            except PLUGIN_FAULTS:
                _LOG.exception("web viewer: topics cannot be shown")
                period = _RETRY_PERIOD
            await asyncio.sleep(max(period, (time.monotonic() - began) / WORKING_SHARE))

    # -- in a helper thread ----------------------------------------------------------------

    def _update(self, demand: TopicDemand) -> tuple[TopicDemand, TopicUpdate, dict[str, Any]]:
        update = self._source.update(demand)
        encoded = {}
        for name, drawing in update.drawings.items():
            if isinstance(drawing, Marks):
                encoded[name] = (encoding.MARKS, encoding.marks_content(drawing))
            else:
                encoded[name] = (encoding.GRID, self._grid_content(name, drawing))
        return demand, update, encoded

    def _grid_content(self, name: str, grid: Grid) -> bytes:
        """Encodes a grid; cells that have not changed are not compressed again."""
        known = self._compressed.get(name)
        if known is None or known[0] is not grid.cells:
            known = self._compressed[name] = (grid.cells, encoding.compressed_cells(grid.cells))
        return encoding.grid_content(grid.pose, grid.resolution, grid.cells.shape, known[1])

    # -- in the thread of the loop ---------------------------------------------------------

    def _apply(self, demand: TopicDemand, update: TopicUpdate, encoded: dict[str, Any]) -> None:
        for latest, names in (
            (self._drawings, demand.drawn),
            (self._compressed, demand.drawn),
            (self._values, demand.inspected),
        ):
            for name in [name for name in latest if name not in names]:
                del latest[name]
        for name, (kind, content) in encoded.items():
            self._drawings[name] = (next(self._ticks), kind, content)
        for name, value in update.values.items():
            message = {
                "type": "topic_values",
                "world": self._index,
                "topic": name,
                "time": self._now(),
                "value": value,
            }
            self._values[name] = (next(self._ticks), text_message(message))
        self._apply_list(update)
        self._notify()

    def _apply_list(self, update: TopicUpdate) -> None:
        # A client could not select topics with longer names.
        topics = [topic for topic in update.topics if len(topic.name) <= MAX_NAME]
        for topic in topics:
            if topic.name not in self._numbers:
                self._numbers[topic.name] = next(self._next_number)
        fields = {
            "topics": [
                {
                    "id": self._numbers[topic.name],
                    "topic": topic.name,
                    "type": topic.type,
                    "drawn_as": topic.drawn_as or None,
                    "status": topic.status,
                }
                for topic in topics
            ],
            "pose_topics": {kind: list(names) for kind, names in update.pose_topics.items()},
        }
        if fields != self._fields:
            self._fields = fields
            message = {"type": "topics", "world": self._index, **fields}
            self._list = (next(self._ticks), text_message(message))

    def _clear(self) -> None:
        self._drawings.clear()
        self._compressed.clear()
        self._values.clear()

    def next_message(self, received: Received, view: View, head: Head) -> str | bytes | None:
        """Returns the next message for a client, None if the client has received all.

        Args:
            received: What the client has received; updated.
            view: What the client looks at.
            head: Header of binary messages.
        """
        if view.topics is None:
            return None
        if received.topics < self._list[0]:
            received.topics, text = self._list
            return text
        for name in view.topics:
            tick, kind, content = self._drawings.get(name, (-1, 0, b""))
            if name in self._numbers and received.drawings.get(name, -1) < tick:
                received.drawings[name] = tick
                return encoding.topic_message(head, kind, self._numbers[name], content)
        for name in view.topic_values:
            tick, text = self._values.get(name, (-1, ""))
            if received.topic_values.get(name, -1) < tick:
                received.topic_values[name] = tick
                return text
        return None
