"""The parameters of the plugin Pedestrians."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, cast

from flatland.config.hints import choice
from flatland.geometry import Bounds
from flatland.plugin_api.parameters import MAX_COORDINATE, at_key, read_positive

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flatland.config.reader import YamlReader

Color = tuple[float, float, float, float]
Span = tuple[float, float]
RouteOrder = Literal["loop", "back_and_forth", "random", "once"]

MODELS: Final = ("social_force", "orca")
BODY_TYPES: Final = ("kinematic", "dynamic")
ORDERS: Final = ("loop", "back_and_forth", "random", "once")
WANDER: Final = "wander"

# Parameters of the models and their least values; None if the value must be positive.
SOCIAL_FORCE: Final[Mapping[str, tuple[float, float | None]]] = {
    "relaxation_time": (0.5, None),
    "strength": (1.5, 0.0),
    "range": (0.3, None),
    "look_ahead": (1.0, 0.0),
    "relative": (1.0, 0.0),
    "behind": (0.1, 0.0),
    "wall_strength": (5.0, 0.0),
    "wall_range": (0.1, None),
    "gaze": (4.0, 0.0),
    "cohesion": (3.0, 0.0),
    "spacing": (1.0, 0.0),
}
ORCA: Final[Mapping[str, tuple[float, float | None]]] = {
    "horizon": (2.0, None),
    "wall_horizon": (0.5, None),
}


@dataclass(frozen=True)
class Legs:
    """The legs of all people.

    Attributes:
        layers: Layers in which lasers detect the legs.
        radius: Radius of a leg [m].
        spacing: Distance of the centers of both legs of a person who stands [m].
    """

    layers: list[str]
    radius: float
    spacing: float


@dataclass(frozen=True)
class Stop:
    """A place on the route of a group.

    Attributes:
        low: Corner of the area with the least coordinates [m], or the point.
        high: The opposite corner [m], or the point.
        radius: Distance at which the place is reached [m].
        wait: Shortest and longest time to wait there [s].
        is_queue: Whether people queue there.
        spacing: Distance of people in the queue [m].
        reader: Reader of the entry, for errors.
    """

    low: Span
    high: Span
    radius: float
    wait: Span
    is_queue: bool
    spacing: float
    reader: YamlReader

    @property
    def center(self) -> Span:
        """The point, or the center of the area [m]."""
        return ((self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2)


@dataclass(frozen=True)
class Group:
    """People with the same parameters.

    Attributes:
        name: Name of the group. The name of a person is this name with a number.
        count: Number of people at the start.
        together: Number of people who walk together.
        speed: Mean and standard deviation of the preferred speeds [m/s].
        radius: Radius of a person [m].
        color: Colour of the bodies.
        area: Area of the initial places (x_min, y_min, x_max, y_max) [m], None for everywhere.
        stops: The waypoints; empty for people who wander.
        places: Number of random places between which people wander.
        order: Order of the waypoints.
        stop_interval: Mean time between two stops on the way [s], 0 for none.
        stop_time: Shortest and longest duration of such a stop [s].
        reader: Reader of the entry, for errors.
    """

    name: str
    count: int
    together: int
    speed: Span
    radius: float
    color: Color
    area: Bounds | None
    stops: list[Stop]
    places: int
    order: RouteOrder
    stop_interval: float
    stop_time: Span
    reader: YamlReader


def read_groups(config: YamlReader) -> list[Group]:
    """Reads the list `groups`.

    Raises:
        YamlError: An entry is invalid, or two groups have the same name.
    """
    entries = config.subnode("groups", "list")
    groups: list[Group] = []
    for entry in entries.items():
        group = _read_group(entry)
        if any(group.name == other.name for other in groups):
            raise at_key(entry, "name").error(f'Group with name "{group.name}" already exists')
        groups.append(group)
    if not groups:
        raise entries.error('Invalid "groups", must be a list of at least one group')
    return groups


def _read_group(entry: YamlReader) -> Group:
    name = entry.get("name", "string")
    if not name:
        raise at_key(entry, "name").error('Invalid "name", must not be empty')
    speed = (
        read_positive(entry, "speed", 1.34),
        entry.get("speed_deviation", "float", 0.26, finite=True, minimum=0),
    )
    stops = [_read_stop(stop) for stop in entry.optional_subnode("waypoints", "list").items()]
    order: str = entry.get("order", "string", "loop" if stops else WANDER)
    allowed = ORDERS if stops else (WANDER,)
    if order not in allowed:
        text = ", ".join(allowed) if stops else f"{WANDER} without waypoints"
        raise at_key(entry, "order").error(
            f'Invalid "order", must be {"one of: " if stops else ""}{text}, got "{order}"',
            choice(order, allowed),
        )
    stop_interval, stop_time = _read_stops(entry)
    group = Group(
        name,
        entry.get("count", "int", minimum=0, maximum=10000),
        entry.get("together", "int", 1, minimum=1, maximum=20),
        speed,
        read_positive(entry, "radius", 0.2),
        entry.get("color", "color", (0.2, 0.45, 0.75, 1.0), finite=True),
        read_area(entry, "area"),
        stops,
        entry.get("places", "int", 12, minimum=2, maximum=100),
        cast("RouteOrder", "random" if order == WANDER else order),
        stop_interval,
        stop_time,
        entry,
    )
    entry.ensure_accessed_all()
    return group


def _read_stops(entry: YamlReader) -> tuple[float, Span]:
    if "stops" not in entry:
        return 0.0, (0.0, 0.0)
    stops = entry.subnode("stops", "map")
    interval = read_positive(stops, "every")
    time = read_span(stops, "time")
    stops.ensure_accessed_all()
    return interval, time


def _read_stop(entry: YamlReader) -> Stop:
    if ("at" in entry) == ("area" in entry):
        raise entry.error("A waypoint requires either at: [x, y] or area: [x1, y1, x2, y2]")
    area = read_area(entry, "area")
    if area is None:
        at = entry.get("at", "vector", finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE)
        low = high = at
        radius = read_positive(entry, "radius", 0.5)
    else:
        low, high, radius = area[:2], area[2:], 0.0
    is_queue = entry.get("queue", "bool", False)
    if is_queue and area is not None:
        raise at_key(entry, "queue").error("A queue requires a waypoint with at: [x, y]")
    stop = Stop(
        low,
        high,
        radius,
        read_span(entry, "wait", (0.0, 0.0)),
        is_queue,
        read_positive(entry, "spacing", 0.7),
        entry,
    )
    entry.ensure_accessed_all()
    return stop


def read_legs(config: YamlReader) -> Legs | None:
    """Reads the optional map `legs`.

    Raises:
        YamlError: A value is invalid.
    """
    if "legs" not in config:
        return None
    entry = config.subnode("legs", "map")
    legs = Legs(
        entry.get_list("layers", "string", min_size=1),
        read_positive(entry, "radius", 0.07),
        entry.get("spacing", "float", 0.2, finite=True, minimum=0),
    )
    entry.ensure_accessed_all()
    return legs


def read_numbers(
    config: YamlReader, key: str, known: Mapping[str, tuple[float, float | None]]
) -> dict[str, float]:
    """Reads an optional map of numbers.

    Args:
        config: Parameters of the plugin.
        key: Name of the map.
        known: Default and least value by name; None for a value that must be positive.

    Raises:
        YamlError: A value is invalid, or a name is unknown.
    """
    defaults = {name: default for name, (default, _) in known.items()}
    if key not in config:
        return defaults
    entry = config.subnode(key, "map")
    numbers = {}
    for name, (default, least) in known.items():
        if least is None:
            numbers[name] = read_positive(entry, name, default)
        else:
            numbers[name] = entry.get(name, "float", default, finite=True, minimum=least)
    entry.ensure_accessed_all()
    return numbers


def read_span(config: YamlReader, key: str, *default: Span) -> Span:
    """Reads a list of the shortest and the longest duration [s].

    Raises:
        YamlError: The value is invalid.
    """
    if default and key not in config:
        return default[0]
    span = config.get_list(key, "float", size=2, finite=True, minimum=0)
    least, most = span
    if least > most:
        raise at_key(config, key).error(
            f'Invalid "{key}", the first number must not be above the second, got {span}'
        )
    return (least, most)


def read_area(config: YamlReader, key: str) -> Bounds | None:
    """Reads an optional area (x_min, y_min, x_max, y_max) [m].

    Raises:
        YamlError: The value is invalid.
    """
    corners = config.get_list(
        key, "float", None, size=4, finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE
    )
    if corners is None:
        return None
    x_min, y_min, x_max, y_max = corners
    if not (x_min < x_max and y_min < y_max):
        raise at_key(config, key).error(
            f'Invalid "{key}", must be [x_min, y_min, x_max, y_max] of an area, got {corners}'
        )
    return (x_min, y_min, x_max, y_max)
