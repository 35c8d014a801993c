"""Wheels on the ground, and how fast they roll."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2


@dataclass(frozen=True, slots=True)
class GroundWheel:
    """A wheel that touches the ground at a point of a body.

    Attributes:
        position: The point, body frame [m].
        heading: Direction in which the wheel rolls forwards, body frame [rad].
        slide: Cotangent of the angle from the heading to the direction in which the wheel moves
            freely: 0 for wheels that slide sideways, 1 or -1 for mecanum wheels.
    """

    position: Vector2
    heading: float = 0.0
    slide: float = 0.0

    def row(self) -> Pose:
        """Returns the factors of the velocity of the body in the speed of the rim.

        If the point moves with a velocity v, the wheel rolls with the speed s for which
        v = s h + a f, where h is the heading and f the free direction.

        Returns:
            Factors of the forward velocity, the sideways velocity and the yaw rate of the origin of
            the body.
        """
        c, s = math.cos(self.heading), math.sin(self.heading)
        x, y = self.position
        along_x, along_y = c + self.slide * s, s - self.slide * c
        return (along_x, along_y, along_y * x - along_x * y)


def mecanum_wheels(wheelbase: float, track: float) -> tuple[GroundWheel, ...]:
    """Returns four mecanum wheels around the origin whose rollers form an X seen from above.

    Args:
        wheelbase: Distance of the axles [m].
        track: Distance of the left and right wheels [m].

    Returns:
        The wheels at the front left, front right, rear left and rear right.
    """
    x, y = wheelbase / 2, track / 2
    return (
        GroundWheel((x, y), slide=1.0),
        GroundWheel((x, -y), slide=-1.0),
        GroundWheel((-x, y), slide=-1.0),
        GroundWheel((-x, -y), slide=1.0),
    )


def three_wheels(distance: float, first_angle: float) -> tuple[GroundWheel, ...]:
    """Returns three omni wheels on a circle, 120 degrees apart, that roll along the circle.

    Args:
        distance: Distance of the wheels from the origin [m].
        first_angle: Direction of the first wheel from the origin, body frame [rad].
    """
    angles = [first_angle + i * math.tau / 3 for i in range(3)]
    return tuple(
        GroundWheel((distance * math.cos(a), distance * math.sin(a)), a + math.pi / 2)
        for a in angles
    )
