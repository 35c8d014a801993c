"""Exceptions of flatland.

An invalid file or request of a user raises a `FlatlandError`, whose text starts with the prefix of
its class, so that the origin of the error is visible in logs and service responses.
"""

from __future__ import annotations

from typing import ClassVar, Final


class FlatlandError(Exception):
    """Base class of the errors of flatland."""

    prefix: ClassVar[str] = ""

    def __init__(self, message: str = "") -> None:
        """Initializes the error.

        Args:
            message: Description of the problem and of what was expected, without the prefix.
        """
        super().__init__(f"{self.prefix}{message}")
        self.message = message


class YamlError(FlatlandError):
    """A YAML file, or a value in it, is invalid."""

    prefix = "Flatland YAML: "


class UnreadableFileError(YamlError):
    """A YAML file does not exist or cannot be read."""


class PluginError(FlatlandError):
    """A plugin cannot be found, created or initialized."""

    prefix = "Flatland plugin: "


class MapFileError(FlatlandError):
    """A map or data file cannot be read."""

    prefix = "Flatland File: "


class WorldError(FlatlandError):
    """A request at run time is invalid, for example because the model does not exist."""

    prefix = "Flatland World: "


class PhysicsError(FlatlandError):
    """The physics engine rejects a request."""


class StaleHandleError(PhysicsError):
    """The object of a handle has been destroyed, or its world has been closed."""


class WorldLockedError(PhysicsError):
    """The world is being stepped; objects cannot be created, destroyed or moved."""


PLUGIN_FAULTS: Final = (Exception, SystemExit)
"""Exceptions of plugin code that do not end the simulator; `sys.exit` ends only the plugin."""
