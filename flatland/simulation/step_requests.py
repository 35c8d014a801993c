"""Steps of a world that other threads request, carried out in order of arrival."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Final

from flatland.errors import WorldError
from flatland.runtime.stepping import Stepping
from flatland.timekeeper import Timekeeper

_MAX_BATCH_TIME: Final = 0.005  # s of wall time between two checks whether to go on


@dataclass(frozen=True, slots=True, eq=False)
class _Request:
    """A number of steps.

    Attributes:
        count: Number of steps.
        done: Holds the simulated time after the last step [ns].
    """

    count: int
    done: Future[int] = field(default_factory=Future)


class StepRequests:
    """A queue of requested steps.

    Requests of other kinds (`World.post`) are carried out between the steps. A request is withdrawn
    by cancelling its future, also while its steps are carried out.
    """

    def __init__(
        self, stepping: Stepping, timekeeper: Timekeeper, clock: Callable[[], float]
    ) -> None:
        """Creates an empty queue.

        Args:
            stepping: Performs the steps.
            timekeeper: The simulated time.
            clock: Returns the wall time [s].
        """
        self._stepping = stepping
        self._timekeeper = timekeeper
        self._clock = clock
        self._waiting: deque[_Request] = deque()
        # Number of steps between two checks, adapted to the wall time of a step.
        self._batch = 1

    def __bool__(self) -> bool:
        """Whether a request is pending."""
        return bool(self._waiting)

    def add(self, count: int) -> Future[int]:
        """Queues a request; safe from any thread.

        Returns:
            Holds the simulated time after the last step [ns].
        """
        request = _Request(count)
        self._waiting.append(request)
        return request.done

    def serve(self, stopped: Callable[[], bool]) -> None:
        """Carries out all requests; must be called in the thread that steps the world.

        A paused world is stepped as well, and stays paused.

        Args:
            stopped: Returns whether to stop; the rest of the requests then remains.

        Raises:
            Exception: Raised by a step; the request has failed.
        """
        while self._waiting and not stopped():
            self._advance(self._waiting.popleft(), stopped)

    def fail(self) -> None:
        """Fails all pending requests, because the simulation has stopped; thread-safe."""
        while True:
            try:
                request = self._waiting.popleft()
            except IndexError:
                return
            _fail(request.done, WorldError("the simulation has stopped"))

    def _advance(self, request: _Request, stopped: Callable[[], bool]) -> None:
        left = request.count
        try:
            while left and not stopped() and not request.done.cancelled():
                batch, start = min(left, self._batch), self._clock()
                self._stepping.step(batch, while_paused=True)
                left -= batch
                took = self._clock() - start
                if took > _MAX_BATCH_TIME:
                    self._batch = max(1, self._batch // 2)
                elif batch == self._batch and took < _MAX_BATCH_TIME / 4:
                    self._batch *= 2
        except BaseException as error:
            _fail(request.done, error)
            raise
        if left:
            done = request.count - left
            text = f"the simulation has stopped after {done} of {request.count} steps"
            _fail(request.done, WorldError(text))
        elif request.done.set_running_or_notify_cancel():
            request.done.set_result(self._timekeeper.sim_time_ns)


def _fail(done: Future[int], error: BaseException) -> None:
    if done.set_running_or_notify_cancel():
        done.set_exception(error)
