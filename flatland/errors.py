"""The exceptions of flatland.

A user's mistake in a file or a request is a `FlatlandError` whose text starts with the prefix
of its class, so that logs and service answers tell at a glance where the fault lies.
"""

from __future__ import annotations

from typing import ClassVar, Final


class FlatlandError(Exception):
    """Base of all errors that flatland raises on purpose."""

    prefix: ClassVar[str] = ""

    def __init__(self, message: str = "") -> None:
        """Stores the text behind the prefix of the class.

        Args:
            message: What is wrong and what was expected, without the prefix.
        """
        super().__init__(f"{self.prefix}{message}")
        self.message = message


class YamlError(FlatlandError):
    """Anything wrong in a YAML file or its values."""

    prefix = "Flatland YAML: "


class UnreadableFileError(YamlError):
    """A YAML file that is not there or cannot be read; who names the file may add where."""


class PluginError(FlatlandError):
    """A plugin that cannot be found, made or initialised."""

    prefix = "Flatland plugin: "


class MapFileError(FlatlandError):
    """A map or data file that cannot be read."""

    prefix = "Flatland File: "


class WorldError(FlatlandError):
    """A run-time request that cannot be met, such as an unknown model."""

    prefix = "Flatland World: "


class PhysicsError(FlatlandError):
    """A request that the physics engine refuses."""


class StaleHandleError(PhysicsError):
    """The object behind a handle was destroyed, or its world was closed."""


class WorldLockedError(PhysicsError):
    """The world is stepping: nothing may be created, destroyed or moved now."""


PLUGIN_FAULTS: Final = (Exception, SystemExit)
"""What a plugin's code may raise without ending the simulator; `sys.exit` is the plugin's end."""
