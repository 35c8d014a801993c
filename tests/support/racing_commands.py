"""Commands that another thread sets in between two reads of a plugin."""

from __future__ import annotations

from typing import Any


class RacingCommand:
    """A command that is set after it was read once."""

    def __init__(self, command: Any, value: object) -> None:
        """Wraps a command.

        Args:
            command: The command.
            value: The value that it gets.
        """
        self._command, self._values = command, [value]

    def __getattr__(self, name: str) -> Any:
        """Returns an attribute of the command, which then changes."""
        found = getattr(self._command, name)
        if self._values:
            self._command.set(self._values.pop())
        return found
