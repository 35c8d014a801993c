"""Queries of the physics world: rays and overlaps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy.typing as npt

from flatland import _core
from flatland.geometry import BoolArray, FloatArray, Pose, Vector2
from flatland.physics.body import PhysicsBody
from flatland.physics.fixture import ALL_BITS, PhysicsFixture


@dataclass(frozen=True, slots=True)
class RayHit:
    """The nearest hit of a ray.

    Attributes:
        fraction: Distance of the hit as a fraction of the length of the ray, in [0, 1].
        point: Point of the hit, world frame [m].
        normal: Unit normal of the fixture at the point, world frame.
        fixture: Fixture that was hit.
        category_bits: Categories of the fixture.
    """

    fraction: float
    point: Vector2
    normal: Vector2
    fixture: PhysicsFixture
    category_bits: int


class PhysicsQueries:
    """The queries of a `PhysicsWorld`, which is derived from this class."""

    __slots__ = ("_core",)

    _core: _core.World

    if TYPE_CHECKING:  # methods of PhysicsWorld

        def body(self, body_id: int) -> PhysicsBody: ...  # noqa: D102
        def fixture(self, fixture_id: int) -> PhysicsFixture: ...  # noqa: D102

    # -- rays ------------------------------------------------------------------------------

    @property
    def has_materials(self) -> bool:
        """Whether a fixture has a material. `ray_cast` and `cast_rays` ignore materials."""
        return self._core.has_materials

    def ray_cast(
        self, start: Sequence[float], end: Sequence[float], mask: int = ALL_BITS
    ) -> RayHit | None:
        """Casts one ray with `b2World::RayCast`.

        A ray that starts inside a circle or polygon does not hit that shape. Sensors are ignored.

        Args:
            start: Start of the ray, world frame [m].
            end: End of the ray, world frame [m].
            mask: Categories that stop the ray.

        Returns:
            The nearest hit; None if there is no hit or the ray has zero length.

        Raises:
            ValueError: A number is not finite.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        start_x, start_y = start
        end_x, end_y = end
        hit = self._core.ray_cast(start_x, start_y, end_x, end_y, mask)
        if hit is None:
            return None
        fraction, point, normal, fixture, category_bits = hit
        return RayHit(fraction, point, normal, self.fixture(fixture), category_bits)

    def cast_rays(
        self, pose: Pose, ends: npt.ArrayLike, mask: int, reflect_mask: int = 0
    ) -> tuple[FloatArray, BoolArray]:
        """Casts one ray from a rangefinder to each end point.

        Releases the GIL for more than 2000 rays.

        A ray is stopped by the nearest fixture with a category in `mask` that is not a sensor
        fixture. A ray that starts inside a circle or polygon does not hit that shape. Edges are
        hit from both sides.

        Args:
            pose: Pose (x, y, theta) of the rangefinder in the world frame [m, rad].
            ends: End points of the rays in the frame of the rangefinder [m], shape (n, 2), float32.
            mask: Categories that stop a ray.
            reflect_mask: Categories that reflect a ray; 0 if reflections are not needed.

        Returns:
            Distance of each hit as a fraction of the length of the ray in [0, 1], NaN for a miss
            and for a ray of zero length, shape (n,); and for each ray whether a fixture with
            categories in both masks is at that distance, within 1e-4 m plus 1e-5 of the length of
            the ray, shape (n,).

        Raises:
            ValueError: An array has a wrong shape or a number is not finite.
            StaleHandleError: The world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.cast_rays(pose, ends, mask, reflect_mask)

    def cast_rays_reference(
        self, pose: Pose, ends: npt.ArrayLike, mask: int, reflect_mask: int = 0
    ) -> tuple[FloatArray, BoolArray]:
        """Casts rays like `cast_rays`, with `b2World::RayCast`; slow, for comparison in tests."""
        return self._core.cast_rays_reference(pose, ends, mask, reflect_mask)

    # -- overlaps --------------------------------------------------------------------------

    def overlapping_bodies(
        self,
        bodies: Sequence[PhysicsBody],
        pose: Pose,
        *,
        ignored: Iterable[PhysicsBody] = (),
        least_gap: float = 0.0,
    ) -> list[PhysicsBody]:
        """Returns the other bodies that a rigid group of bodies would overlap at a pose.

        Only pairs of fixtures that can collide are considered: neither is a sensor, their category
        and mask bits match, at least one body is dynamic, and no joint prevents the collision. The
        distance of two shapes excludes the polygon radius of Box2D. Edges have no interior: a
        closed loop of edges overlaps only shapes that intersect one of the edges.

        Args:
            bodies: Bodies of the group, at least one.
            pose: Pose (x, y, theta) of the first body in the world frame [m, rad].
            ignored: Bodies that may be overlapped.
            least_gap: Distance below which two fixtures overlap [m]; if negative, the penetration
                depth that is tolerated.

        Returns:
            The overlapped bodies, each once, in order of their ids.

        Raises:
            ValueError: There are no bodies, or a number is not finite.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        found = self._core.overlapping_bodies(_ids(bodies), pose, _ids(ignored), least_gap)
        return [self.body(body) for body in found]

    def free_poses(
        self,
        bodies: Sequence[PhysicsBody],
        poses: npt.ArrayLike,
        *,
        ignored: Iterable[PhysicsBody] = (),
        least_gap: float = 0.0,
    ) -> BoolArray:
        """Returns the poses at which a rigid group of bodies would not overlap other bodies.

        See `overlapping_bodies`. Releases the GIL.

        Args:
            bodies: Bodies of the group, at least one.
            poses: Poses (x, y, theta) of the first body in the world frame [m, rad], shape (n, 3).
            ignored: Bodies that may be overlapped.
            least_gap: Distance below which two fixtures overlap [m].

        Returns:
            Whether each pose is free, shape (n,).

        Raises:
            ValueError: There are no bodies, an array has a wrong shape, or a number is not finite.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        return self._core.free_poses(_ids(bodies), poses, _ids(ignored), least_gap)

    def free_discs(
        self,
        poses: npt.ArrayLike,
        radius: float,
        bits: int,
        *,
        ignored: Iterable[PhysicsBody] = (),
        only: Iterable[PhysicsBody] | None = None,
        least_gap: float = 0.0,
    ) -> BoolArray:
        """Returns the poses at which a disc would not overlap any body; see `free_poses`.

        Args:
            poses: Poses (x, y, theta) of the center in the world frame [m, rad], shape (n, 3).
            radius: Radius of the disc, at least 0 [m].
            bits: Category and mask bits of the disc.
            ignored: Bodies that may be overlapped.
            only: Bodies that are considered; None for all bodies.
            least_gap: Distance below which a fixture overlaps the disc [m].

        Returns:
            Whether each pose is free, shape (n,).

        Raises:
            ValueError: An array has a wrong shape or a number is out of range.
            StaleHandleError: A body was destroyed, or the world is closed.
            WorldLockedError: The world is stepping.
        """
        only_ids = None if only is None else _ids(only)
        return self._core.free_discs(poses, radius, bits, _ids(ignored), only_ids, least_gap)


def _ids(bodies: Iterable[PhysicsBody]) -> list[int]:
    return [body.id for body in bodies]
