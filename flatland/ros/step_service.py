"""The service `step_world`, which advances the time on request."""

from __future__ import annotations

import math
import threading
from typing import Any, Final

import rospy

from flatland.ros.adapters import convert
from flatland.ros.clock import NodeClock
from flatland.ros.message_types import service_class
from flatland.ros.service_calls import CallError, ServiceCalls
from flatland.ros.transport.drops import REPLACED, DropCounter
from flatland.ros.transport.outbox import open_outboxes
from flatland.ros.transport.service import Service

SERVICE: Final = "step_world"
MAX_DURATION: Final = 3600.0
"""Longest simulated time of one call [s]; a larger one is probably in another unit."""
_TOLERANCE: Final = 1e-3  # of a step, by which a duration may differ from a multiple of the step
_MAX_STAMP: Final = 2**32  # s; the time of ROS ends there


class StepService:
    """Advances the time by whole steps; several clients are served in order of arrival."""

    def __init__(self, calls: ServiceCalls, clock: NodeClock) -> None:
        """Advertises the service asynchronously.

        Args:
            calls: Carries out the calls.
            clock: Publishes the time.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._clock = clock
        self._timekeeper = calls.simulation.world.timekeeper
        self._drops = DropCounter()
        self._lock = threading.Lock()  # of the counter
        Service(calls.registrar, SERVICE, service_class("StepWorld"), self._serve)

    def _serve(self, request: Any) -> tuple[bool, str, Any]:
        try:
            done = self._calls.simulation.request_steps(self._count(request.duration))
            time_ns = self._calls.result(done)
        except CallError as error:
            return False, str(error), self._stamp(self._timekeeper.sim_time_ns)
        # With a limited rate, the time after the last step may not be published yet.
        self._clock.flush()
        for outbox in open_outboxes():
            outbox.disable_delay()
        return True, self._dropped(), self._stamp(time_ns)

    def _count(self, duration: float) -> int:
        """Returns a duration [s] as a number of steps.

        Raises:
            CallError: The duration is out of range, or not a multiple of the step size.
        """
        step_size = self._timekeeper.step_size
        if duration == 0:
            return 1
        if not 0 < duration < math.inf:
            raise CallError(f"duration must be finite and not negative [s], got {duration}")
        if duration > MAX_DURATION:
            raise CallError(f"duration must be at most {MAX_DURATION:g} s, got {duration}")
        if self._timekeeper.sim_time + duration >= _MAX_STAMP:
            raise CallError(f"the time after {duration} s would not fit a stamp of ROS")
        steps = duration / step_size
        count = round(steps)
        if count == 0 or abs(steps - count) > _TOLERANCE:
            raise CallError(
                f"duration must be a multiple of the step size, {step_size:g} s, got {duration}"
            )
        return count

    def _dropped(self) -> str:
        """Returns which messages were dropped since the previous call; empty for none."""
        with self._lock:
            dropped = self._drops.count()
        return ", ".join(
            f"{count} messages of {topic} to {subscriber} were dropped"
            for (topic, subscriber), count in sorted(dropped.items())
            if topic not in REPLACED
        )

    @staticmethod
    def _stamp(time_ns: int) -> Any:
        return convert.time(time_ns, rospy.Time)
