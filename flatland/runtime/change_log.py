"""The interface through which a world reports requested changes to a recording."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Protocol


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
