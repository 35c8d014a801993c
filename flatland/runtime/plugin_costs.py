"""Measurement of the wall time of plugins."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

from flatland.plugin_api.plugin import FlatlandPlugin, describe

Hook = Callable[..., object]


class PluginCosts:
    """The wall time of all hooks since the start of a measurement, by plugin.

    The time of a hook includes its scans and the messages of the outputs to which it emits.
    `PluginHost.costs` is the current measurement.

    Attributes:
        running: The plugin whose hook runs, None between two hooks.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        """Creates a measurement.

        Args:
            clock: Returns the wall time [s].
        """
        self._clock = clock
        self._seconds: defaultdict[FlatlandPlugin, float] = defaultdict(float)
        self.running: FlatlandPlugin | None = None

    def timed(self, plugin: FlatlandPlugin, hook: Hook) -> Hook:
        """Returns a hook that calls the given one and adds its time to the costs of its plugin."""
        clock, seconds = self._clock, self._seconds

        def call(*arguments: Any) -> None:
            outer, self.running = self.running, plugin
            start = clock()
            try:
                hook(*arguments)
            finally:
                seconds[plugin] += clock() - start
                self.running = outer

        return call

    @property
    def seconds(self) -> dict[FlatlandPlugin, float]:
        """Wall time of each plugin whose hooks were called [s]."""
        return dict(self._seconds)

    def later(self, action: Hook) -> Hook:
        """Returns an action that counts as part of the hook that runs now, if one does."""
        return action if self.running is None else self.timed(self.running, action)

    def describe(self, elapsed: float, count: int = 3) -> str:
        """Returns the names and shares of the most expensive plugins in one line.

        If plugins share a type, the shares of the most expensive types follow, since a hundred
        lasers may be expensive while each of them is cheap.

        Args:
            elapsed: Wall time of the measurement [s], positive.
            count: Maximum number of plugins and of types.
        """
        percent = 100.0 / elapsed
        plugins = sorted(self._seconds.items(), key=lambda entry: -entry[1])
        if not plugins:
            return "no plugin ran"
        text = ", ".join(
            f"{describe(plugin)} {seconds * percent:.1f} %" for plugin, seconds in plugins[:count]
        )
        members: defaultdict[str, list[float]] = defaultdict(list)
        for plugin, seconds in plugins:
            members[plugin.type].append(seconds)
        if len(members) == len(plugins):
            return text
        types = sorted(members.items(), key=lambda entry: -sum(entry[1]))
        return f"{text}; by type: " + ", ".join(
            f"{len(times)} x {name} {sum(times) * percent:.1f} %" for name, times in types[:count]
        )
