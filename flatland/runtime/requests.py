"""Requests: changes of a world that other threads, or hooks during a step, request."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Any, Final, TypeVar

from flatland.errors import WorldError

_LOG = logging.getLogger("flatland")
_LOCK_POLL_PERIOD: Final = 0.005  # s between two attempts of a waiting thread to get the lock

R = TypeVar("R")


class Requests:
    """A queue of actions that run between two steps, in order of arrival.

    Which thread runs them:

    * While a thread serves the queue (`serving`, as `Simulation.run` does), that thread alone.
    * Otherwise the thread that steps the world next, or the thread that made the request and waits
      for it, whichever is first.

    Attributes:
        lock: Held during each step and each batch of actions.
        actions: The actions that wait.
        hook_thread: Identifier of the thread that runs hooks of plugins, None if none does.
        on_post: Called from any thread after an action was queued.
        blocked_by: Code of a plugin that keeps actions from running, as found by a watchdog; empty
            if there is none.
    """

    def __init__(self) -> None:
        """Creates an empty queue."""
        self.lock = threading.RLock()
        self.actions: deque[Callable[[], None]] = deque()
        self._server: int | None = None
        self._wake: Callable[[], None] | None = None
        self.on_post: Callable[[], None] | None = None
        self.hook_thread: int | None = None
        self.blocked_by = ""
        # Identifiers of the threads that run other code of plugins, and that run actions.
        self._plugin_thread: int | None = None
        self._action_thread: int | None = None

    # -- threads ---------------------------------------------------------------------------

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
            self._server, self._wake = threading.get_ident(), wake
        try:
            yield
        finally:
            self._server = self._wake = None

    @contextmanager
    def hooks(self) -> Iterator[None]:
        """Marks the current thread as running hooks of plugins, for the duration of the block."""
        previous, self.hook_thread = self.hook_thread, threading.get_ident()
        try:
            yield
        finally:
            self.hook_thread = previous

    @contextmanager
    def plugin_code(self) -> Iterator[None]:
        """Marks the current thread as running code of a plugin between two steps.

        This is `on_initialize` or a callback; changes take effect immediately.
        """
        previous = self._plugin_thread
        self._plugin_thread = threading.get_ident()
        try:
            yield
        finally:
            self._plugin_thread = previous

    @property
    def in_hook(self) -> bool:
        """Whether the current thread runs a hook of a plugin."""
        return self.hook_thread == threading.get_ident()

    def refuse_in_plugin(self, method: str) -> None:
        """Raises if the current thread executes code of a plugin.

        Args:
            method: What may not be called there.

        Raises:
            WorldError: The current thread executes code of a plugin.
        """
        thread = threading.get_ident()
        if thread in (self.hook_thread, self._plugin_thread):
            raise WorldError(f"{method} must not be called from a plugin's hook")

    # -- actions ---------------------------------------------------------------------------

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action; safe from any thread.

        Returns:
            Holds what the action returned or raised, once it has run.
        """
        future: Future[R] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(action())
            except BaseException as error:
                future.set_exception(error)

        self.actions.append(run)
        if self.on_post is not None:
            self.on_post()
        wake = self._wake
        if wake is not None:
            wake()
        return future

    @property
    def served(self) -> bool:
        """Whether a thread serves the queue at the moment."""
        return self._server is not None

    def process_if_idle(self) -> bool:
        """Runs the actions that are waiting, unless another thread serves the queue or steps.

        Returns:
            Whether they were run.
        """
        if self._server not in (None, threading.get_ident()):
            return False
        if not self.lock.acquire(blocking=False):
            return False
        try:
            self.process()
        finally:
            self.lock.release()
        return True

    def process(self) -> None:
        """Runs the actions that are waiting; not those that they queue in turn."""
        with self.lock:
            previous, self._action_thread = self._action_thread, threading.get_ident()
            try:
                for _ in range(len(self.actions)):
                    # An action may process the queue itself, so it can be empty earlier.
                    if self.actions:
                        self.actions.popleft()()
            finally:
                self._action_thread = previous

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

    def read(self, action: Callable[[], R]) -> R:
        """Runs a function that reads the world, while no other thread steps it."""
        return action() if self.in_hook else self.run(action)

    def run(self, action: Callable[[], R]) -> R:
        """Runs an action between two steps and waits for it, after those that wait already.

        Within an action or code of a plugin between two steps, it runs at once.
        """
        if threading.get_ident() in (self._action_thread, self._plugin_thread):
            return action()
        future = self.post(action)
        while not future.done():
            if self._server not in (None, threading.get_ident()):
                _wait(future)
            elif self.lock.acquire(timeout=_LOCK_POLL_PERIOD):
                try:
                    self.process()
                finally:
                    self.lock.release()
        return future.result()


def _wait(future: Future[Any]) -> None:
    """Waits for a future, for a limited time: the thread that serves the queue may end."""
    with suppress(TimeoutError):
        future.exception(timeout=_LOCK_POLL_PERIOD)


def _log_failure(what: str, done: Future[Any]) -> None:
    error = done.exception()
    if error is not None:
        _LOG.error("%s: %s", what, error)
