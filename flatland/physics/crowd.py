"""Handle of a crowd: people whose bodies the core moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

from flatland import _core
from flatland.geometry import DoubleArray, Vector2
from flatland.physics.controller import Controller

if TYPE_CHECKING:
    from flatland.physics.body import PhysicsBody
    from flatland.physics.world import PhysicsWorld

RouteOrder = Literal["loop", "back_and_forth", "random", "once"]
Disc = tuple[Vector2, Vector2, float]
"""Position [m], velocity [m/s] and radius [m]."""


class PersonState(NamedTuple):
    """A person of a crowd.

    Attributes:
        body_id: Id of the body.
        x: Position [m], world frame.
        y: Position [m], world frame.
        yaw: Heading [rad].
        vx: Velocity [m/s], world frame.
        vy: Velocity [m/s], world frame.
        omega: Rate of the heading [rad/s].
        is_standing: Whether the person stands on purpose: stopped, waiting or in a queue.
    """

    body_id: int
    x: float
    y: float
    yaw: float
    vx: float
    vy: float
    omega: float
    is_standing: bool


class Crowd(Controller):
    """Handle of a crowd; the core moves its people before each step.

    Waypoints, routes, parties and people are added to it; each is identified by a number. Deleted
    bodies are forgotten.
    """

    __slots__ = ()

    @classmethod
    def create(
        cls,
        world: PhysicsWorld,
        *,
        is_orca: bool,
        is_dynamic: bool,
        bits: int,
        interval: int,
        key: int,
        numbers: Mapping[str, float],
    ) -> Crowd:
        """Creates a crowd without people.

        Args:
            world: World of the bodies.
            is_orca: Whether velocities are chosen by ORCA, otherwise by the social force model.
            is_dynamic: Whether the bodies are dynamic, otherwise kinematic.
            bits: Bits of the layers whose walls and bodies people avoid.
            interval: Number of steps between two choices of velocities.
            key: A 64-bit integer from which all random numbers derive.
            numbers: Parameters of the models by name; see `src/cpp/crowd`.

        Raises:
            ValueError: A parameter is unknown or out of range.
        """
        return cls(world, world._core.add_crowd(is_orca, is_dynamic, bits, interval, key, numbers))

    @property
    def alive(self) -> bool:
        """Whether the crowd exists."""
        return self._core.has_crowd(self.id)

    def remove(self) -> None:
        """Removes the crowd; bodies keep their velocities."""
        self._core.remove_crowd(self.id)

    def schedule(self, order: int, *, automatic: bool, holds: bool = False) -> None:
        """Sets when the crowd is carried out; see `Controller.schedule`."""
        del holds
        self._core.schedule_crowd(self.id, order, automatic)

    def advance(self, dt: float) -> None:
        """Carries out the crowd now, and not again in the current step.

        Args:
            dt: Duration of the step [s].
        """
        self._core.advance_crowd(self.id, dt)

    def set_key(self, key: int) -> None:
        """Sets the integer from which all further random numbers derive."""
        self._core.set_crowd_key(self.id, key)

    def add_waypoint(
        self,
        low: Vector2,
        high: Vector2,
        radius: float,
        *,
        wait: tuple[float, float] = (0.0, 0.0),
        is_queue: bool = False,
        spacing: float = 0.7,
    ) -> int:
        """Adds a waypoint: the points within a distance of a rectangle, which may be a point.

        Args:
            low: Corner of the rectangle with the least coordinates [m], world frame.
            high: The opposite corner.
            radius: The distance [m].
            wait: Shortest and longest duration for which people wait there [s].
            is_queue: Whether people queue in front of the place and wait there one by one.
            spacing: Distance of people in the queue [m]; 0 for a temporary waypoint on no route,
                whose number is used again once nobody is sent there.

        Returns:
            The number of the waypoint.

        Raises:
            ValueError: A coordinate is not finite.
        """
        return self._core.add_crowd_waypoint(self.id, low, high, radius, wait, is_queue, spacing)

    def reach(self, waypoint: int) -> int:
        """Returns the number of cells of the planning grid from which a way leads to a waypoint."""
        return self._core.crowd_reach(self.id, waypoint)

    def way(self, waypoint: int, place: Vector2) -> Vector2:
        """Returns the direction of the way from a place to a waypoint, (0, 0) if there is none."""
        return self._core.crowd_way(self.id, waypoint, place)

    def add_route(
        self,
        waypoints: Sequence[int],
        order: RouteOrder,
        *,
        stop_interval: float = 0.0,
        stop: tuple[float, float] = (0.0, 0.0),
    ) -> int:
        """Adds a route and returns its number.

        Args:
            waypoints: Numbers of the waypoints.
            order: The order in which they are visited.
            stop_interval: Mean time between two stops on the way [s], 0 for none.
            stop: Shortest and longest duration of a stop [s].

        Raises:
            ValueError: A waypoint or the order does not exist.
        """
        return self._core.add_crowd_route(self.id, list(waypoints), order, stop_interval, stop)

    def add_party(self, route: int, first_leg: int, *, is_backward: bool = False) -> int:
        """Adds a party of people who walk together, and returns its number.

        Args:
            route: The route.
            first_leg: Index of the first waypoint in the route.
            is_backward: Whether a route of order `back_and_forth` starts backwards.

        Raises:
            ValueError: The route or the waypoint does not exist.
        """
        return self._core.add_crowd_party(self.id, route, first_leg, is_backward)

    def add_person(
        self,
        body: PhysicsBody,
        legs: Sequence[PhysicsBody],
        party: int,
        *,
        radius: float,
        speed: float,
        is_aware: bool,
        phase: float,
    ) -> None:
        """Adds a person.

        Args:
            body: Body of the person; the origin is the center, x the heading.
            legs: The left and the right leg, or nothing.
            party: The party to which the person belongs.
            radius: Radius of the disc that keeps free of others [m].
            speed: Preferred speed [m/s].
            is_aware: Whether the person avoids dynamic bodies.
            phase: Phase of the gait, from 0 to 1.

        Raises:
            ValueError: The party does not exist, or a number is out of range.
        """
        left, right = (leg.id for leg in legs) if legs else (0, 0)
        self._core.add_crowd_person(
            self.id, body.id, (left, right), party, radius, speed, is_aware, phase
        )

    def stop(self, body: PhysicsBody, is_stopped: bool) -> None:
        """Stops a person, or lets it return to its route."""
        self._core.stop_crowd_person(self.id, body.id, is_stopped)

    def send(self, body: PhysicsBody, waypoint: int) -> None:
        """Lets a person walk to a waypoint and stop there."""
        self._core.send_crowd_person(self.id, body.id, waypoint)

    @property
    def people(self) -> list[PersonState]:
        """All people whose bodies exist, in the order in which they were added."""
        return [PersonState(*row) for row in self._core.crowd_people(self.id)]

    @property
    def state(self) -> DoubleArray:
        """Everything besides bodies that affects the future, as numbers."""
        return self._core.crowd_state(self.id)


class HalfPlane(NamedTuple):
    """The vectors v with normal * v >= offset.

    Attributes:
        normal: A unit vector.
        offset: The offset.
    """

    normal: Vector2
    offset: float


def repulsion(offset: Vector2, velocity: Vector2, **numbers: float) -> Vector2:
    """Returns the acceleration by another person in the social force model [m/s²].

    Args:
        offset: From the other person to this one [m].
        velocity: That of the other person [m/s].
        **numbers: Parameters as for `Crowd.create`.
    """
    return _core.crowd_repulsion(offset, velocity, numbers)


def wall_repulsion(offset: Vector2, radius: float, **numbers: float) -> Vector2:
    """Returns the acceleration by a wall in the social force model [m/s²].

    Args:
        offset: From the nearest point of the wall to the person [m].
        radius: Radius of the person [m].
        **numbers: Parameters as for `Crowd.create`.
    """
    return _core.crowd_wall_repulsion(offset, radius, numbers)


def avoid(disc: Disc, other: Disc, *, horizon: float, share: float, dt: float) -> HalfPlane:
    """Returns the velocities of a disc that avoid another one, by ORCA.

    Args:
        disc: The disc.
        other: The other one.
        horizon: Time for which a collision is avoided [s].
        share: Share of the necessary change of the velocity, from 0 to 1.
        dt: Time in which an overlap is resolved [s].
    """
    normal, offset = _core.crowd_avoid(disc, other, horizon, share, dt)
    return HalfPlane(normal, offset)


def nearest_point(
    planes: Sequence[HalfPlane], preferred: Vector2, *, radius: float, hard: int = 0
) -> Vector2:
    """Returns the point of several half-planes and a disc that is nearest to another point.

    Args:
        planes: The half-planes.
        preferred: The other point.
        radius: Radius of the disc around the origin.
        hard: Number of half-planes at the front that must not be violated. If there is no such
            point, the greatest violation of the others is minimal.
    """
    return _core.nearest_point(
        [(normal, offset) for normal, offset in planes], hard, radius, preferred
    )


def step_length(speed: float) -> float:
    """Returns the length of a step at a walking speed [m]."""
    return _core.step_length(speed)


def leg_offset(phase: float, speed: float) -> float:
    """Returns the position of the left leg along the heading, relative to the body [m]."""
    return _core.leg_offset(phase, speed)
