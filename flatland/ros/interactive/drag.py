"""Drags of interactive markers, which pause the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from flatland.geometry import Pose
from flatland.simulation import PauseHolds

DRAG_TIMEOUT: Final = 0.1  # s of wall time without feedback after which a drag ends


@dataclass(slots=True)
class Drag:
    """A drag of one marker by one client.

    Attributes:
        client: Id of the client.
        last_feedback: Time of the last feedback of the client (`time.monotonic`) [s].
        pose: Current pose of the marker.
    """

    client: str
    last_feedback: float
    pose: Pose


class Drags:
    """Active drags of a world, which is paused while there are any."""

    def __init__(self, holds: PauseHolds) -> None:
        """Creates an empty set of drags.

        Args:
            holds: Pauses and resumes the world.
        """
        self._holds = holds
        self._drags: dict[str, Drag] = {}

    def __bool__(self) -> bool:
        """Returns whether there are active drags."""
        return bool(self._drags)

    def get(self, name: str) -> Drag | None:
        """Returns the drag of a marker, or None."""
        return self._drags.get(name)

    def hold(self, name: str, client: str, now: float, pose: Pose) -> None:
        """Starts or continues the drag of a marker.

        Args:
            name: Name of the marker.
            client: Id of the client.
            now: Time of the feedback (`time.monotonic`) [s].
            pose: Pose of the marker.
        """
        self._holds.hold((self, name))
        self._drags[name] = Drag(client, now, pose)

    def end(self, name: str) -> None:
        """Ends the drag of a marker, if any."""
        if self._drags.pop(name, None):
            self._holds.release((self, name))

    def end_stale(self, now: float) -> list[str]:
        """Ends the drags that have timed out; returns the names of their markers."""
        self._holds.check()
        stale = [
            name for name, drag in self._drags.items() if now - drag.last_feedback > DRAG_TIMEOUT
        ]
        for name in stale:
            self.end(name)
        return stale
