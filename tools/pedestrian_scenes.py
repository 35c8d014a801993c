"""Worlds and measurements that compare the plugin Pedestrians with published observations.

Each function builds a world, steps it and returns numbers; `draw_pedestrians.py` draws them.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import flatland
from flatland.values import PeopleStates

Doubles = npt.NDArray[np.float64]
Segment = tuple[float, float, float, float]

STEP = 0.005  # s


@contextmanager
def scene(
    walls: Iterable[Segment], groups: Sequence[Mapping[str, Any]], seed: int = 1, **options: Any
) -> Iterator[flatland.World]:
    """Loads a world with walls and people.

    Args:
        walls: Segments (x1, y1, x2, y2) [m].
        groups: Groups of people, as in the world file.
        seed: Seed of the world.
        **options: Further parameters of the plugin.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lines = "".join(f"{x1} {y1} {x2} {y2}\n" for x1, y1, x2, y2 in walls)
        (folder / "walls.lines").write_text(lines)
        (folder / "walls.yaml").write_text(
            "{type: line_segments, data: walls.lines, scale: 1, origin: [0, 0, 0]}\n"
        )
        plugin = {"name": "people", "type": "Pedestrians", "groups": list(groups), **options}
        world = {
            "properties": {},
            "layers": [{"name": "2d", "map": "walls.yaml"}],
            "plugins": [plugin],
        }
        (folder / "world.yaml").write_text(json.dumps(world))
        with flatland.World.from_yaml(folder / "world.yaml", seed=seed, step_size=STEP) as loaded:
            yield loaded


def box(x1: float, y1: float, x2: float, y2: float) -> list[Segment]:
    """Returns the sides of a rectangle."""
    return [(x1, y1, x2, y1), (x2, y1, x2, y2), (x2, y2, x1, y2), (x1, y2, x1, y1)]


def people_of(world: flatland.World) -> Any:
    """Returns the states of all people."""
    return world.plugins[0].people  # type: ignore[attr-defined]


def free_speeds(model: str, count: int = 300, seconds: float = 8.0) -> Doubles:
    """Returns the speeds of people who walk alone, each in a lane of its own [m/s]."""
    lane = 4.0
    walls = box(0.0, 0.0, 60.0, lane * count)
    groups = [
        {
            "name": f"person{i}",
            "count": 1,
            "area": [1.0, lane * i + 1.5, 3.0, lane * i + 2.5],
            "waypoints": [{"at": [58.0, lane * (i + 0.5)]}],
            "order": "once",
        }
        for i in range(count)
    ]
    with scene(walls, groups, model=model, cell=0.5) as world:
        world.step(round(seconds / STEP))
        before = people_of(world).poses[:, 0]
        world.step(round(seconds / STEP))
        speeds: Doubles = (people_of(world).poses[:, 0] - before) / seconds
        return speeds


def band_order(y: Doubles, is_right: npt.NDArray[np.bool_], width: float, rows: int) -> float:
    """Returns the band order parameter of two opposite streams.

    The corridor is divided into rows along its axis. With n+ and n- people of both directions in a
    row, it is the mean of ((n+ - n-) / (n+ + n-))², weighted by the number of people: 1 for
    separate lanes, and small for a random mixture. Source: K. Yamori, "Going with the flow",
    Psychological Review 105 (1998), with the squares of T. Vissers et al., Soft Matter 7 (2011).

    Args:
        y: Positions across the corridor, shape (n,) [m].
        is_right: Direction of each person, shape (n,).
        width: Width of the corridor [m].
        rows: Number of rows.
    """
    row = np.clip((y / width * rows).astype(int), 0, rows - 1)
    right = np.bincount(row[is_right], minlength=rows)
    left = np.bincount(row[~is_right], minlength=rows)
    total = np.maximum(right + left, 1)
    return float(np.sum((right - left) ** 2 / total) / max(len(y), 1))


def lanes(
    model: str, count: int = 60, seconds: int = 60, seed: int = 1, **options: Any
) -> tuple[Doubles, Doubles, PeopleStates]:
    """Lets two streams pass each other in a corridor with a width of 4 m.

    The corridor is periodic: people who leave a section of 20 m enter it again at its other end.

    Returns:
        Times [s] and band order parameters, and the people at the end.
    """
    width, rows, start, end = 4.0, 6, 20.0, 40.0
    walls = box(0.0, 0.0, 60.0, width)
    groups = [
        {
            "name": name,
            "count": count // 2,
            "area": [start, 0.3, end, width - 0.3],
            "waypoints": [{"area": [x, 0.3, x + 2.0, width - 0.3]}],
        }
        for name, x in (("right", 57.0), ("left", 1.0))
    ]
    times, orders = [], []
    with scene(walls, groups, seed=seed, model=model, **options) as world:
        for tick in range(2 * seconds + 1):
            people = people_of(world)
            for name, (x, y, yaw) in zip(people.names, people.poses.tolist(), strict=True):
                if not start <= x < end:
                    back = x + math.copysign(end - start, start - x)
                    world.move_model(name, (back, y, yaw), if_blocked="allow")
            if tick % 2 == 0:
                is_right = np.array([group == "right" for group in people.groups])
                times.append(0.5 * tick)
                orders.append(band_order(people.poses[:, 1], is_right, width, rows))
            world.step(round(0.5 / STEP))
        return np.array(times), np.array(orders), people_of(world)


def weidmann(density: Doubles) -> Doubles:
    """Returns the mean speed at a density [1/m²] on level ground [m/s].

    Source: U. Weidmann, "Transporttechnik der Fussgänger", ETH Zürich (1993).
    """
    with np.errstate(divide="ignore"):
        speed: Doubles = 1.34 * (1.0 - np.exp(-1.913 * (1.0 / density - 1.0 / 5.4)))
    return np.maximum(speed, 0.0)


def fundamental_diagram(
    model: str, counts: Sequence[int], seconds: float = 40.0, **options: Any
) -> Doubles:
    """Returns densities [1/m²] and mean speeds [m/s] in a ring-shaped corridor, shape (n, 2).

    People walk around a block in one direction in a corridor with a width of 2.5 m; the straight
    part of its lower side is measured.
    """
    width, side, depth = 2.5, 16.0, 9.0
    walls = box(0, 0, side, depth) + box(width, width, side - width, depth - width)
    inner = 0.3
    corners = [
        {"area": [side - width + inner, inner, side - inner, width - inner]},
        {"area": [side - width + inner, depth - width + inner, side - inner, depth - inner]},
        {"area": [inner, depth - width + inner, width - inner, depth - inner]},
        {"area": [inner, inner, width - inner, width - inner]},
    ]
    results = []
    for count in counts:
        groups = []
        for i in range(4):  # those who start on each side walk to the next corner first
            rows = [
                [width, 0.25, side - width, width - 0.25],
                [side - width + 0.25, width, side - 0.25, depth - width],
                [width, depth - width + 0.25, side - width, depth - 0.25],
                [0.25, width, width - 0.25, depth - width],
            ]
            share = round(count * (0.73 if i % 2 == 0 else 0.27) / 2)
            groups.append(
                {
                    "name": f"side{i}",
                    "count": share,
                    "area": rows[i],
                    "waypoints": [corners[(i + k) % 4] for k in range(4)],
                }
            )
        with scene(walls, groups, model=model, **options) as world:
            world.step(round(0.5 * seconds / STEP))
            densities, speeds = [], []
            for _ in range(round(0.5 * seconds)):
                world.step(round(1.0 / STEP))
                people = people_of(world)
                x, y = people.poses[:, 0], people.poses[:, 1]
                inside = (x > 5) & (x < side - 5) & (y < width)
                densities.append(inside.sum() / ((side - 10) * width))
                speeds += people.velocities[inside, 0].tolist()
        if speeds:
            results.append((float(np.mean(densities)), float(np.mean(speeds))))
    return np.array(results)


def bottleneck_flow(
    model: str, width: float, count: int = 100, seed: int = 1, **options: Any
) -> float:
    """Returns the flow through a door while a crowd leaves a room [1/s].

    People stand in front of a door in a wall; the flow is measured between the passages of 20 and
    80 percent of them, as in laboratory experiments.
    """
    room, depth = 8.0, 8.0
    low, high = 0.5 * (room - width), 0.5 * (room + width)
    walls = [
        *box(-depth, 0.0, 16.0, room),
        (0.0, 0.0, 0.0, low),
        (0.0, high, 0.0, room),
    ]
    groups = [
        {
            "name": "person",
            "count": count,
            "area": [-6.5, 0.5, -0.5, room - 0.5],
            "waypoints": [{"area": [14.0, 0.4, 15.6, room - 0.4]}],
            "order": "once",
        }
    ]
    with scene(walls, groups, seed=seed, model=model, **options) as world:
        passed: list[float] = []
        for tick in range(round(200.0 / 0.1)):
            world.step(round(0.1 / STEP))
            through = int((people_of(world).poses[:, 0] > 0.0).sum())
            passed += [0.1 * tick] * (through - len(passed))
            if len(passed) >= 0.8 * count:
                break
        else:
            return math.nan if len(passed) < 0.4 * count else len(passed) / 200.0
    first, last = int(0.2 * count), int(0.8 * count) - 1
    return (last - first) / (passed[last] - passed[first])


def opposite_streams(model: str, count: int = 20, seed: int = 1) -> float:
    """Returns how long two streams take to pass a door of 1 m between two rooms [s]; NaN if longer.

    Args:
        model: The model of the people.
        count: Number of people in each of the rooms of 8 m by 8 m, who go to the other room.
        seed: Seed of the world.
    """
    side = 8.0
    walls = [*box(-side, 0.0, side, side), (0.0, 0.0, 0.0, 3.5), (0.0, 4.5, 0.0, side)]
    rooms = {"left": [-7.5, 0.5, -0.5, 7.5], "right": [0.5, 0.5, 7.5, 7.5]}
    goals = {"left": [1.5, 0.5, 7.5, 7.5], "right": [-7.5, 0.5, -1.5, 7.5]}
    groups = [
        {
            "name": name,
            "count": count,
            "area": area,
            "waypoints": [{"area": goals[name]}],
            "order": "once",
        }
        for name, area in rooms.items()
    ]
    from_left = np.repeat([True, False], count)
    with scene(walls, groups, seed=seed, model=model) as world:
        while world.time < 300.0:
            world.step(round(0.1 / STEP))
            if ((people_of(world).poses[:, 0] > 0.0) == from_left).all():
                return world.time
    return math.nan


class Overlaps:
    """The greatest overlaps of people with walls and with each other."""

    def __init__(self, world: flatland.World, radius: float = 0.2) -> None:
        """Starts to watch a world of people with one radius [m]."""
        self._world = world
        self._radius = radius
        edges = np.concatenate([layer.world_edges for layer in world.layers])
        self._start, self._along = edges[:, :2], edges[:, 2:] - edges[:, :2]
        self._size = np.maximum(np.sum(self._along**2, axis=1), 1e-12)
        self._near: dict[tuple[int, int], npt.NDArray[np.int64]] = {}  # edges by square metre
        self.walls = -math.inf
        self.others = -math.inf

    def _gaps(self, place: Doubles, edges: npt.NDArray[np.int64] | slice) -> Doubles:
        """Returns the distances of some edges from a place [m]."""
        offset = place - self._start[edges]
        t = np.clip(np.sum(offset * self._along[edges], axis=1) / self._size[edges], 0.0, 1.0)
        gaps: Doubles = np.hypot(*(offset - t[:, np.newaxis] * self._along[edges]).T)
        return gaps

    def look(self) -> None:
        """Compares the current positions."""
        places = people_of(self._world).poses[:, :2]
        for place in places:
            cell = (math.floor(place[0]), math.floor(place[1]))
            if cell not in self._near:
                reach = 0.5 * math.sqrt(2.0) + 1.0
                center = np.array(cell) + 0.5
                self._near[cell] = np.flatnonzero(self._gaps(center, slice(None)) < reach)
            gaps = self._gaps(place, self._near[cell])
            self.walls = max(self.walls, self._radius - float(gaps.min(initial=1.0)))
        between = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
        between[np.diag_indices(len(places))] = math.inf
        self.others = max(self.others, 2 * self._radius - float(between.min()))
