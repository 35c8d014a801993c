"""What only some clients look at: details of inspected models, frames and plotted numbers."""

from __future__ import annotations

import asyncio
import math
from typing import Any

from flatland.values import Transform
from flatland.web.capture import Captured
from flatland.web.client_view import Seen, View
from flatland.web.encoding import text_message
from flatland.web.inspection import Details, details_message
from flatland.web.model_files import plugin_parameters
from flatland.web.numbers import number_at
from flatland.web.scene import Description
from flatland.world import World


class Extras:
    """The latest details, frames and plotted numbers of one world."""

    def __init__(self, index: int, world: World) -> None:
        """Creates a state without contents.

        Args:
            index: Index of the world in messages.
            world: The world.
        """
        self._index = index
        self._world = world
        self._details: dict[int, tuple[int, str]] = {}
        self._frames: tuple[int, str] = (-1, "")
        self._values: dict[str, float] = {}
        self._values_tick = -1
        self._values_time = -math.inf
        self._parameters: dict[int, tuple[str, Description]] = {}

    async def read_parameters(self, details: list[Details]) -> None:
        """Reads the parameters of the plugins of models that were not inspected before.

        To be called before `apply`; the files are read in a helper thread.

        Args:
            details: Details of the inspected models.
        """
        for each in details:
            known = self._parameters.get(each.model)
            if known is None or known[0] != each.path:
                parameters = await asyncio.to_thread(plugin_parameters, self._world, each.path)
                self._parameters[each.model] = (each.path, parameters)

    def apply(self, captured: Captured, tick: int) -> None:
        """Takes over a captured state.

        Args:
            captured: The state.
            tick: Number of the capture.
        """
        for details in captured.details:
            parameters = self._parameters[details.model][1]
            text = text_message(details_message(self._index, details, parameters))
            self._details[details.model] = (tick, text)
        if captured.frames is not None:
            self._frames = (tick, text_message(self._frames_message(captured.frames)))
        values = {}
        for name, (value, path) in captured.series.items():
            number = number_at(value, path)
            if number is not None:
                values[name] = number
        if values != self._values or captured.time != self._values_time:
            self._values_tick = tick
        self._values, self._values_time = values, captured.time

    def clear(self) -> None:
        """Forgets the details and the numbers, because nobody looks."""
        self._details.clear()
        self._parameters.clear()
        self._values.clear()

    def next_message(self, seen: Seen, view: View) -> str | None:
        """Returns the next message for a client, None if it has received everything.

        Args:
            seen: What the client has received; updated.
            view: What it looks at.
        """
        if view.inspect is not None and view.inspect in self._details:
            tick, text = self._details[view.inspect]
            if seen.details != tick:
                seen.details = tick
                return text
        if view.frames and seen.frames < self._frames[0]:
            seen.frames, text = self._frames
            return text
        if view.series and seen.values < self._values_tick:
            seen.values = self._values_tick
            series = {name: self._values[name] for name in view.series if name in self._values}
            if series:
                return text_message(
                    {
                        "type": "values",
                        "world": self._index,
                        "time": self._values_time,
                        "series": series,
                    }
                )
        return None

    def _frames_message(self, frames: list[Transform]) -> dict[str, Any]:
        return {
            "type": "frames",
            "world": self._index,
            "frames": [
                {"parent": f.parent, "child": f.child, "pose": [f.x, f.y, f.yaw]} for f in frames
            ],
        }
