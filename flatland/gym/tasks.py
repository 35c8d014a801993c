"""Tasks: where an episode starts and what its goal is."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from flatland.checks import checked_not_negative, checked_positive, plain_numbers, shown
from flatland.errors import WorldError
from flatland.geometry import Pose, Vector2, finite_place, finite_pose
from flatland.gym.places import Places, random_pose

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.physics import PhysicsBody


@dataclass(slots=True)
class Occupied:
    """The places that other agents of the same start occupy.

    Attributes:
        goals: Their goals in the world frame [m].
        unplaced: Bodies of agents that have not been placed yet, which may be overlapped.
    """

    goals: list[Vector2] = field(default_factory=list)
    unplaced: Iterable[PhysicsBody] = ()


class Task(ABC):
    """Chooses the start and the goal of each episode.

    Attributes:
        goal_radius: Distance to the goal at which an agent has arrived [m].
    """

    goal_radius: float = 0.3
    _places: Places | None = None

    def prepare(self, agent: Agent) -> None:  # noqa: B027 - a task may need nothing
        """Prepares what all episodes in a building share; called for one of its equal worlds.

        Raises:
            WorldError: The task is impossible in this world.
        """

    @property
    def places(self) -> Places:
        """The free places.

        Raises:
            WorldError: The task was not prepared for a world with walls.
        """
        if self._places is None:
            raise WorldError("the task was not prepared for a world with walls")
        return self._places

    def check_paths(self, start: Pose, goal: Vector2) -> None:
        """Checks that a path leads to a start and a goal, if the task has free places.

        Args:
            start: Pose in the world frame [m, rad].
            goal: Place in the world frame [m].

        Raises:
            WorldError: There is none.
        """
        if self._places is not None:
            self._places.check_path("start", start)
            self._places.check_path("goal", goal)

    @abstractmethod
    def draw(
        self, agent: Agent, rng: np.random.Generator, occupied: Occupied
    ) -> tuple[Pose, Vector2]:
        """Returns the start pose and the goal of an episode, in the world frame [m, rad].

        Args:
            agent: The agent, whose world is in its initial state.
            rng: The only source of random numbers: equal states give equal episodes.
            occupied: The places that other agents of the world occupy.

        Raises:
            WorldError: There is no room.
        """


class RandomGoal(Task):
    """A random start and a random goal, both free and within reach of each other.

    The start is uniform over the free space that the agent can reach from its place in the world
    file; the goal is uniform over the part of this space at the right distance from the start.

    There is a path to the goal that leaves the rectangle around start and goal by at most a margin.
    This excludes goals behind a wall whose door is far away, which require a planner with a map.

    Attributes:
        distance: Least and greatest distance of the goal from the start, along a straight line [m].
        margin: Distance by which the path may leave the rectangle [m]; None for any path.
        clearance: Distance of starts and goals from walls and models [m].
    """

    def __init__(
        self,
        distance: tuple[float, float] = (1.0, 5.0),
        clearance: float = 0.15,
        goal_radius: float = 0.3,
        margin: float | None = 0.5,
        origin: Vector2 | None = None,
    ) -> None:
        """Creates the task.

        Args:
            distance: Least and greatest distance of the goal from the start [m].
            clearance: Distance of starts and goals from walls and models [m].
            goal_radius: Distance to the goal at which an agent has arrived [m].
            margin: Distance by which a path may leave the rectangle around start and goal [m]; None
                for any path.
            origin: A place from which all others can be reached [m]; None for the agent's place.

        Raises:
            ValueError: A number is out of range.
        """
        self.goal_radius = checked_positive("goal_radius", goal_radius, "m")
        lengths = plain_numbers(distance, (2,))
        if lengths is None or not self.goal_radius <= lengths[0] < lengths[1] < math.inf:
            raise ValueError(
                "distance must be two increasing lengths of at least the goal_radius of "
                f"{self.goal_radius:g} m, got {shown(distance)}"
            )
        self.distance = (lengths[0], lengths[1])
        self.margin = None if margin is None else checked_not_negative("margin", margin, "m")
        self.clearance = checked_not_negative("clearance", clearance, "m")
        self.origin = None if origin is None else finite_place("origin", origin)

    def prepare(self, agent: Agent) -> None:
        """Prepares the free places of the map."""
        self._places = Places(agent, self.clearance, self.origin)

    def draw(
        self, agent: Agent, rng: np.random.Generator, occupied: Occupied
    ) -> tuple[Pose, Vector2]:
        """Draws start and goal; a start without any goal at the right distance is drawn again."""
        places = self.places
        for last in (False, False, False, True):
            start = random_pose(places.draw(agent, rng, ignored=occupied.unplaced), rng)
            try:
                goal = places.draw(
                    agent,
                    rng,
                    near=start,
                    distance=self.distance,
                    margin=self.margin,
                    ignored=occupied.unplaced,
                    apart_from=occupied.goals,
                )
            except WorldError:
                if last:
                    raise
            else:
                return start, goal
        raise AssertionError("unreachable")


class FixedGoal(Task):
    """The same start and goal in each episode."""

    def __init__(
        self, start: Sequence[float], goal: Sequence[float], goal_radius: float = 0.3
    ) -> None:
        """Creates the task.

        Args:
            start: Pose (x, y, theta) in the world frame [m, rad].
            goal: Place (x, y) in the world frame [m].
            goal_radius: Distance to the goal at which an agent has arrived [m].

        Raises:
            ValueError: A number is out of range.
        """
        self.goal_radius = checked_positive("goal_radius", goal_radius, "m")
        self.start = finite_pose(start, "start")
        self.goal = finite_place("goal", goal)

    def prepare(self, agent: Agent) -> None:
        """Checks that a path leads from the start to the goal, in a world with walls.

        Raises:
            WorldError: There is none.
        """
        if any(len(layer.edges) for layer in agent.world.layers):
            self._places = Places(agent, 0.0)
            self.check_paths(self.start, self.goal)

    def check_paths(self, start: Pose, goal: Vector2) -> None:
        """Checks that a path leads from a start to a goal, in a world with walls."""
        if self._places is not None:
            self._places.check_path("goal", goal, start)

    def draw(
        self,
        agent: Agent,  # noqa: ARG002 - nothing is drawn
        rng: np.random.Generator,  # noqa: ARG002
        occupied: Occupied,  # noqa: ARG002
    ) -> tuple[Pose, Vector2]:
        """Returns the start and the goal."""
        return self.start, self.goal
