"""Requests: changes of a world that other threads, or hooks during a step, request."""

from __future__ import annotations

import enum
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from typing import Any, TypeVar

from flatland.errors import WorldError

_LOG = logging.getLogger("flatland")

Post = Callable[[Callable[[], object]], Future[Any]]
"""Runs an action between two steps, as `Requests.post` does; safe from any thread."""

R = TypeVar("R")

_RLock: Any = type(threading.RLock())


class Role(enum.Enum):
    """What a thread does with a world."""

    ACTION = "action"
    """Runs an action between two steps."""
    PLUGIN = "plugin"
    """Runs code of a plugin between two steps: `on_initialize` or a callback."""
    HOOK = "hook"
    """Steps the world, or runs a hook of a plugin."""


class Requests:
    """A queue of actions that run between two steps, in order of arrival.

    Which thread runs them:

    * While a thread serves the queue (`serving`, as `Simulation.run` does), that thread alone.
    * Otherwise the thread that steps the world next, or the thread that made the request and waits
      for it, whichever is first.

    Attributes:
        lock: Held during each step and each batch of actions.
        actions: The actions that wait.
        blocked_by: Code of a plugin that keeps actions from running, as found by a watchdog; empty
            if there is none.
    """

    def __init__(self, on_post: Callable[[], None] | None = None) -> None:
        """Creates an empty queue.

        Args:
            on_post: Called from any thread after an action was queued; None for no function.
        """
        # Threads that wait for their actions. They are notified when actions have run, when the
        # lock is released, and when no thread serves the queue any longer.
        self._waiting = _Waiting()
        self.lock = StepLock(self._waiting)
        self.actions: deque[Callable[[], None]] = deque()
        self.blocked_by = ""
        self._on_post = on_post
        # The thread that serves the queue, and the function that wakes it.
        self._server: tuple[int, Callable[[], None]] | None = None
        # The thread that uses the world at the moment and its role, the innermost use last.
        self._uses: list[tuple[int, Role]] = []
        self._as_action = _Use(self._uses, Role.ACTION)
        self._as_plugin = _Use(self._uses, Role.PLUGIN)
        self._as_hook = _Use(self._uses, Role.HOOK)

    # -- threads ---------------------------------------------------------------------------

    def share_lock(self, other: Requests) -> None:
        """Uses the lock of another world, so that one thread at a time uses both worlds.

        To be called while no thread uses this world.
        """
        self._waiting, self.lock = other._waiting, other.lock

    @contextmanager
    def serving(self, wake: Callable[[], None]) -> Iterator[None]:
        """Makes the current thread the only one that runs actions, for the duration of the block.

        Args:
            wake: Called from any thread when an action arrives.

        Raises:
            WorldError: Another thread serves the queue.
        """
        with self.lock:
            if self._server is not None:
                raise WorldError("the world is already run by another simulation")
            self._server = threading.get_ident(), wake
        try:
            yield
        finally:
            self._server = None
            self._waiting.notify()

    @property
    def served(self) -> bool:
        """Whether a thread serves the queue at the moment."""
        return self._server is not None

    @property
    def in_use(self) -> bool:
        """Whether a thread runs actions, hooks or other code of plugins at the moment."""
        return bool(self._uses)

    def hooks(self) -> AbstractContextManager[None]:
        """Marks the current thread as running hooks of plugins, for the duration of the block."""
        return self._as_hook

    def plugin_code(self) -> AbstractContextManager[None]:
        """Marks the current thread as running code of a plugin between two steps.

        This is `on_initialize` or a callback; changes take effect immediately.
        """
        return self._as_plugin

    @property
    def _role(self) -> Role | None:
        """What the current thread does with the world; None if it does not use it."""
        if not self._uses:
            return None
        thread, role = self._uses[-1]
        return role if thread == threading.get_ident() else None

    @property
    def in_hook(self) -> bool:
        """Whether the current thread runs a hook of a plugin."""
        return self._role is Role.HOOK

    @property
    def in_plugin(self) -> bool:
        """Whether the current thread executes code of a plugin."""
        return self._role in (Role.HOOK, Role.PLUGIN)

    def refuse_in_plugin(self, method: str) -> None:
        """Raises if the current thread executes code of a plugin.

        Args:
            method: What may not be called there.

        Raises:
            WorldError: The current thread executes code of a plugin.
        """
        if self._uses and self.in_plugin:
            raise WorldError(f"{method} must not be called from a plugin's hook")

    # -- actions ---------------------------------------------------------------------------

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action; safe from any thread.

        Returns:
            Holds what the action returned or raised, once it has run. KeyboardInterrupt and
            SystemExit are also raised by the step, or the call, that runs the action.
        """
        future: Future[R] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(action())
            except Exception as error:
                future.set_exception(error)
            except BaseException as error:
                future.set_exception(error)
                raise

        self.actions.append(run)
        if self._on_post is not None:
            self._on_post()
        server = self._server
        if server is not None:
            server[1]()
        return future

    def process_if_idle(self) -> bool:
        """Runs the actions that are waiting, unless another thread serves the queue or steps.

        Returns:
            Whether they were run.
        """
        if not self._acquire():
            return False
        try:
            self.process()
        finally:
            self.lock.release()
        return True

    def _acquire(self) -> bool:
        """Acquires the lock if this thread may run actions now; returns whether it did."""
        server = self._server
        is_free = server is None or server[0] == threading.get_ident()
        return is_free and self.lock.acquire(blocking=False)

    def process(self) -> None:
        """Runs the actions in the queue, except actions that are queued meanwhile.

        Raises:
            BaseException: A KeyboardInterrupt or SystemExit of an action; later actions wait for
                the next call.
        """
        with self.lock, self._as_action:
            for _ in range(len(self.actions)):
                # An action may process the queue itself, so it can be empty earlier.
                if self.actions:
                    self.actions.popleft()()

    def change(self, action: Callable[[], R], what: str) -> R | None:
        """Runs a change of the world: now, or after the step if a hook requests it.

        Args:
            action: The change.
            what: Description for the log, in case a deferred change fails.

        Returns:
            What the action returned; None if it is deferred.
        """
        if self.in_hook:
            self.post(action).add_done_callback(lambda done: _log_failure(what, done))
            return None
        return self.run(action)

    def run(self, action: Callable[[], R]) -> R:
        """Runs an action between two steps, after all queued ones, and waits for its end.

        An action that is run by another action, a hook or other code of a plugin runs at once.
        """
        if self._role is not None:
            return action()
        if self._acquire():
            try:
                if not self.actions:
                    return self._run_now(action)
            finally:
                self.lock.release()
        future = self.post(action)
        while not future.done():
            if not self.process_if_idle():
                self._waiting.wait(lambda: future.done() or self._is_idle())
        return future.result()

    def _run_now(self, action: Callable[[], R]) -> R:
        """Runs an action like one in the queue, without the cost of the queue."""
        if self._on_post is not None:
            self._on_post()
        with self._as_action:
            return action()

    def _is_idle(self) -> bool:
        """Returns whether `process_if_idle` would run actions."""
        is_idle = self._acquire()
        if is_idle:
            self.lock.release()
        return is_idle


class _Waiting:
    """Threads that wait for a change of the requests of a world."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self.count = 0  # of the threads that wait

    def wait(self, is_over: Callable[[], bool]) -> None:
        """Waits for a notification, unless a condition holds already."""
        with self._condition:
            # Counted before the condition is tested: a change after the test is notified.
            self.count += 1
            try:
                if not is_over():
                    self._condition.wait()
            finally:
                self.count -= 1

    def notify(self) -> None:
        """Wakes all threads that wait."""
        if self.count:
            with self._condition:
                self._condition.notify_all()


class StepLock(_RLock):  # type: ignore[misc]
    """A reentrant lock; its release notifies the threads that wait to run their requests."""

    def __init__(self, waiting: _Waiting) -> None:
        """Creates a free lock."""
        self._waiting = waiting

    @property
    def is_owned(self) -> bool:
        """Whether the current thread holds the lock."""
        return bool(_RLock._is_owned(self))

    def release(self) -> None:
        """Releases the lock once."""
        _RLock.release(self)  # Each step releases the lock; `super` takes longer.
        if self._waiting.count:
            self._waiting.notify()

    def __exit__(self, *_: object) -> None:
        self.release()


class _Use:
    """A block in which the current thread uses the world in a role; blocks can be nested."""

    __slots__ = ("_role", "_uses")

    def __init__(self, uses: list[tuple[int, Role]], role: Role) -> None:
        self._uses = uses
        self._role = role

    def __enter__(self) -> None:
        self._uses.append((threading.get_ident(), self._role))

    def __exit__(self, *_: object) -> None:
        self._uses.pop()


def _log_failure(what: str, done: Future[R]) -> None:
    error = done.exception()
    if error is not None:
        _LOG.error("%s: %s", what, error)
