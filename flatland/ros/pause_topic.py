"""Publishes on `~paused` whether the world is paused."""

from __future__ import annotations

from typing import Final

from std_msgs.msg import Bool

from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.ticker import Ticker
from flatland.simulation import Simulation

TOPIC: Final = "~paused"
RATE: Final = 20.0  # Hz, wall time


class PauseTopic:
    """Publishes the pause state of a world when it changes.

    The state is polled while the topic has subscribers, because services, drags and plugins pause
    a world independently of each other.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation) -> None:
        """Advertises the topic asynchronously; must be called between two steps.

        Args:
            registrar: Registers the topic with the ROS master.
            simulation: Simulation of the world.
        """
        self._world = simulation.world
        self._sent: bool | None = None  # last state sent to all subscribers; None if they differ
        self._ticker = Ticker("flatland-paused", RATE, simulation.post, self._tick)
        self._topic = StateTopic(
            registrar,
            TOPIC,
            Bool,
            self._message,
            simulation.post,
            on_connection=lambda _connected: self._ticker.wake(),
        )

    def close(self) -> None:
        """Stops polling."""
        self._ticker.close()

    def _message(self) -> Bool:
        if self._world.paused != self._sent:
            # Only new subscribers receive this message; the others still have the old state.
            self._sent = None
        return Bool(self._world.paused)

    def _tick(self, _now: float) -> bool:
        if self._world.paused != self._sent:
            self._topic.send()
            self._sent = self._world.paused
        return self._topic.connected
