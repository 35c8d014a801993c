"""Placement of models: overlaps at a pose, and free places."""

from __future__ import annotations

import logging
import math
import zlib
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from flatland.checks import (
    check_choice,
    checked_count,
    checked_names,
    checked_not_negative,
    checked_positive,
    plain_numbers,
    shown,
)
from flatland.defaults import IF_BLOCKED
from flatland.defaults import IfBlocked as IfBlocked
from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.errors import WorldError
from flatland.geometry import (
    BoolArray,
    Bounds,
    DoubleArray,
    Pose,
    Vector2,
    bounds_of,
    finite_place,
    finite_pose,
)
from flatland.runtime.free_space import FreeSpace, Spread
from flatland.runtime.nearest_place import SEARCH_RADIUS, nearest_offset
from flatland.suggestions import did_you_mean, listed

if TYPE_CHECKING:
    from flatland.entities.collision_filter import CollisionFilter
    from flatland.physics import PhysicsBody, PhysicsWorld
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.layer_set import LayerSet

_LOG = logging.getLogger("flatland")

Models: TypeAlias = str | Model | Iterable[str | Model]

TOLERANCE: Final = 0.005  # m of penetration that is allowed, as by the Box2D solver
_ROUNDING: Final = 1e-4  # m of overlap of touching shapes that single precision may cause
_FIRST_TRIES: Final = 1024
_MAX_PLACES: Final = 10**6
_MAX_SPACES: Final = 8  # free spaces in the cache


def check_if_blocked(if_blocked: str) -> None:
    """Raises ValueError for an invalid value of `if_blocked`."""
    check_choice("if_blocked", if_blocked, IF_BLOCKED)


class Placement:
    """Finds overlaps and free places in a world, between two steps."""

    def __init__(
        self,
        physics: PhysicsWorld,
        collision_filter: CollisionFilter,
        layers: LayerSet,
        contacts: ContactReporter,
        find_model: Callable[[str], Model],
        find_seed: Callable[[], int],
    ) -> None:
        """Creates the placement of a world.

        Args:
            physics: Contains the bodies and walls.
            collision_filter: The names of layers.
            layers: The layers.
            contacts: Maps physics bodies to bodies of models and layers.
            find_model: Returns the model of a name.
            find_seed: Returns the seed of the world.
        """
        self._physics = physics
        self._collision_filter = collision_filter
        self._layers = layers
        self._contacts = contacts
        self._find_model = find_model
        self._find_seed = find_seed
        self._rng: np.random.Generator | None = None
        # Walls and free spaces by the arguments of the query; they do not depend on models.
        self._spaces: dict[tuple[object, ...], tuple[DoubleArray, FreeSpace]] = {}

    def __getstate__(self) -> np.random.Generator | None:
        """Returns the part of the state of the world that a snapshot saves."""
        return self._rng

    def __setstate__(self, rng: np.random.Generator | None) -> None:
        """Restores a saved state."""
        self._rng = rng

    def forget_random_state(self) -> None:
        """Returns to the initial state of the generator for samples of free places."""
        self._rng = None

    # -- models ----------------------------------------------------------------------------

    def choose_pose(self, model: Model, pose: Pose, if_blocked: IfBlocked, verb: str) -> Pose:
        """Returns the pose at which a model is to be placed.

        Args:
            model: The model, at any pose in the physics world.
            pose: Requested pose of its first body in the world frame [m, rad].
            if_blocked: What to do if the model would overlap walls or other models.
            verb: Name of the operation for error messages, such as `spawn`.

        Raises:
            WorldError: The pose is blocked and `if_blocked` is `refuse`, or it is `nearest` and no
                place near the pose is free.
            ValueError: The pose is out of the range of the physics.
        """
        if if_blocked in ("allow", "warn"):
            return pose
        overlap = self._overlap(model, pose)
        if overlap is None:
            return pose
        failure = f'failed to {verb} model "{model.name}", it {overlap}'
        if if_blocked == "refuse":
            raise WorldError(failure)
        physics, bodies = self._physics, [body.physics for body in model.bodies]
        offset = nearest_offset(
            lambda offsets: physics.free_poses(
                bodies, _poses(offsets + pose[:2], pose[2]), least_gap=-_ROUNDING
            )
        )
        if offset is None:
            raise WorldError(f"{failure}, and no place within {SEARCH_RADIUS:g} m is free")
        return (pose[0] + offset[0], pose[1] + offset[1], pose[2])

    def warn_if_blocked(self, model: Model) -> None:
        """Logs one line if a model overlaps walls or other models."""
        overlap = self.describe_overlap(model)
        if overlap:
            _LOG.warning('model "%s" %s', model.name, overlap)

    def describe_overlap(self, model: Model) -> str:
        """Returns what a model overlaps; see `World.describe_overlap`."""
        return self._overlap(model, model.pose) or ""

    def _overlap(self, model: Model, pose: Pose) -> str | None:
        """Returns a description of the overlaps of a model at a pose, None if there are none."""
        bodies = [body.physics for body in model.bodies]
        overlapped = self._physics.overlapping_bodies(bodies, pose, least_gap=-TOLERANCE)
        if not overlapped:
            return None
        x, y, theta = pose
        return f"overlaps {self._describe(overlapped)} at ({x:.3f}, {y:.3f}, {theta:.3f})"

    def _describe(self, bodies: list[PhysicsBody]) -> str:
        names = []
        for physics_body in bodies:
            body = self._contacts.find_body(physics_body)
            if body is None:
                names.append("a body without a model")
            else:
                kind = "layer" if isinstance(body.entity, Layer) else "model"
                names.append(f'{kind} "{body.entity.name}"')
        return listed(dict.fromkeys(names))

    # -- free places -----------------------------------------------------------------------

    def is_free(
        self,
        pose: Sequence[float],
        radius: float | None,
        model: str | Model | None,
        layers: str | Iterable[str],
        clearance: float,
        ignore: Models,
    ) -> bool:
        """Checks one pose; see `World.is_free`."""
        numbers = plain_numbers(pose, (2, 3))
        x, y, theta = finite_pose(pose if numbers is None else (*numbers, 0.0)[:3])
        least_gap = checked_not_negative("clearance", clearance, "m") - TOLERANCE
        physics, ignored = self._physics, self._bodies(ignore)
        if radius is not None and model is None:
            disc, bits = checked_not_negative("radius", radius, "m"), self._bits(layers)
            free = physics.free_discs(
                [(x, y, theta)], disc, bits, ignored=ignored, least_gap=least_gap
            )
        elif model is not None and radius is None:
            bodies = self._bodies(model)
            free = physics.free_poses(bodies, [(x, y, theta)], ignored=ignored, least_gap=least_gap)
        else:
            raise ValueError("is_free requires either a radius or a model")
        return bool(free[0])

    def sample_free(
        self,
        n: int,
        radius: float,
        clearance: float,
        rng: np.random.Generator | int | None,
        connected_to: Sequence[float] | None,
        layers: str | Iterable[str],
        bounds: Sequence[float] | None,
        ignore: Models,
    ) -> DoubleArray:
        """Draws free poses; see `World.sample_free`."""
        n = checked_count("n", n, 0, _MAX_PLACES)
        radius = checked_positive("radius", radius, "m")
        clearance = checked_not_negative("clearance", clearance, "m")
        bits, ignored = self._bits(layers), self._bodies(ignore)
        start = None if connected_to is None else _checked_start(connected_to)
        generator = self._generator(rng)
        space = self._free_space(bits, radius, clearance, bounds)
        cells = space.cells(start)
        spread = Spread(2 * radius + clearance)
        # Most calls find enough places among a small part of the cells.
        for tries in (_FIRST_TRIES + 32 * n, len(cells)):
            picked = generator.choice(cells, size=min(tries, len(cells)), replace=False)
            places = space.places_in(picked, generator)
            free = self._physics.free_discs(
                _poses(places, 0.0), radius, bits, ignored=ignored, least_gap=clearance
            )
            if spread.fill(places[free], n):
                points = np.array(spread.places).reshape(-1, 2)
                return np.column_stack((points, generator.uniform(-math.pi, math.pi, n)))
        where = "" if start is None else f" connected to ({start[0]:g}, {start[1]:g})"
        raise WorldError(
            f"found only {len(spread.places)} of {n} free places for discs of radius {radius:g} m "
            f"with a clearance of {clearance:g} m{where}"
        )

    def _free_space(
        self, bits: int, radius: float, clearance: float, bounds: Sequence[float] | None
    ) -> FreeSpace:
        layers = [layer for layer in self._layers.all if layer.category_bits & bits]
        walls = np.concatenate([np.empty((0, 4)), *(layer.world_edges for layer in layers)])
        area = bounds_of(walls.reshape(-1, 2)) if bounds is None else _checked_bounds(bounds)
        if area is None:
            raise WorldError("the layers have no walls; bounds are required")
        key = (bits, radius, clearance, area)
        known = self._spaces.get(key)
        # Plugins may have added or moved walls since.
        if known is not None and np.array_equal(known[0], walls):
            return known[1]

        def fits(points: DoubleArray, disc: float) -> BoolArray:
            bodies = [layer.body.physics for layer in layers]  # A reset replaces them.
            return self._physics.free_discs(_poses(points, 0.0), disc, bits, only=bodies)

        space = FreeSpace(walls, area, radius, clearance, fits)
        if len(self._spaces) >= _MAX_SPACES:
            self._spaces.clear()
        self._spaces[key] = (walls, space)
        return space

    def _generator(self, rng: np.random.Generator | int | None) -> np.random.Generator:
        if isinstance(rng, np.random.Generator):
            return rng
        if rng is not None:
            return np.random.default_rng(checked_count("rng", rng, 0))
        if self._rng is None:
            seeds = [self._find_seed(), zlib.crc32(b"placement")]
            self._rng = np.random.default_rng(np.random.SeedSequence(seeds))
        return self._rng

    def _bits(self, layers: str | Iterable[str]) -> int:
        names = checked_names("layers", layers)
        unknown = self._collision_filter.unknown(names)
        if unknown:
            hint = did_you_mean(unknown[0], self._collision_filter.names, "layers of the world")
            raise WorldError(f'layer with name "{unknown[0]}" does not exist', hint=hint)
        return self._collision_filter.category_bits(names)

    def _bodies(self, models: Models) -> list[PhysicsBody]:
        given = [models] if isinstance(models, str | Model) else models
        each = list(given) if isinstance(given, Iterable) else [given]
        if not all(isinstance(one, str | Model) for one in each):
            raise ValueError(f"expected a model, its name, or several of them, got {shown(models)}")
        found = [self._find_model(one) if isinstance(one, str) else one for one in each]
        return [body.physics for model in found for body in model.bodies]


def _checked_start(start: Sequence[float]) -> Vector2:
    """Returns the first two numbers of a place or a pose."""
    numbers = plain_numbers(start, (2, 3))
    return finite_place("connected_to", start if numbers is None else numbers[:2])


def _checked_bounds(bounds: Sequence[float]) -> Bounds:
    numbers = plain_numbers(bounds, (4,))
    if numbers is not None and all(map(math.isfinite, numbers)):
        x_min, y_min, x_max, y_max = numbers
        if x_min < x_max and y_min < y_max:
            return (x_min, y_min, x_max, y_max)
    raise ValueError(
        f"bounds must be (x_min, y_min, x_max, y_max) of an area [m], got {shown(bounds)}"
    )


def _poses(points: DoubleArray, theta: float) -> DoubleArray:
    return np.column_stack((points, np.full(len(points), theta)))
