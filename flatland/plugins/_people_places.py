"""Waypoints of people, and free places from which there is a way to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.errors import PhysicsError, WorldError
from flatland.geometry import Bounds, DoubleArray, Vector2

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flatland.physics import Crowd, Member
    from flatland.plugins._people_config import Group, Stop

CLEARANCE: Final = 0.02  # least gap between a person on a way and a wall [m]
_TOO_LARGE: Final = 'increase "cell", or bring waypoints and walls together'
_WANDER_RADIUS: Final = 0.7  # distance at which a random place is reached [m]
_MOST_DRAWS: Final = 6  # number of attempts to find free places, each with twice as many places


class PeoplePlaces:
    """Adds the waypoints of groups to a crowd, and finds free places for people."""

    def __init__(self, crowd: Crowd, world: Any, bits: int, rng: np.random.Generator) -> None:
        """Creates places without routes.

        Args:
            crowd: The crowd.
            world: The world of the plugin.
            bits: Bits of the layers in which people are.
            rng: Generator of all random places.
        """
        self._crowd = crowd
        self._world = world
        self._bits = bits
        self._rng = rng
        self._routes: dict[str, tuple[int, list[int]]] = {}

    def add_route(self, group: Group) -> None:
        """Adds the waypoints of a group and its route.

        Raises:
            YamlError: A waypoint is not in the free space.
            WorldError: There are no random places with a way between them.
        """
        if group.stops:
            waypoints = [self._add_stop(stop) for stop in group.stops]
        else:
            waypoints = self._add_random_places(group)
        route = self._crowd.add_route(
            waypoints,
            group.order,
            stop_interval=group.stop_interval,
            stop=group.stop_time,
            area=group.area,
        )
        self._routes[group.name] = (route, waypoints)

    def add_party(self, group: Group, members: Sequence[Member]) -> None:
        """Adds a party of people at the start of the route of a group."""
        route, waypoints = self._routes[group.name]
        first = int(self._rng.integers(len(waypoints))) if group.order == "random" else 0
        self._crowd.add_party(route, first, members)

    def has_way(self, waypoint: int, place: Vector2) -> bool:
        """Returns whether there is a way from a place [m] to a waypoint.

        Raises:
            WorldError: Ways cannot be computed, because the world is too large.
        """
        try:
            return self._crowd.way(waypoint, place) != (0.0, 0.0)
        except PhysicsError as error:
            raise WorldError(str(error)) from error

    def describe_outside(self, place: Vector2) -> str:
        """Returns a clause about a place [m] outside of the walls, empty for other places."""
        bounds = self._crowd.walls_apart_from(place)
        if bounds is None:
            return ""
        corners = "from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g})".format(*bounds)
        return f", which is outside of the walls, which extend {corners}"

    def find_free(self, group: Group, count: int) -> DoubleArray:
        """Returns free poses from which there is a way to the first waypoint of a group.

        Returns:
            Poses (x, y, theta) [m, rad], shape (count, 3).

        Raises:
            WorldError: There are too few free places with a way.
        """
        waypoint = self._routes[group.name][1][0]
        if not count:
            return np.empty((0, 3))
        wanted = count
        for _ in range(_MOST_DRAWS):
            places = self._sample(group, wanted, count)
            with_way = [place for place in places if self.has_way(waypoint, _pair(place))]
            if len(with_way) >= count:
                return np.array(with_way[:count]).reshape(-1, 3)
            wanted *= 2
        where = ""
        if group.stops and not with_way:
            x, y = group.stops[0].center
            outside = self.describe_outside((x, y))
            where = f" to the waypoint ({x:g}, {y:g}){outside}"
        raise WorldError(f"found only {len(with_way)} of {count} free places with a way{where}")

    def _add_stop(self, stop: Stop) -> int:
        waypoint = self._crowd.add_waypoint(
            stop.low,
            stop.high,
            stop.radius,
            wait=stop.wait,
            is_queue=stop.is_queue,
            spacing=stop.spacing,
        )
        try:
            reach = self._crowd.reach(waypoint)
        except PhysicsError as error:
            x, y = stop.center
            raise stop.reader.error(
                f"A waypoint at ({x:g}, {y:g}) is too far away: {error}", _TOO_LARGE
            ) from error
        if not reach:
            raise stop.reader.error("A waypoint is not in the free space: no person fits there")
        return waypoint

    def _add_random_places(self, group: Group) -> list[int]:
        """Adds the places between which the people of a group wander."""
        candidates = self._sample(group, 2 * group.places, None)[:, :2]
        # The places have a way to one of the candidates: to the first one with enough such places,
        # otherwise to the candidate with the most such places.
        best: list[Vector2] = []
        for x, y in candidates[: group.places].tolist():
            start = self._crowd.add_waypoint((x, y), (x, y), _WANDER_RADIUS, temporary=True)
            found = [place for place in map(_pair, candidates) if self.has_way(start, place)]
            if len(found) > len(best):
                best = found
            if len(best) > group.places:
                break
        if len(best) < 2:
            raise WorldError("there are no two free places with a way between them")
        return [
            self._crowd.add_waypoint(place, place, _WANDER_RADIUS) for place in best[: group.places]
        ]

    def _sample(self, group: Group, count: int, least: int | None) -> DoubleArray:
        """Samples `count` free poses, or at least `least` if there is too little space."""
        inside = [layer for layer in self._world.layers if layer.category_bits & self._bits]
        layers = [name for layer in inside for name in layer.names]
        radius, area = group.radius, group.area or self._region()
        if area is None and not any(len(layer.edges) for layer in inside):
            raise WorldError('"area" is required, because the layers have no walls')
        while True:
            try:
                poses: DoubleArray = self._world.sample_free(
                    count, radius, 2.0 * CLEARANCE, self._rng, layers=layers, bounds=area
                )
                return poses
            except WorldError:
                if count <= (least or 2):
                    raise
                count = max(least or 2, count // 2)

    def _region(self) -> Bounds | None:
        """Returns the part of the world for which ways are computed, None for the whole world."""
        try:
            return self._crowd.region
        except PhysicsError as error:
            raise WorldError(str(error), hint=_TOO_LARGE) from error


def _pair(place: DoubleArray) -> Vector2:
    return (float(place[0]), float(place[1]))
