"""What there is to draw of a world at one time, in world coordinates and free of the world."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flatland.body import Body, Color
from flatland.errors import WorldError
from flatland.geometry import Pose, compose
from flatland.timekeeper import NANOSECONDS
from flatland.values import DoubleArray, FloatArray, LaserScan

if TYPE_CHECKING:
    from flatland.layer import Layer
    from flatland.model import Model
    from flatland.plugins.laser import Laser
    from flatland.world import World

Box = tuple[float, float, float, float]
"""(x_min, y_min, x_max, y_max)"""

_CIRCLE_CORNERS = 64
_TOLERANCE, _TOLERANCE_SHARE = 0.05, 0.02
"""How far a measured point may be from what is there [m], and more as a share of its range."""
_FITTING_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Outline:
    """A fixture.

    Attributes:
        points: Its corners, or the two ends of an edge; world frame [m], shape (n, 2).
        color: Of its body.
        is_sensor: Whether it lets everything through.
    """

    points: DoubleArray
    color: Color
    is_sensor: bool


@dataclass(frozen=True, slots=True)
class Walls:
    """The edges of a layer: world frame [m], shape (n, 2 ends, 2)."""

    edges: DoubleArray
    color: Color


@dataclass(frozen=True, slots=True)
class Figurine:
    """A model.

    Attributes:
        name: Of the model.
        outlines: Of all bodies.
        middle: Pose of the middle of the first body's fixtures, None when it has none.
        breadth: The shorter side of the box around them [m].
        color: Of the first body.
    """

    name: str
    outlines: list[Outline]
    middle: Pose | None
    breadth: float
    color: Color

    def box(self) -> Box | None:
        """Returns the box around all outlines [m], None when there are none."""
        return _box_around([outline.points for outline in self.outlines])


@dataclass(frozen=True, slots=True)
class Link:
    """A joint: from the origin of body A over both anchors to the origin of body B.

    Attributes:
        points: World frame [m], shape (4, 2).
        color: Of the joint.
    """

    points: DoubleArray
    color: Color


@dataclass(frozen=True, slots=True)
class Sweep:
    """What a laser sees.

    Attributes:
        area: Polygon that its beams sweep, the sensor first; world frame [m], shape (n + 1, 2).
        hits: Where beams end on something, shape (k, 2).
    """

    area: DoubleArray
    hits: DoubleArray


@dataclass(frozen=True, slots=True)
class Scene:
    """All that there is to draw."""

    walls: list[Walls]
    figurines: list[Figurine]
    links: list[Link]
    sweeps: list[Sweep]

    def box(self) -> Box | None:
        """Returns the box around walls and models [m], None when there are none."""
        parts = [walls.edges.reshape(-1, 2) for walls in self.walls]
        parts += [outline.points for model in self.figurines for outline in model.outlines]
        return _box_around(parts)


def _box_around(parts: list[DoubleArray]) -> Box | None:
    points = np.concatenate([*parts, np.empty((0, 2))])
    if not len(points):
        return None
    (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (x_min, y_min, x_max, y_max)


def look_at(world: World, layers: Iterable[str] | None, scans: bool) -> Scene:
    """Takes what is to be drawn; changes nothing, and must run while no step is under way.

    Args:
        world: The world.
        layers: Names of the layers to take, None for all.
        scans: Whether to take what the lasers see.

    Raises:
        WorldError: The world is closed, or has no layer of a name.
    """
    # Only who draws needs it: `import flatland` brings no plugin along.
    from flatland.plugins.laser import Laser

    if world.closed:
        raise WorldError("the world is closed")
    names = [layer.name for layer in world.layers] if layers is None else layers
    models = world.models
    return Scene(
        walls=[_walls(layer) for layer in dict.fromkeys(map(world.layer, names))],
        figurines=[_figurine(model) for model in models],
        links=[link for model in models for link in _links(model)],
        sweeps=[
            _sweep(plugin, world)
            for model in models
            for plugin in model.plugins
            if scans and isinstance(plugin, Laser)
        ],
    )


def _to_world(pose: Pose, points: DoubleArray) -> DoubleArray:
    """Turns points (..., 2) of a frame at a pose into world coordinates."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    in_world: DoubleArray = points @ np.array([[c, s], [-s, c]]) + np.array([x, y])
    return in_world


def _walls(layer: Layer) -> Walls:
    edges = layer.edges.astype(np.float64).reshape(-1, 2, 2)
    return Walls(_to_world(layer.body.pose, edges), layer.color)


def _local_outlines(body: Body) -> list[tuple[DoubleArray, bool]]:
    """Returns each fixture's corners in the body's frame, and whether it is a sensor."""
    angles = np.linspace(0, math.tau, _CIRCLE_CORNERS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [
        (
            fixture.center + fixture.radius * circle
            if fixture.shape == "circle"
            else np.asarray(fixture.vertices, np.float64),
            fixture.is_sensor,
        )
        for fixture in body.fixtures
    ]


def _figurine(model: Model) -> Figurine:
    outlines = []
    for body in model.bodies:
        pose = body.pose
        outlines += [
            Outline(_to_world(pose, points), body.color, is_sensor)
            for points, is_sensor in _local_outlines(body)
        ]
    first = model.bodies[0]
    box = _box_around([points for points, _ in _local_outlines(first)])
    if box is None:
        return Figurine(model.name, outlines, None, 0.0, first.color)
    x_min, y_min, x_max, y_max = box
    middle = compose(first.pose, ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
    breadth = min(x_max - x_min, y_max - y_min)
    return Figurine(model.name, outlines, middle, breadth, first.color)


def _links(model: Model) -> list[Link]:
    links = []
    for joint in model.joints:
        (pose_a, pose_b), (anchor_a, anchor_b) = (b.pose for b in joint.bodies), joint.anchors
        points = [
            pose_a[:2],
            _to_world(pose_a, anchor_a),
            _to_world(pose_b, anchor_b),
            pose_b[:2],
        ]
        links.append(Link(np.array(points), joint.color))
    return links


# -- scans ---------------------------------------------------------------------------------


def _sweep(laser: Laser, world: World) -> Sweep:
    """Takes the latest scan of a laser, or what it sees now where that is none of now."""
    body_pose, ranges = _latest_scan(laser, world) or (laser.body.pose, None)
    if ranges is None:
        ranges = _cast(laser, world, body_pose)
    sensor = compose(body_pose, laser.origin)
    # What a beam without a hit reports is NaN, infinite or the full range.
    is_hit = np.isfinite(ranges) & (ranges != np.float32(laser.range))
    shares = np.where(is_hit, ranges.astype(np.float64) / laser.range, 1.0)
    ends = _to_world(sensor, laser._ends * shares[:, np.newaxis])
    return Sweep(np.concatenate([[sensor[:2]], ends]), ends[is_hit])


def _cast(laser: Laser, world: World, body_pose: Pose) -> FloatArray:
    """Returns the ranges without noise, NaN for a miss [m], shape (n,).

    The laser's own `compute_ranges` draws noise, after which the simulation would run otherwise.
    """
    pose = compose(body_pose, laser.origin)
    fractions, _ = world.physics.cast_rays(pose, laser._ends, laser._mask)
    return fractions * np.float32(laser.range)


def _latest_scan(laser: Laser, world: World) -> tuple[Pose, FloatArray] | None:
    """Returns the latest scan and where the body was then; None if there is none of now."""
    scan = _emitted_scan(laser, world)
    if scan is None:
        return None
    age_ns = world.timekeeper.sim_time_ns - scan.stamp
    period = 1 / laser.timer.rate if laser.timer.rate else math.inf
    if age_ns > period * NANOSECONDS + 2 * world.timekeeper.step_size_ns:
        return None
    age = age_ns / NANOSECONDS
    x, y, theta = laser.body.pose
    vx, vy, omega = laser.body.velocity
    pose = (x - vx * age, y - vy * age, theta - omega * age)
    # It would not fit if the model was put elsewhere, or if this is a scan of another laser that
    # shares topic and frame.
    if not _fits(scan.ranges, _cast(laser, world, pose), laser):
        return None
    return pose, scan.ranges


def _emitted_scan(laser: Laser, world: World) -> LaserScan | None:
    """Returns the latest scan that came from the laser, as far as its values tell."""
    for output in world.ports.outputs.values():
        scan = output.latest
        if (
            isinstance(scan, LaserScan)
            and scan.frame_id == laser.frame_id
            and len(scan.ranges) == laser.angles.count
        ):
            return scan
    return None


def _fits(measured: FloatArray, seen: FloatArray, laser: Laser) -> bool:
    """Tells whether most ranges are about what is to be seen; a miss counts as the full length."""
    length = laser.range
    measured, seen = (np.nan_to_num(r, nan=length, posinf=length) for r in (measured, seen))
    tolerance = _TOLERANCE + _TOLERANCE_SHARE * seen + 3 * laser._deviation
    return bool((np.abs(measured - seen) <= tolerance).mean() >= _FITTING_SHARE)
