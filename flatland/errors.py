"""Exceptions of flatland.

An invalid file or request of a user raises a `FlatlandError`, whose text starts with the prefix of
its class, so that the origin of the error is visible in logs and service responses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A position in a file.

    Attributes:
        path: The file as given, empty for a text that was not read from a file.
        line: Line number, from 1; None for the whole file.
        column: Column number, from 1; None if unknown.
    """

    path: str
    line: int | None = None
    column: int | None = None

    @property
    def suffix(self) -> str:
        """The path and line in brackets, for the end of an error message."""
        if self.line is None:
            return f" [{self.path}]" if self.path else ""
        return f" [{self.path}:{self.line}]" if self.path else f" [line {self.line}]"


class FlatlandError(Exception):
    """Base class of the errors of flatland.

    Attributes:
        message: Description of the problem, without the prefix of the class.
        place: The position in a file that the error is about, None if there is none.
        hint: What probably helps, empty if nothing is known; not part of the message. It is a note
            of the exception, which Python prints below the text in a traceback.
    """

    prefix: ClassVar[str] = ""

    def __init__(self, message: str = "", *, place: Place | None = None, hint: str = "") -> None:
        """Initializes the error.

        Args:
            message: Description of the problem and of what was expected, without the prefix.
            place: The position in a file; not added to the message.
            hint: What probably helps.
        """
        super().__init__(f"{self.prefix}{message}")
        self.message = message
        self.place = place
        self.hint = hint
        if hint:
            self.add_note(f"hint: {hint}")

    @property
    def text_with_hint(self) -> str:
        """The text of the error, then the hint in brackets if there is one."""
        return f"{self} (hint: {self.hint})" if self.hint else str(self)

    def parts(self) -> Sequence[FlatlandError]:
        """Returns the errors that this one consists of, by default only itself."""
        return (self,)


class YamlError(FlatlandError):
    """A YAML file, or a value in it, is invalid."""

    prefix = "Flatland YAML: "


class UnreadableFileError(YamlError):
    """A YAML file does not exist, cannot be read, or is an image or a data file."""


class PluginError(FlatlandError):
    """A plugin cannot be found, created or initialized."""

    prefix = "Flatland plugin: "


class MapFileError(FlatlandError):
    """A map or data file cannot be read."""

    prefix = "Flatland File: "


class WorldError(FlatlandError):
    """A request at run time is invalid, for example because the model does not exist."""

    prefix = "Flatland World: "


class BatchError(WorldError):
    """One item of a request is invalid; nothing was changed. The cause is the error of the item.

    Attributes:
        index: Index of the item.
    """

    def __init__(self, what: str, index: int, cause: FlatlandError) -> None:
        """Initializes the error.

        Args:
            what: Description of the item, such as `models[3]`.
            index: Index of the item.
            cause: The error of the item.
        """
        super().__init__(f"{what}: {cause.message}", place=cause.place, hint=cause.hint)
        self.index = index


class PhysicsError(FlatlandError):
    """The physics engine rejects a request."""


class StaleHandleError(PhysicsError):
    """The object of a handle has been destroyed, or its world has been closed."""


class WorldLockedError(PhysicsError):
    """The world is being stepped; objects cannot be created, destroyed or moved."""


PLUGIN_FAULTS: Final = (Exception, SystemExit)
"""Exceptions of plugin code that do not end the simulator; `sys.exit` ends only the plugin."""
