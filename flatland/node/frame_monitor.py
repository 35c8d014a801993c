"""Warns of lasers whose scans cannot be transformed to the world."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from flatland.node.ticker import Ticker
from flatland.node.transport import Transport
from flatland.node.values import FrameParents
from flatland.plugin_api.ports import Output
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation
from flatland.values import LaserScan

_LOG = logging.getLogger("flatland")

GRACE_PERIOD: Final = 5.0  # s of wall time after the first subscriber
LISTENING_PERIOD: Final = 10.0  # s of wall time; afterwards a warning is logged
RATE: Final = 1.0  # Hz, wall time
_WORLD_FRAMES: Final = frozenset(("map", "odom", "world"))


class FrameMonitor(WorldObserver):
    """Checks once for each laser with a subscriber whether TF connects it to the world.

    A laser is connected if the chain of parents of its frame ends at a frame that is neither the
    frame of a body nor its own, such as `odom` or `map`. The transforms of the world are checked
    first, in each period. If the chain remains incomplete, the transforms of other nodes are
    received for some time before a warning is logged.
    """

    def __init__(
        self,
        transport: Transport,
        simulation: Simulation,
        subscribed: Callable[[Output[Any]], bool],
        *,
        grace_period: float = GRACE_PERIOD,
        listening_period: float = LISTENING_PERIOD,
        rate: float = RATE,
    ) -> None:
        """Starts the checks; must be called between two steps.

        Args:
            transport: Subscribes to transforms.
            simulation: Simulation of the world.
            subscribed: Returns whether an output has subscribers.
            grace_period: Time for the transforms of the world after a laser is subscribed to [s].
            listening_period: Time for the transforms of other nodes after that [s].
            rate: Rate of the checks in wall time [Hz].
        """
        self._transport = transport
        self._world = simulation.world
        self._subscribed = subscribed
        self._grace_period = grace_period
        self._listening_period = listening_period
        # By laser, the time from which it has had a subscriber and the world has run
        # (`time.monotonic`); None if it has not.
        self._checks: dict[Output[Any], float | None] = {}
        self._listener: _TransformListener | None = None
        self._ticker = Ticker("flatland-frames", rate, simulation.post, self._tick)
        for output in self._world.ports.outputs.values():
            self.output_opened(output)
        self._world.add_observer(self)

    def close(self) -> None:
        """Stops the checks."""
        self._ticker.close()

    def output_opened(self, output: Output[Any]) -> None:
        """Adds the check of a laser."""
        if issubclass(output.value_type, LaserScan):
            self._checks[output] = None
            self._ticker.wake()

    def output_closed(self, output: Output[Any]) -> None:
        """Removes the check of a laser."""
        self._checks.pop(output, None)

    def _tick(self, now: float) -> bool:
        """Checks all lasers; returns whether there are lasers left."""
        own_parents: dict[str, str] | None = None
        is_listening = False
        for output, start in list(self._checks.items()):
            scan = output.latest
            if scan is None or self._world.paused or not self._subscribed(output):
                self._checks[output] = None
                continue
            if start is None:
                start = self._checks[output] = now
            if own_parents is None:
                own_parents = {child: parent for parent, child in self._world.transforms}
            if self._is_connected(scan.frame_id, own_parents):
                del self._checks[output]
            elif now - start >= self._grace_period:
                if self._check_all_nodes(output, scan.frame_id, own_parents, now - start):
                    del self._checks[output]
                else:
                    is_listening = True
        if not is_listening and self._listener is not None:
            self._listener.close()
            self._listener = None
        return bool(self._checks)

    def _check_all_nodes(
        self, output: Output[Any], frame: str, own_parents: Mapping[str, str], elapsed: float
    ) -> bool:
        """Checks a laser with the transforms of all nodes; returns whether the check is over."""
        if self._listener is None:
            self._listener = _TransformListener(self._transport)
        parents = {**own_parents, **self._listener.parents}
        if self._is_connected(frame, parents):
            return True
        # Counted from the start of the listener, which another laser may have started later.
        listened = min(elapsed - self._grace_period, self._listener.age)
        if listened < self._listening_period:
            return False
        _LOG.warning("%s", _warning(output, frame, _end_of_chain(frame, parents)))
        return True

    def _is_connected(self, frame: str, parents: Mapping[str, str]) -> bool:
        end = _end_of_chain(frame, parents)
        if end in _WORLD_FRAMES:
            return True
        return end != frame and end not in {
            model.frame(body.name) for model in self._world.models for body in model.bodies
        }


class _TransformListener:
    """Receives the transforms of all nodes.

    Attributes:
        parents: The parent of each frame.
    """

    def __init__(self, transport: Transport) -> None:
        self.parents: dict[str, str] = {}
        self._start = time.monotonic()
        message_type, convert = transport.receivable(FrameParents)
        self._subscribers = [
            transport.subscribe(
                topic, message_type, lambda message: self.parents.update(convert(message))
            )
            for topic in ("/tf", "/tf_static")
        ]

    @property
    def age(self) -> float:
        """Wall time since the start [s]."""
        return time.monotonic() - self._start

    def close(self) -> None:
        """Unsubscribes."""
        for subscriber in self._subscribers:
            subscriber.close()


def _end_of_chain(frame: str, parents: Mapping[str, str]) -> str:
    """Returns the last frame of a chain of parents; in a cycle, the last one before it repeats."""
    seen = {frame}
    while (parent := parents.get(frame)) is not None and parent not in seen:
        seen.add(parent)
        frame = parent
    return frame


def _warning(output: Output[Any], frame: str, end: str) -> str:
    owner = " and ".join(output.owners)
    if end == frame:
        place = "nothing sends the transform of this frame"
        remedy = "set broadcast_tf of the laser to true, or send the transform by another node"
    else:
        place = f'the chain of parents ends at "{end}"'
        remedy = (
            "enable_odom_tf_pub of a drive or publish_tf_world of a ModelTfPublisher sends the "
            f'transform from the world to "{end}"; so does a localisation'
        )
    return (
        f'{owner}: no TF path leads from frame "{frame}" of the scans on {output.topic} to the '
        f"world ({place}). Subscribers such as RViz or a costmap cannot transform the scans. "
        f"Remedy: {remedy}"
    )
