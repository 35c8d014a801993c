"""The messages that a test receives on a topic, of ROS 1 or ROS 2."""

from __future__ import annotations

import contextlib
import queue
import time
from collections.abc import Callable
from typing import Any

import pytest
from waiting import TIMEOUT


class MessageQueue:
    """Messages in the order in which they were received."""

    def __init__(self, name: str) -> None:
        """Creates an empty queue.

        Args:
            name: Name of the topic, for failures.
        """
        self.name = name
        self.messages: queue.Queue[Any] = queue.Queue()

    def next(self, timeout: float = TIMEOUT) -> Any:
        """Waits for a message."""
        try:
            return self.messages.get(timeout=timeout)
        except queue.Empty:
            pytest.fail(f"no message on {self.name} for {timeout} s")

    def until(self, accept: Callable[[Any], bool]) -> Any:
        """Waits for a message that is accepted."""
        end = time.monotonic() + TIMEOUT
        message = self.next()
        while not accept(message):
            assert time.monotonic() < end, f"last on {self.name}:\n{message}"
            message = self.next()
        return message

    def take(self, count: int) -> list[Any]:
        """Waits for a number of messages."""
        return [self.next() for _ in range(count)]

    def drop(self) -> list[Any]:
        """Discards the messages received so far, and returns them."""
        messages = []
        with contextlib.suppress(queue.Empty):
            while True:
                messages.append(self.messages.get_nowait())
        return messages

    def rest(self, silence: float = 0.2) -> list[Any]:
        """Returns messages until none is received for some time."""
        messages = []
        with contextlib.suppress(queue.Empty):
            while True:
                messages.append(self.messages.get(timeout=silence))
        return messages

    @property
    def is_empty(self) -> bool:
        """Whether no message waits."""
        return self.messages.empty()
