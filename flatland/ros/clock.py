"""The time of the node: simulated time on `/clock`, or wall time in the stamps of all messages."""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from io import BytesIO
from typing import Any, Final, Protocol

import rospy
from rosgraph_msgs.msg import Clock
from rospy import rostime

from flatland.ros import stamps
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.ticker import Ticker
from flatland.timekeeper import NANOSECONDS

_LOG = logging.getLogger("flatland")

TOPIC: Final = "/clock"
MAX_STAMP_AGE: Final = 0.1  # s
"""Maximum difference of wall time between the start of a step and the stamps of its messages."""
_MAX_STAMP_AGE_NS: Final = round(MAX_STAMP_AGE * NANOSECONDS)


class NodeClock(Protocol):
    """Relates the simulated time to the ROS time; notified by the bridge."""

    @property
    def watches_steps(self) -> bool:
        """Whether the clock is to be notified of each step, not only of the last one of several."""

    @property
    def watches_time(self) -> bool:
        """Whether the time is published by another thread than that of the steps."""

    def step_started(self, time_ns: int) -> None:
        """A step starts at a simulated time [ns]."""

    def time_advanced(self, time_ns: int) -> None:
        """The simulated time [ns] advanced within a step."""

    def flush(self) -> None:
        """Publishes the current time if it has not been published yet; safe from any thread."""

    def close(self) -> None:
        """Ends all activity."""


class SimulatedClock:
    """Publishes the simulated time on `/clock` and sets the ROS time of the node.

    The topic exists, with the time 0, before a world is loaded. New subscribers receive the current
    time at once, so that nodes which start while the world is loaded or paused have a valid time.
    """

    def __init__(self, registrar: Registrar, rate: float = 0.0) -> None:
        """Advertises the clock asynchronously and sets the ROS time to 0.

        Args:
            registrar: Registers the topic with the ROS master.
            rate: Maximum number of messages per second of wall time [Hz], up to 1000; 0 for one
                message per step.
        """
        self._message = _CurrentTime()
        self._lock = threading.Lock()
        self._sent: rospy.Time | None = None  # with a limited rate
        self._ticker = Ticker("flatland-clock", rate, self._run_now, self._tick) if rate else None
        self._topic = StateTopic(
            registrar,
            TOPIC,
            Clock,
            lambda: self._message,
            self._run_now,
            on_connection=self._connection_changed,
        )
        self._set(rospy.Time(0))

    def close(self) -> None:
        """Ends the topic, and the thread of a limited clock."""
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

    def step_started(self, time_ns: int) -> None:
        """Has no effect."""

    def time_advanced(self, time_ns: int) -> None:
        """Sets the ROS time, and publishes it unless the rate is limited."""
        self._set(stamps.time(time_ns, rospy.Time))
        if self._ticker is None and self._topic.connected:
            self._topic.publish_current(self._message.packed)

    def flush(self) -> None:
        """Publishes the current time if its rate is limited and it has not been published yet."""
        if self._ticker is not None and self._topic.connected:
            self._run_now(lambda: self._tick(0.0))

    def _set(self, now: rospy.Time) -> None:
        self._message.clock = now
        _set_ros_time(now)

    def _tick(self, _due: float) -> bool:
        """Publishes the time if it has changed; with a limited rate, also after the last step."""
        if self._message.clock is not self._sent:
            self._sent = self._message.clock
            self._topic.publish_current(self._message.packed)
        return self._topic.connected

    def _connection_changed(self, _connected: bool) -> None:
        if self._ticker is not None:
            self._ticker.wake()

    def _run_now(self, action: Callable[[], object]) -> Future[Any]:
        """Runs an action of another thread at once, one at a time.

        It need not wait for a step, since a message is created when it is serialized.
        """
        done: Future[Any] = Future()
        with self._lock:
            try:
                done.set_result(action())
            except Exception as error:
                done.set_exception(error)
                _LOG.exception("cannot publish %s", TOPIC)
        return done


class _CurrentTime(Clock):  # type: ignore[misc]
    """The current time at the moment of serialization.

    All messages of a topic are serialized one after the other, so that no subscriber receives a
    time that is earlier than the previous one, whichever thread publishes it.
    """

    _TIME: Final = struct.Struct("<2I")

    def serialize(self, buffer: BytesIO) -> None:
        """Writes the message; called by rospy."""
        buffer.write(self.packed())

    def packed(self) -> bytes:
        """Returns the serialized message."""
        now = self.clock  # Read once, because another thread replaces it.
        return self._TIME.pack(now.secs, now.nsecs)


class WallClock:
    """Stamps all messages with wall time; there is no `/clock`.

    The stamp of a simulated time is the wall time at which the simulation reached it. If the step
    that starts from there starts more than `MAX_STAMP_AGE` later, after a pause or at a low rate,
    the stamp is the wall time of its start instead. Stamps are therefore equal for equal simulated
    times in one step, increase strictly with simulated time unless the wall time is set back, are
    never in the future, and are close to the current time. Their differences are those of wall
    time; they are close to those of simulated time only if the simulation runs in real time.
    """

    def __init__(self, now: Callable[[], int] = time.time_ns) -> None:
        """Makes `stamps` use these stamps.

        Args:
            now: Returns the wall time since the epoch [ns].
        """
        self._now = now
        # (simulated time, its stamp) of the last two times [ns]; replaced as a whole, because
        # other threads read it.
        start = (0, now())
        self._anchors = start, start
        stamps.set_stamps(self.stamp)

    def flush(self) -> None:
        """Has no effect."""

    def close(self) -> None:
        """Makes `stamps` use simulated time again."""
        stamps.set_stamps(None)

    @property
    def watches_steps(self) -> bool:
        """Returns True: a stamp is the wall time of a step."""
        return True

    @property
    def watches_time(self) -> bool:
        """Returns False: nothing is published."""
        return False

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


def _set_ros_time(time: rospy.Time) -> None:
    """Sets the value of `rospy.get_rostime` and wakes the threads that sleep in ROS time.

    Equivalent to the callback of rospy for `/clock`, but without its copy and its deprecation
    warning, which cost more than a physics step.
    """
    rostime._rostime_current = time
    changed = rostime.get_rostime_cond()
    with changed:
        changed.notify_all()
