"""What clients look at, what has to be captured for them, and what they have received."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from flatland.web.foreign_topics import TopicDemand

DETAILS_PERIOD: Final = 0.2  # s of wall time between two messages `details`
FRAMES_PERIOD: Final = 0.1  # s of wall time between two messages `frames`


@dataclass(frozen=True, slots=True)
class View:
    """What one client looks at in all of its worlds.

    Attributes:
        scans: Whether to send laser scans.
        compact_scans: Whether to send the codes of ranges instead of the ranges.
        frames: Whether to send the transforms of frames.
        inspect: Id of the model that is inspected, None for none.
        series: Names of the numbers that are plotted.
        history: Whether to keep earlier states of the world, and to send their times.
        topics: Names of the topics of other programs that are drawn; None if they are not listed.
        topic_values: Names of the topics of other programs whose values are shown.
    """

    scans: bool = False
    compact_scans: bool = False
    frames: bool = False
    inspect: int | None = None
    series: tuple[str, ...] = ()
    history: bool = False
    topics: tuple[str, ...] | None = None
    topic_values: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Demand:
    """What to capture of a world for its clients.

    Attributes:
        scans: Whether to capture laser scans.
        layers: Whether to copy the layers, because they are new or have changed.
        frames: Whether to copy the transforms.
        inspected: Ids of the models that are inspected.
        details: Whether to copy the details of these models.
        series: Names of the numbers that are plotted.
        history: Whether to keep earlier states of the world.
    """

    scans: bool = False
    layers: bool = False
    frames: bool = False
    inspected: frozenset[int] = frozenset()
    details: bool = False
    series: frozenset[str] = frozenset()
    history: bool = False


@dataclass(slots=True)
class Received:
    """What one client has received of one world; -1 where it has received nothing.

    Attributes:
        world: Version of the message `world`.
        layers: Version of the edges of each layer.
        models: Revision of the models.
        poses: Number of the capture of the poses.
        bodies: Version of the selection of bodies whose poses were sent last.
        scans: Number of the capture of the scans.
        status: Version of the status.
        details: Number of the capture of the details.
        frames: Number of the capture of the frames.
        values: Number of the capture of the plotted numbers.
        history: Number of the capture of the history.
        topics: Version of the list of topics of other programs.
        drawings: Version of the drawing of each topic that is drawn.
        topic_values: Version of the values of each topic.
    """

    world: int = -1
    layers: dict[int, int] = field(default_factory=dict)
    models: int = -1
    poses: int = -1
    bodies: int = -1
    scans: int = -1
    status: int = -1
    details: int = -1
    frames: int = -1
    values: int = -1
    history: int = -1
    topics: int = -1
    drawings: dict[str, int] = field(default_factory=dict)
    topic_values: dict[str, int] = field(default_factory=dict)

    def keep_topics(self, view: View) -> None:
        """Forgets topics that the client does not look at, and so receives again when it does."""
        if view.topics is None:
            self.topics = -1
        for received, names in (
            (self.drawings, view.topics or ()),
            (self.topic_values, view.topic_values),
        ):
            for name in [name for name in received if name not in names]:
                del received[name]


class Audience:
    """The clients that look at one world, each identified by a function that notifies it."""

    def __init__(self) -> None:
        """Creates an audience without clients."""
        self._views: dict[Callable[[], None], View] = {}
        self._present = asyncio.Event()
        self._details_due = self._frames_due = -math.inf

    def set_view(self, notify: Callable[[], None], view: View) -> None:
        """Adds a client, or changes its view.

        Args:
            notify: Notifies the client of a new message.
            view: What the client looks at.
        """
        self._views[notify] = view
        self._present.set()

    def remove(self, notify: Callable[[], None]) -> None:
        """Removes a client; has no effect if the client was not added."""
        self._views.pop(notify, None)
        if not self._views:
            self._present.clear()

    @property
    def empty(self) -> bool:
        """Whether there are no clients."""
        return not self._views

    async def wait(self) -> None:
        """Waits until there is a client."""
        await self._present.wait()

    def notify(self) -> None:
        """Notifies all clients of a new message."""
        for notify in self._views:
            notify()

    def demand(self, now: float, layers: bool) -> Demand:
        """Returns what to capture now; details and frames are due after their periods.

        Args:
            now: Wall time [s], always of the same clock.
            layers: Whether the layers have changed.
        """
        views = self._views.values()
        inspected = frozenset(view.inspect for view in views if view.inspect is not None)
        demand = Demand(
            scans=any(view.scans for view in views),
            layers=layers,
            frames=now >= self._frames_due and any(view.frames for view in views),
            inspected=inspected,
            details=now >= self._details_due and bool(inspected),
            series=frozenset(name for view in views for name in view.series),
            history=any(view.history for view in views),
        )
        if demand.frames:
            self._frames_due = now + FRAMES_PERIOD
        if demand.details:
            self._details_due = now + DETAILS_PERIOD
        return demand

    def topic_demand(self) -> TopicDemand | None:
        """Returns what clients look at of other programs, None if no client lists their topics."""
        views = [view for view in self._views.values() if view.topics is not None]
        if not views:
            return None
        return TopicDemand(
            drawn=frozenset(name for view in views for name in view.topics or ()),
            inspected=frozenset(name for view in views for name in view.topic_values),
        )
