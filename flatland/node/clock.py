"""The time of the node: simulated time on `/clock`, or wall time in the stamps of all messages."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, Final

from flatland.node.stamps import clock_time
from flatland.node.stamps import set_stamps as set_stamps
from flatland.node.stamps import stamp as stamp
from flatland.node.ticker import Ticker
from flatland.node.transport import Transport
from flatland.suggestions import listed
from flatland.timekeeper import NANOSECONDS

_LOG = logging.getLogger("flatland")

MAX_STAMP_AGE: Final = 0.1  # s
"""Maximum difference of wall time between the start of a step and the stamps of its messages."""
_MAX_STAMP_AGE_NS: Final = round(MAX_STAMP_AGE * NANOSECONDS)


def warn_of_other_clocks(topic: str, others: Sequence[str]) -> None:
    """Logs a warning about other publishers of the time.

    Args:
        topic: The topic of the time.
        others: Names of the other nodes.
    """
    _LOG.warning(
        "%s is also published by %s: the time of all nodes that use it jumps; end this node or the "
        "other one, leave %s out of a bag that is played, or set use_sim_time of one simulator to "
        "false",
        topic,
        listed(others),
        topic,
    )


class NodeClock:
    """Relates the simulated time to the ROS time; notified by the bridge."""

    @property
    def watches_steps(self) -> bool:
        """Whether the clock is to be notified of each step, not only of the last one of several."""
        return False

    @property
    def watches_time(self) -> bool:
        """Whether the time is published by another thread than the one that steps the world."""
        return False

    def step_started(self, time_ns: int) -> None:
        """A step starts at a simulated time [ns]."""

    def time_advanced(self, time_ns: int) -> None:
        """The simulated time [ns] advanced within a step."""

    def flush(self) -> None:
        """Publishes the current time if it has not been published yet; safe from any thread."""

    def close(self) -> None:
        """Ends all activity."""


class SimulatedClock(NodeClock):
    """Publishes the simulated time on `/clock` and sets the ROS time of the node.

    The topic exists before a world is loaded. New subscribers receive the current time at once, so
    that nodes which start while the world is loaded or paused have a valid time. The simulated time
    0 is published as `FIRST_TIME`.
    """

    def __init__(self, transport: Transport, rate: float = 0.0) -> None:
        """Advertises the clock asynchronously and sets the ROS time to the first one.

        Args:
            transport: Publishes the topic.
            rate: Maximum number of messages per second of wall time [Hz], up to 1000; 0 for one
                message per step.
        """
        self._transport = transport
        self._now_ns = 0
        self._sent_ns: int | None = None  # with a limited rate
        self._lock = threading.Lock()
        self._ticker = Ticker("flatland-clock", rate, self._run_now, self._tick) if rate else None
        self._topic = transport.clock_topic(
            lambda: clock_time(self._now_ns), self._run_now, self._connection_changed
        )
        transport.set_time(clock_time(self._now_ns))

    def keep_time(self) -> None:
        """Makes the ROS time continue when the world is reset next.

        From the reset on, all stamps are the simulated time plus the current ROS time.
        """
        offset = self._now_ns
        set_stamps(lambda time_ns: time_ns + offset)

    def close(self) -> None:
        """Ends the topic, and the thread of a limited clock; stamps are simulated times again."""
        set_stamps(None)
        if self._ticker is not None:
            self._ticker.close()
        self._topic.close()

    @property
    def watches_steps(self) -> bool:
        """Whether each step is published."""
        return self._ticker is None and self._topic.connected

    @property
    def watches_time(self) -> bool:
        """Whether the rate is limited, and there are subscribers."""
        return self._ticker is not None and self._topic.connected

    def time_advanced(self, time_ns: int) -> None:
        """Sets the ROS time, and publishes it unless the rate is limited."""
        self._now_ns = stamp(time_ns)
        self._transport.set_time(clock_time(self._now_ns))
        if self._ticker is None and self._topic.connected:
            self._topic.send()

    def flush(self) -> None:
        """Publishes the current time if its rate is limited and it has not been published yet."""
        if self._ticker is not None and self._topic.connected:
            self._run_now(lambda: self._tick(0.0))

    def _tick(self, _due: float) -> bool:
        """Publishes the time if it has changed; with a limited rate, also after the last step."""
        if self._now_ns != self._sent_ns:
            self._sent_ns = self._now_ns
            self._topic.send()
        return self._topic.connected

    def _connection_changed(self, _connected: bool) -> None:
        if self._ticker is not None:
            self._ticker.wake()

    def _run_now(self, action: Callable[[], object]) -> Future[Any]:
        """Runs an action of another thread at once, one at a time.

        The action does not wait for a step, since the time is read when a message is serialized.
        """
        done: Future[Any] = Future()
        with self._lock:
            try:
                done.set_result(action())
            except Exception as error:
                done.set_exception(error)
                _LOG.exception("cannot publish the time")
        return done


class WallClock(NodeClock):
    """Stamps all messages with wall time; there is no `/clock`.

    The stamp of a simulated time is the wall time at which the simulation reached it. If the step
    that starts from there starts more than `MAX_STAMP_AGE` later, after a pause or at a low rate,
    the stamp is the wall time of its start instead. Stamps are therefore equal for equal simulated
    times in one step, increase strictly with simulated time unless the wall time is set back, are
    never in the future, and are close to the current time. Their differences are differences
    of wall time, which are close to simulated time only if the simulation runs in real time.
    """

    def __init__(self, now: Callable[[], int] = time.time_ns) -> None:
        """Makes `stamp` return these stamps.

        Args:
            now: Returns the wall time since the epoch [ns].
        """
        self._now = now
        # (simulated time, its stamp) of the last two times [ns]; replaced as a whole, because
        # other threads read it.
        start = (0, now())
        self._anchors = start, start
        set_stamps(self.stamp)

    def close(self) -> None:
        """Makes `stamp` return simulated times again."""
        set_stamps(None)

    @property
    def watches_steps(self) -> bool:
        """Returns True: a stamp is the wall time of a step."""
        return True

    def step_started(self, time_ns: int) -> None:
        """Renews the stamp of the current simulated time if it is too old."""
        previous, (_, stamp) = self._anchors
        now = self._now()
        if abs(now - stamp) > _MAX_STAMP_AGE_NS:
            self._anchors = previous, (time_ns, now)

    def time_advanced(self, time_ns: int) -> None:
        """Defines the stamp of the new simulated time."""
        last = self._anchors[1]
        now, next_stamp = self._now(), last[1] + 1
        if 0 < next_stamp - now <= _MAX_STAMP_AGE_NS:
            now = next_stamp  # The resolution of the clock, or a small correction of it.
        self._anchors = last, (time_ns, now)

    def stamp(self, time_ns: int) -> int:
        """Returns the wall time [ns since the epoch] that corresponds to a simulated time [ns]."""
        (previous_ns, previous_stamp), (anchor_ns, anchor_stamp) = self._anchors
        if time_ns >= anchor_ns:
            return anchor_stamp + time_ns - anchor_ns
        return min(previous_stamp + time_ns - previous_ns, anchor_stamp)
