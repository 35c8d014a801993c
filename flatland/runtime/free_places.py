"""Queries for free places in a world."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from flatland.geometry import DoubleArray
from flatland.runtime.placement import Models

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.runtime.placement import Placement

R = TypeVar("R")


class FreePlaces:
    """The part of `World` that finds free places; a base class of `Contents`."""

    _placement: Placement

    def is_free(
        self,
        pose: Sequence[float],
        radius: float | None = None,
        *,
        model: str | Model | None = None,
        layers: str | Iterable[str] = "all",
        clearance: float = 0.0,
        ignore: Models = (),
    ) -> bool:
        """Returns whether a disc or a model does not overlap anything at a pose.

        It can overlap the edges of walls and the solid footprints of models that it would collide
        with. Overlaps of up to 5 mm are ignored. Walls are edges without an interior: the interior
        of a solid obstacle of a map image is free, too, unless an edge is touched.

        Args:
            pose: (x, y) or (x, y, theta) of the centre of the disc, or of the first body of the
                model, in the world frame [m, rad].
            radius: Radius of the disc [m]; either this or `model` is required.
            model: A model of the world, or its name; its bodies keep their poses relative to each
                other, and it does not overlap itself.
            layers: Names of the layers that the disc collides with; the footprints of a model have
                their own layers.
            clearance: Distance to keep from everything that can be overlapped [m].
            ignore: Models, or their names, that may be overlapped.

        Raises:
            WorldError: A model or layer does not exist, or the world is closed.
            ValueError: A number is out of range, or not exactly one of radius and model is given.
        """
        return self._read(
            lambda: self._placement.is_free(pose, radius, model, layers, clearance, ignore)
        )

    def sample_free(
        self,
        n: int,
        radius: float,
        clearance: float = 0.0,
        rng: np.random.Generator | int | None = None,
        *,
        connected_to: Sequence[float] | None = None,
        layers: str | Iterable[str] = "all",
        bounds: Sequence[float] | None = None,
        ignore: Models = (),
    ) -> DoubleArray:
        """Samples random free poses, for example to spawn robots at.

        The poses are within the bounds of the walls, at least `clearance` away from walls, models
        and each other. The interior of solid obstacles and of closed rooms is free space, too;
        with `connected_to`, only places that the disc can reach are sampled.

        Args:
            n: Number of poses.
            radius: Radius of the discs [m].
            clearance: Distance that the discs keep [m].
            rng: Generator or seed; the same seed results in the same poses. None for a generator
                that derives from the seed of the world.
            connected_to: A point (x, y) in the world frame [m]. From there, a path of a disc leads
                to each pose without touching a wall; models do not block paths. A passage that is
                wider than the disc by less than a cell of the planning grid (at most 5 cm for maps
                of less than 200 m by 200 m) may be treated as closed.
            layers: Names of the layers that the discs collide with.
            bounds: (x_min, y_min, x_max, y_max) of the area of the samples and of the paths, in the
                world frame [m]; None for the bounds of the walls.
            ignore: Models, or their names, that may be overlapped.

        Returns:
            (x, y, theta) of each pose [m, rad], theta from -pi to pi, shape (n, 3).

        Raises:
            WorldError: There are too few free places, the disc does not fit at `connected_to`, no
                wall bounds the area, a model or layer does not exist, or the world is closed.
            ValueError: A number is out of range.
        """
        return self._read(
            lambda: self._placement.sample_free(
                n, radius, clearance, rng, connected_to, layers, bounds, ignore
            )
        )

    def _read(self, action: Callable[[], R]) -> R:
        """Returns the result of an action between two steps."""
        raise NotImplementedError
