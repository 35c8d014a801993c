"""Publishes the performance of the node on `/diagnostics`, once per second of wall time.

The messages are created here, because `diagnostic_updater` does not fit a simulator: its period is
measured in ROS time, so that it publishes nothing while the simulated time stands still; it reads a
parameter from the ROS master, which can block; and it works without subscribers as well.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from flatland.node.ticker import Ticker
from flatland.node.transport import REPLACED, Transport
from flatland.node.values import Diagnostics, Level, Status
from flatland.plugin_api.plugin import describe
from flatland.runtime.plugin_costs import PluginCosts
from flatland.simulation import Simulation
from flatland.suggestions import listed
from flatland.timekeeper import NANOSECONDS
from flatland.world import World

TOPIC: Final = "/diagnostics"
MEASURED_TIME: Final = 0.2
"""Wall time per message in which the costs of plugins are measured [s]."""

_TICKS_PER_MESSAGE: Final = 5
_NEGLIGIBLE: Final = 0.01  # share of the wall time that may be lost without a warning
_MAX_ENTRIES: Final = 20  # plugins and types that are listed


class DiagnosticsTopic:
    """Publishes the rate, the costs of plugins, and the subscribers that do not keep up.

    Nothing is measured or computed without a subscriber.
    """

    def __init__(self, transport: Transport, simulation: Simulation) -> None:
        """Advertises the topic asynchronously; must be called between two steps.

        Args:
            transport: Publishes the topic.
            simulation: The simulation.
        """
        self._node = transport.node_name.lstrip("/")
        self._rate = _Rate(simulation)
        self._costs = _Costs(simulation.world)
        self._drops = _Drops(transport)
        self._ticks = 0
        rate = 1.0 / MEASURED_TIME
        self._ticker = Ticker("flatland-diagnostics", rate, simulation.post, self._tick)
        self._publisher, self._convert = transport.values(
            TOPIC, Diagnostics, on_connection=lambda _connected: self._ticker.wake()
        )

    def close(self) -> None:
        """Stops publishing; must be called in the thread that steps the world."""
        self._ticker.close()
        self._costs.reset()

    def _tick(self, _due: float) -> bool:
        """Publishes, then starts a measurement of costs, which the next tick ends."""
        if not self._publisher.connected:
            self._ticks = 0
            self._costs.reset()
            return False
        now = time.perf_counter()
        phase = self._ticks % _TICKS_PER_MESSAGE
        if phase == 1:
            self._costs.end(now)
        elif phase == 0:
            # The first tick only starts the evaluation.
            statuses = [self._rate.status(now), self._costs.status(), self._drops.status()]
            if self._ticks:
                self._publish(statuses)
            self._costs.begin(now)
        self._ticks += 1
        return True

    def _publish(self, statuses: list[Status]) -> None:
        named = (replace(status, name=f"{self._node}: {status.name}") for status in statuses)
        self._publisher.publish(self._convert(Diagnostics(named)))


class _Rate:
    """Whether the simulation holds its rate."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._start = 0.0
        self._start_ns = 0
        self._lost = 0.0

    def status(self, now: float) -> Status:
        """Returns the status since the previous call."""
        simulation = self._simulation
        timekeeper = simulation.world.timekeeper
        elapsed = max(now - self._start, 1e-9)
        advanced_ns = timekeeper.sim_time_ns - self._start_ns
        if advanced_ns < 0:
            advanced_ns = timekeeper.sim_time_ns  # The world was reset.
        lost = simulation.lost_time - self._lost
        self._start, self._start_ns = now, timekeeper.sim_time_ns
        self._lost = simulation.lost_time

        steps = advanced_ns / timekeeper.step_size_ns / elapsed
        rate = simulation.rate
        level, text = Level.OK, f"{steps:.1f} steps per second"
        if simulation.lockstep:
            text = f"lockstep: {text}"
        elif simulation.world.paused:
            text = "paused"
        elif lost > _NEGLIGIBLE * elapsed:
            level = Level.WARN
            text = f"the update rate of {rate:g} Hz cannot be held: {text}"
        values = {
            "steps per second": f"{steps:.1f}",
            "update rate [Hz]": "on request" if simulation.lockstep else f"{rate:g}",
            "real-time factor": f"{advanced_ns / NANOSECONDS / elapsed:.3f}",
            "lost time [s]": f"{lost:.3f}",
            "simulated time [s]": f"{timekeeper.sim_time:.3f}",
            "paused": str(simulation.world.paused),
            "models": str(len(simulation.world.models)),
        }
        if not simulation.lockstep:
            values["target real-time factor"] = f"{rate * timekeeper.step_size:g}"
        statistics = simulation.statistics
        if statistics is not None and math.isfinite(rate):
            values["mean use of a cycle [%]"] = f"{statistics.use_mean:.1f}"
            values["maximum use of a cycle [%]"] = f"{statistics.use_max:.1f}"
        return Status("simulation", level, text, values)


class _Costs:
    """The shares of plugins in the wall time.

    A measurement makes a step of cheap plugins 10 to 30 % slower, so that only a part of the time
    is measured. The last ten measurements count, because a plugin may work only once per second.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._current: PluginCosts | None = None
        self._start = 0.0
        # Wall time of each measurement [s], and of each plugin by (type, description).
        self._measured: deque[tuple[float, dict[tuple[str, str], float]]] = deque(maxlen=10)

    def begin(self, now: float) -> None:
        """Starts a measurement, unless another one is in progress or the world is paused."""
        host = self._world.plugin_host
        if host.costs is None and not self._world.paused:
            self._current, self._start = PluginCosts(), now
            host.costs = self._current

    def end(self, now: float) -> None:
        """Ends the measurement; discards it if another one has replaced it."""
        costs, self._current = self._current, None
        host = self._world.plugin_host
        if costs is None or host.costs is not costs:
            return
        host.costs = None
        if not self._world.paused:
            seconds = costs.seconds.items()
            shares = {(plugin.type, describe(plugin)): cost for plugin, cost in seconds}
            self._measured.append((now - self._start, shares))

    def reset(self) -> None:
        """Ends all measurements and discards their results."""
        self.end(0.0)
        self._measured.clear()

    def status(self) -> Status:
        """Returns the status of the last measurements."""
        disabled = sorted(describe(plugin) for plugin in self._world.plugin_host.disabled)
        elapsed = sum(seconds for seconds, _ in self._measured)
        plugins: defaultdict[str, float] = defaultdict(float)
        types: defaultdict[str, float] = defaultdict(float)
        for _, costs in self._measured:
            for (type_name, name), cost in costs.items():
                plugins[f"{name} [%]"] += 100.0 * cost / elapsed
                types[f"all of type {type_name} [%]"] += 100.0 * cost / elapsed
        values = {**_largest(plugins), **_largest(types)}
        if disabled:
            values["disabled"] = ", ".join(disabled)
            text = f"{len(disabled)} disabled after errors: {listed(disabled)}"
            return Status("plugins", Level.ERROR, text, values)
        text = f"{sum(plugins.values()):.1f} % of the wall time" if elapsed else "no data"
        return Status("plugins", Level.OK, text, values)


class _Drops:
    """The subscribers for which messages were dropped."""

    def __init__(self, transport: Transport) -> None:
        self._count = transport.dropped()

    def status(self) -> Status:
        """Returns the status since the previous call."""
        dropped = self._count()
        values = {
            f"{topic} to {subscriber}": f"{count} messages dropped"
            for (topic, subscriber), count in sorted(dropped.items())
        }
        slow = [f"{topic} to {node}" for topic, node in sorted(dropped) if topic not in REPLACED]
        if slow:
            text = f"subscribers do not keep up: {listed(slow)}"
            return Status("subscribers", Level.WARN, text, values)
        return Status("subscribers", Level.OK, "all keep up", values)


def _largest(shares: Mapping[str, float]) -> dict[str, str]:
    """Returns the largest shares as texts, the largest first."""
    entries = sorted(shares.items(), key=lambda entry: -entry[1])
    return {name: f"{share:.2f}" for name, share in entries[:_MAX_ENTRIES]}
