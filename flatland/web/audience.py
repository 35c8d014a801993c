"""The clients that look at one world, and what has to be captured for them."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Final

from flatland.web.capture import Demand
from flatland.web.client_view import View

DETAILS_PERIOD: Final = 0.2  # s of wall time between two messages `details`
FRAMES_PERIOD: Final = 0.1  # s of wall time between two messages `frames`


class Audience:
    """The clients that look at one world."""

    def __init__(self) -> None:
        """Creates an audience without clients."""
        self._views: dict[Callable[[], None], View] = {}
        self._present = asyncio.Event()
        self._details_due = self._frames_due = -math.inf

    def add(self, wake: Callable[[], None], view: View) -> None:
        """Adds a client, or changes what it looks at.

        Args:
            wake: Called when there is something new; identifies the client.
            view: What it looks at.
        """
        self._views[wake] = view
        self._present.set()

    def remove(self, wake: Callable[[], None]) -> None:
        """Removes a client, if it is there."""
        self._views.pop(wake, None)
        if not self._views:
            self._present.clear()

    @property
    def empty(self) -> bool:
        """Whether there are no clients."""
        return not self._views

    async def wait(self) -> None:
        """Waits until there is a client."""
        await self._present.wait()

    def wake(self) -> None:
        """Tells all clients that there is something new."""
        for wake in self._views:
            wake()

    def demand(self, now: float, layers: bool) -> Demand:
        """Returns what the clients look at, and what of it is due.

        Args:
            now: Wall time [s], on any clock that is always the same.
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
        )
        if demand.frames:
            self._frames_due = now + FRAMES_PERIOD
        if demand.details:
            self._details_due = now + DETAILS_PERIOD
        return demand
