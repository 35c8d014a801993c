"""Changes of a world that programs, services and plugins request."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Protocol, TypeVar

from flatland.runtime.requests import Requests

R = TypeVar("R")


class ChangeLog(Protocol):
    """Receives all changes that are requested from outside; implemented by a recorder."""

    def change(self, kind: str, arguments: Mapping[str, object]) -> AbstractContextManager[None]:
        """Returns a context in which a change is carried out.

        Args:
            kind: Name of the method of `World`.
            arguments: Its arguments by name.
        """

    def repeated(self) -> AbstractContextManager[None]:
        """Returns a context in which a change of a hook is carried out, which repeats it."""

    def step_done(self) -> None:
        """Called after each step with all of its hooks."""

    def world_closing(self) -> None:
        """Called before the world is closed."""


class Changes:
    """Carries out the changes of one world between two steps, counts and logs them.

    Attributes:
        count: Number of changes since the world file was loaded, including failed changes.
        log: Notified of each change; None if there is no log.
    """

    def __init__(self, requests: Requests, check_open: Callable[[], None]) -> None:
        """Creates the changes of a world.

        Args:
            requests: Runs actions between two steps.
            check_open: Raises if the world is closed.
        """
        self.count = 0
        self.log: ChangeLog | None = None
        self._requests = requests
        self._check_open = check_open

    def __getstate__(self) -> int:
        """Returns the part of the state of the world that a snapshot saves."""
        return self.count

    def __setstate__(self, count: int) -> None:
        """Restores a saved state."""
        self.count = count

    def make(self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]) -> R | None:
        """Carries out a change: now, or after the step if a hook requests it.

        Args:
            kind: Name of the method of `World`, for a recording and messages.
            arguments: Arguments of the method.
            action: The change.

        Returns:
            What the action returned; None if a hook requests the change.

        Raises:
            WorldError: The world is closed.
        """
        is_external = not self._requests.in_hook

        def change() -> R:
            self._check_open()
            self.count += 1
            # A hook repeats its changes in a replay.
            return self._logged(kind, arguments if is_external else None, action)

        name = arguments.get("name")
        return self._requests.change(change, kind if name is None else f'{kind} "{name}"')

    def read(self, action: Callable[[], R]) -> R:
        """Returns the result of a function that reads the world between two steps.

        Raises:
            WorldError: The world is closed.
        """
        self._check_open()
        return self._requests.run(action)

    def save_or_restore(self, kind: str, number: Callable[[], int], action: Callable[[], R]) -> R:
        """Saves or restores a snapshot, which recordings contain but which is not a change.

        Args:
            kind: Name of the method of `World`.
            number: Returns the number of the snapshot, between two steps.
            action: Performs the method.

        Raises:
            WorldError: The world is closed, or a plugin calls this.
        """
        self._requests.refuse_in_plugin(kind)
        return self.read(lambda: self._logged(kind, {"number": number()}, action))

    def _logged(
        self, kind: str, arguments: Mapping[str, object] | None, action: Callable[[], R]
    ) -> R:
        if self.log is None:
            return action()
        with self.log.repeated() if arguments is None else self.log.change(kind, arguments):
            return action()
