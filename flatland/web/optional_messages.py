"""Messages that are sent only on demand: details, frames, plotted numbers and the history."""

from __future__ import annotations

import math
from functools import partial

from flatland.errors import WorldError
from flatland.runtime.file_reads import read_in_time_async
from flatland.values import Transform
from flatland.web.capture import CapturedWorld
from flatland.web.encoding import text_message
from flatland.web.history import Timeline
from flatland.web.inspection import Details, details_message
from flatland.web.model_files import plugin_parameters
from flatland.web.model_tracker import Json
from flatland.web.numbers import number_at
from flatland.web.views import Received, View
from flatland.world import World


class OptionalMessages:
    """The latest details, frames, plotted numbers and history of one world."""

    def __init__(self, index: int, world: World) -> None:
        """Creates an object without messages.

        Args:
            index: Index of the world in messages.
            world: The world.
        """
        self._index = index
        self._world = world
        self._details: dict[int, tuple[int, str]] = {}  # number of the capture, and message
        self._frames: tuple[int, str] = (-1, "")
        self._values: dict[str, float] = {}
        self._values_tick = -1
        self._values_time = -math.inf
        self._timeline: Timeline | None = None
        self._history: tuple[int, str] = (-1, "")  # number of the capture, and message
        self._parameters: dict[int, tuple[str, Json]] = {}  # path of the model, and parameters

    async def read_parameters(self, details: list[Details]) -> None:
        """Reads the parameters of plugins from the files of models that were not inspected before.

        Must be called before `apply`. The files are read in a helper thread.

        Args:
            details: Details of the inspected models.
        """
        for each in details:
            known = self._parameters.get(each.model)
            if known is None or known[0] != each.path:
                read = partial(plugin_parameters, self._world, each.path)
                try:
                    parameters = await read_in_time_async(read)
                except WorldError:
                    parameters = {}
                self._parameters[each.model] = (each.path, parameters)

    def apply(self, captured: CapturedWorld, tick: int) -> None:
        """Replaces the messages by those of a capture.

        Args:
            captured: The captured world.
            tick: Number of the capture.
        """
        for details in captured.details:
            parameters = self._parameters[details.model][1]
            text = text_message(details_message(self._index, details, parameters))
            self._details[details.model] = (tick, text)
        if captured.frames is not None:
            self._frames = (tick, self._frames_message(captured.frames))
        values = {}
        for name, (value, path) in captured.series.items():
            number = number_at(value, path)
            if number is not None:
                values[name] = number
        if values != self._values or captured.time != self._values_time:
            self._values_tick = tick
        self._values, self._values_time = values, captured.time

    def set_timeline(self, timeline: Timeline, tick: int) -> None:
        """Replaces the message of the history if it has changed.

        Args:
            timeline: The history.
            tick: Number of the capture.
        """
        if timeline is self._timeline:
            return
        self._timeline = timeline
        self._history = (
            tick,
            text_message(
                {
                    "type": "history",
                    "world": self._index,
                    "moments": [
                        {"moment": number, "time": time, "label": label}
                        for number, time, label in timeline.moments
                    ],
                    "current": timeline.current,
                    "obstacle": timeline.obstacle,
                }
            ),
        )

    def clear(self) -> None:
        """Removes the details and the plotted numbers."""
        self._details.clear()
        self._parameters.clear()
        self._values.clear()

    def next_message(self, received: Received, view: View) -> str | None:
        """Returns the next message for a client, None if the client has received all.

        Args:
            received: What the client has received; updated.
            view: What the client looks at.
        """
        if view.inspect is not None and view.inspect in self._details:
            tick, text = self._details[view.inspect]
            if received.details != tick:
                received.details = tick
                return text
        if view.frames and received.frames < self._frames[0]:
            received.frames, text = self._frames
            return text
        if view.history and received.history < self._history[0]:
            received.history, text = self._history
            return text
        if view.series and received.values < self._values_tick:
            received.values = self._values_tick
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

    def _frames_message(self, frames: list[Transform]) -> str:
        return text_message(
            {
                "type": "frames",
                "world": self._index,
                "frames": [
                    {"parent": f.parent, "child": f.child, "pose": [f.x, f.y, f.yaw]}
                    for f in frames
                ],
            }
        )
