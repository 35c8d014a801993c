"""Range finders: scans from the pose of a body, with noise, in one call of the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from flatland import _core
from flatland.geometry import FloatArray, Pose
from flatland.physics.body import PhysicsBody

if TYPE_CHECKING:
    from typing import Self

    from flatland.physics.world import PhysicsWorld

BeamFan = _core.BeamFan
"""End points of beams, shape (n, 2), prepared for scans; may be shared by range finders."""

RangeNoise = _core.RangeNoise
"""A noise model of a range finder, created by `additive`, `proportional` or `beam`."""


class Scan(NamedTuple):
    """A scan of a range finder.

    Attributes:
        pose: Pose (x, y, theta) of the sensor in the world frame [m, rad].
        ranges: Range of each beam [m], shape (n,).
        intensities: 255 for a beam whose reading is that of a reflecting fixture, else 0, shape
            (n,). In a world with materials, other hits have an intensity I from 0 to 255:
            I = 255 reflectance cos(angle of incidence) / max(range, 1 m)². None for a range finder
            without `reflect_mask` in a world without materials, and for a cone.
    """

    pose: Pose
    ranges: FloatArray
    intensities: FloatArray | None


class LabelledScan(NamedTuple):
    """A scan with what the beams hit.

    Attributes:
        pose: Pose (x, y, theta) of the sensor in the world frame [m, rad].
        ranges: Range of each beam [m], shape (n,).
        labels: For each beam, 1 + the index of an entry of `hits`, or 0 if its reading is not that
            of a hit, shape (n,).
        hits: The bodies that were hit, each as its id and the categories of the fixture.
    """

    pose: Pose
    ranges: FloatArray
    labels: npt.NDArray[np.uint32]
    hits: list[tuple[int, int]]


class RangeFinder:
    """A fan of beams with their filter and their noise model; immutable, independent of a world.

    Readings are a function of the poses of all fixtures, of the stream of random numbers and of the
    number of the update. They depend neither on other scans nor on the number of threads.
    """

    __slots__ = ("_core",)

    def __init__(
        self,
        beams: BeamFan | npt.ArrayLike,
        length: float,
        *,
        origin: Pose,
        mask: int,
        reflect_mask: int = 0,
        range_min: float = 0.0,
        no_hit: float = float("nan"),
        noise: RangeNoise | None = None,
        uses_materials: bool = True,
        is_cone: bool = False,
    ) -> None:
        """Creates a range finder.

        Args:
            beams: End points of the beams in the frame of the sensor [m], shape (n, 2), or a
                `BeamFan` made from them.
            length: Length of the beams [m].
            origin: Pose (x, y, theta) of the sensor in the frame of its body [m, rad].
            mask: Categories that stop a beam; see `PhysicsWorld.cast_rays`.
            reflect_mask: Categories that reflect a beam; 0 if intensities are not needed.
            range_min: Shortest range that is reported [m]; a shorter one is -inf. With 0, noise
                can make ranges negative.
            no_hit: Range that is reported for a beam without a hit [m].
            noise: Noise model; None for exact ranges.
            uses_materials: Whether materials let beams pass and reflect them; otherwise each
                fixture stops all beams.
            is_cone: Whether there is a single reading, that of the nearest hit of all beams.

        Raises:
            ValueError: An array has a wrong shape, a number is not finite or out of range, or
                `length` is above the maximum range of the noise model.
        """
        self._core = _core.RangeFinder(
            fan=beams if isinstance(beams, BeamFan) else BeamFan(beams),
            origin=origin,
            length=length,
            mask=mask,
            reflect_mask=reflect_mask,
            range_min=range_min,
            no_hit=no_hit,
            noise=noise,
            uses_materials=uses_materials,
            is_cone=is_cone,
        )

    @property
    def beams(self) -> int:
        """Number of beams."""
        return self._core.beams

    def is_random(self, world: PhysicsWorld) -> bool:
        """Returns whether scans depend on the number of the update: noise, or materials."""
        return self._core.is_random(world._core)

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        """Returns this object, which is immutable."""
        return self

    def scan(self, body: PhysicsBody, stream: int, update: int) -> Scan:
        """Performs a scan. Releases the GIL for more than 2000 beams.

        Args:
            body: Body on which the sensor is mounted.
            stream: Key of the stream of random numbers, a 64-bit integer.
            update: Number of the update in the stream, from 0 to 2**64 - 1.

        Raises:
            ValueError: The pose of the body is not finite.
            StaleHandleError: The body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        return Scan(*self._core.scan(body._core, body.id, stream, update))

    def scan_labels(self, body: PhysicsBody, stream: int, update: int) -> LabelledScan:
        """Performs the same scan as `scan`, and finds out which bodies the beams hit.

        Arguments and errors are those of `scan`.
        """
        return LabelledScan(*self._core.scan_labels(body._core, body.id, stream, update))


class ScanRequest(NamedTuple):
    """A scan to be performed; see `RangeFinder.scan`."""

    finder: RangeFinder
    body: PhysicsBody
    stream: int
    update: int


def scan_all(
    requests: Sequence[ScanRequest], out: FloatArray | None = None, num_threads: int = 0
) -> list[Scan]:
    """Performs many scans, in one or several worlds, in one call on several threads.

    The result equals that of `RangeFinder.scan` for each request, for any number of threads.
    Releases the GIL for more than 2000 beams. If an error is raised, no scan was performed.

    Args:
        requests: The scans.
        out: Array for the ranges, shape (len(requests), n), float32, C-contiguous; the ranges of
            the returned scans are views of its rows. None for new arrays.
        num_threads: Maximum number of threads; 0 for all processors that are available.

    Raises:
        TypeError: `out` is not a C-contiguous array of type float32.
        ValueError: `out` has a wrong shape, `num_threads` is negative, or the pose of a body is not
            finite.
        StaleHandleError: A body was destroyed, or a world is closed.
        WorldLockedError: A world is stepping.
    """
    jobs = [(r.body._core, r.finder._core, r.body.id, r.stream, r.update) for r in requests]
    return [Scan(*scan) for scan in _core.scan_all(jobs, out, num_threads)]
