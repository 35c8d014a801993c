"""Drags of interactive markers, and the pause of the world while they last."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from flatland.geometry import Pose
from flatland.world import World

LONGEST_SILENCE: Final = 0.1  # s of wall time after which a drag that sends nothing is over


@dataclass(slots=True)
class Drag:
    """One marker in the hands of one client.

    Attributes:
        client: Who drags.
        heard: When the client was last heard of, time of `time.monotonic` [s].
        pose: Where the marker is.
    """

    client: str
    heard: float
    pose: Pose


class Drags:
    """All drags of a world, which is paused while there are any.

    The world runs on afterwards, unless it was paused before, or somebody resumed and paused it
    meanwhile.
    """

    def __init__(self, world: World) -> None:
        """Has no drag.

        Args:
            world: To be paused.
        """
        self._world = world
        self._drags: dict[str, Drag] = {}
        self._paused_here = False

    def __bool__(self) -> bool:
        """Tells whether anything is dragged."""
        return bool(self._drags)

    def get(self, name: str) -> Drag | None:
        """Returns the drag of a marker, None when nobody drags it."""
        return self._drags.get(name)

    def hold(self, name: str, client: str, now: float, pose: Pose) -> None:
        """Begins the drag of a marker, or goes on with it."""
        self._look()
        if not self._drags and not self._world.paused:
            self._world.pause()
            self._paused_here = True
        self._drags[name] = Drag(client, now, pose)

    def end(self, name: str) -> None:
        """Ends the drag of a marker, if there is one."""
        self._look()
        if self._drags.pop(name, None) and not self._drags and self._paused_here:
            self._paused_here = False
            self._world.resume()

    def end_silent(self, now: float) -> list[str]:
        """Ends the drags that send nothing any more; returns their markers."""
        self._look()
        silent = [name for name, drag in self._drags.items() if now - drag.heard > LONGEST_SILENCE]
        for name in silent:
            self.end(name)
        return silent

    def _look(self) -> None:
        # Whoever resumes a world that is dragged in decides from then on.
        if not self._world.paused:
            self._paused_here = False
