"""Tells whether the world is paused, on `~paused`."""

from __future__ import annotations

from typing import Final

from std_msgs.msg import Bool

from flatland.ros.registrar import Registrar
from flatland.ros.ticker import Ticker
from flatland.ros.transport.state_topic import LatchedTopic
from flatland.simulation import Simulation

TOPIC: Final = "~paused"
RATE: Final = 20.0  # Hz of wall time


class PauseTopic:
    """Looks at the world while anybody wants to know, and says so when the pause has changed.

    Services, drags and plugins pause a world, and none of them needs to know of this.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation) -> None:
        """Advertises the topic; between two steps.

        Args:
            registrar: Talks to the ROS master.
            simulation: Whose world to look at.
        """
        self._world = simulation.world
        self._sent: bool | None = None  # what all subscribers know, None if they differ
        self._ticker = Ticker("flatland-paused", RATE, simulation.post, self._tick)
        self._topic = LatchedTopic(
            registrar,
            TOPIC,
            Bool,
            self._message,
            simulation.post,
            on_connection=lambda _connected: self._ticker.wake(),
        )

    def close(self) -> None:
        """Looks no more."""
        self._ticker.close()

    def _message(self) -> Bool:
        if self._world.paused != self._sent:
            # For a newcomer alone, before the others hear of it.
            self._sent = None
        return Bool(self._world.paused)

    def _tick(self, _now: float) -> bool:
        if self._world.paused != self._sent:
            self._topic.send()
            self._sent = self._world.paused
        return self._topic.connected
