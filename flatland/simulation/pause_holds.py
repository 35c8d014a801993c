"""Pauses of a world while a client drags something."""

from __future__ import annotations

from collections.abc import Hashable

from flatland.plugin_api.plugin_world import PluginWorld


class PauseHolds:
    """Holds on a world, which is paused while there are any.

    All clients that drag models share the holds of a simulation. When the last hold ends, the world
    is resumed, unless it was already paused before the first one, or has been paused by other means
    since. Must be used between two steps.
    """

    def __init__(self, world: PluginWorld) -> None:
        """Creates an empty set of holds.

        Args:
            world: World to pause.
        """
        self._world = world
        self._holders: set[Hashable] = set()
        self._paused_here = False

    def __bool__(self) -> bool:
        """Returns whether there are holds."""
        return bool(self._holders)

    def hold(self, holder: Hashable) -> None:
        """Pauses the world on behalf of a holder; idempotent."""
        self.check()
        if not self._holders and not self._world.paused:
            self._world.pause()
            self._paused_here = True
        self._holders.add(holder)

    def release(self, holder: Hashable) -> None:
        """Ends the hold of a holder, if any."""
        self.check()
        if holder not in self._holders:
            return
        self._holders.remove(holder)
        if not self._holders and self._paused_here:
            self._paused_here = False
            self._world.resume()

    def keep_paused(self) -> None:
        """Leaves the world paused when the last hold ends, because a client has paused it."""
        self._paused_here = False

    def check(self) -> None:
        """Makes a later pause independent of the holds if the world was resumed meanwhile.

        To be called regularly while there are holds.
        """
        if not self._world.paused:
            self._paused_here = False
