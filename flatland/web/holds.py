"""Models that clients hold while they drag them; the world is paused meanwhile."""

from __future__ import annotations

from collections.abc import Hashable

from flatland.web.controller import WorldController
from flatland.world import World


class Holds:
    """The holds of one world; its methods are called between two steps.

    When the last hold ends, the world is resumed, unless it was paused before the first one, or
    was paused by somebody else since.
    """

    def __init__(self, world: World, controller: WorldController) -> None:
        """Creates an empty set of holds.

        Args:
            world: World to pause.
            controller: Pauses and resumes it.
        """
        self._world = world
        self._controller = controller
        self._held: set[Hashable] = set()
        self._paused_here = False

    def hold(self, key: Hashable) -> None:
        """Pauses the world until the hold of a key is released; may be repeated."""
        self._check_pause()
        if not self._held and not self._world.paused:
            self._controller.pause()
            self._paused_here = True
        self._held.add(key)

    def release(self, key: Hashable) -> None:
        """Ends a hold, if there is one."""
        self._check_pause()
        if key not in self._held:
            return
        self._held.remove(key)
        if not self._held and self._paused_here:
            self._paused_here = False
            self._controller.resume()

    def keep_paused(self) -> None:
        """Leaves the world paused when the last hold ends: somebody has paused it."""
        self._paused_here = False

    def _check_pause(self) -> None:
        # The world was resumed during a hold, so that a later pause does not belong to it.
        if not self._world.paused:
            self._paused_here = False
