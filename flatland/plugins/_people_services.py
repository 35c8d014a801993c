"""The services of the plugin Pedestrians."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

from flatland.errors import WorldError
from flatland.geometry import Vector2


class PeopleRequests(Protocol):
    """The requests of the plugin that the services carry out."""

    def spawn(
        self, group: str | None, count: int, poses: Sequence[Sequence[float]] | None
    ) -> list[str]:
        """Adds people."""
        ...

    def remove(self, names: Iterable[str] | None) -> None:
        """Removes people."""
        ...

    def stop(self, names: Iterable[str] | None) -> None:
        """Makes people stand still."""
        ...

    def resume(self, names: Iterable[str] | None) -> None:
        """Makes people return to their routes."""
        ...

    def send(self, names: Iterable[str] | None, goal: Vector2) -> None:
        """Makes people walk to a place."""
        ...


class PeopleServices:
    """Carries out calls of the services that spawn, remove and direct people."""

    def __init__(self, people: PeopleRequests) -> None:
        """Creates the handlers of a plugin."""
        self._people = people

    def advertise(self, ros: Any, topic: str) -> None:
        """Advertises the services; their names end with that of the topic."""
        for name, definition, handler in (
            ("spawn", "SpawnPeople", self._spawn),
            ("remove", "RemovePeople", self._remove),
            ("direct", "DirectPeople", self._direct),
        ):
            ros.advertise_service(f"{name}_{topic}", definition, handler)

    def _spawn(self, request: Any) -> Any:
        poses = [(pose.x, pose.y, pose.theta) for pose in request.poses]
        try:
            names = self._people.spawn(request.group or None, request.count, poses or None)
        except (WorldError, ValueError) as error:
            return False, str(error), []
        return True, "", names

    def _remove(self, request: Any) -> Any:
        try:
            self._people.remove(request.names or None)
        except WorldError as error:
            return False, str(error)
        return True, ""

    def _direct(self, request: Any) -> Any:
        names = request.names or None
        try:
            if request.action == request.STOP:
                self._people.stop(names)
            elif request.action == request.RESUME:
                self._people.resume(names)
            elif request.action == request.SEND:
                self._people.send(names, (request.goal.x, request.goal.y))
            else:
                return False, f"action must be from 0 to 2, got {request.action}"
        except (WorldError, ValueError) as error:
            return False, str(error)
        return True, ""
