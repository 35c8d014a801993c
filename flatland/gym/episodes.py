"""The episodes of several agents: the part that all environments share."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from flatland.checks import checked_positive, shown
from flatland.errors import WorldError
from flatland.geometry import (
    BoolArray,
    DoubleArray,
    FloatArray,
    Pose,
    Vector2,
    finite_place,
    finite_pose,
)
from flatland.gym.agents import check_alike
from flatland.gym.batch import Batch, step_agents
from flatland.gym.endings import as_ending, endings_of
from flatland.gym.rewards import as_reward, rewards_of
from flatland.gym.situation import Rows, Situation
from flatland.gym.tasks import Occupied, Task
from flatland.plugins.laser import compute_scans
from flatland.runtime.placement import TOLERANCE

if TYPE_CHECKING:
    from flatland.gym.agents import Agent
    from flatland.gym.settings import Settings


class Episodes:
    """Agents of one or several worlds, whose episodes begin and advance.

    The numbers of a row are a function of its world, for any number of rows. The results of a
    vector of environments therefore equal those of single environments, bit by bit.

    Attributes:
        agents: The agents.
        settings: The arguments of the environment.
        situation: Their state after the last step.
        layout: The observation space and its columns.
        randomization: The domain randomization, prepared for the agents.
        observations: The observations of the last `look`, shape (n, layout.size), float32.
    """

    def __init__(
        self,
        agents: Sequence[Agent],
        settings: Settings,
        num_threads: int,
        buildings: Sequence[int],
        firsts: Sequence[Agent],
    ) -> None:
        """Prepares the episodes; the worlds are in the state at the start of each episode.

        Args:
            agents: The agents, each in a world of its own or all in the same.
            settings: The task, the observation, the action and the reward.
            num_threads: Number of threads that step and scan, 0 for one per core.
            buildings: Index of the building of each agent.
            firsts: An agent of each building.

        Raises:
            WorldError: The task is impossible in a building, or the agents differ.
            ValueError: The observation does not fit the laser.
        """
        first = agents[0]
        self.agents = list(agents)
        self.settings = settings
        self._reward = as_reward("reward", settings.reward)
        self._ending = as_ending("ending", settings.ending)
        self._num_threads = num_threads
        self._buildings = list(buildings)
        self._tasks = [_prepared(settings.task, agent) for agent in firsts]
        check_alike(firsts)
        for agent in firsts:
            settings.randomization.check(agent)
        beams = first.laser.angles.count
        self.layout = settings.observation.layout(beams)
        low, high = settings.action.bounds(first)
        for agent in firsts:
            if not np.array_equal(settings.action.bounds(agent), (low, high)):
                raise WorldError("the drives of the agents must have the same limits")
        n = len(agents)
        limits = settings.action.velocity_limits(first)
        self.situation = Situation(n, beams, first.laser.range, low, high, limits)
        self.situation.agents = self.agents
        self.layout.prepare(self.situation)
        self.randomization = copy.copy(settings.randomization)
        self.randomization.prepare(n, beams, self.layout.size)
        self._present: FloatArray = np.zeros((n, self.layout.size), np.float32)
        self.observations = self._present  # or earlier ones, with latency
        self._lasers = [agent.laser for agent in agents]
        self._batch = None
        if Batch.is_possible(agents, low, high) and all(
            Batch.is_possible([agent], low, high) for agent in firsts
        ):
            self._batch = Batch(self.agents, self.situation, num_threads)
        self._all = np.arange(n)
        self._half_range = 0.5 * (high - low)

    def close(self) -> None:
        """Ends the threads that step and scan."""
        if self._batch is not None:
            self._batch.close()

    @property
    def goal_radius(self) -> float:
        """Distance to the goal at which an agent has arrived [m]."""
        return self._tasks[0].goal_radius

    def set_task(self, task: Task, firsts: Sequence[Agent]) -> None:
        """Replaces the task of all further episodes.

        Args:
            task: The task.
            firsts: An agent of each building, whose worlds are in the state at the start.

        Raises:
            TypeError: It is no task.
            WorldError: The task is impossible in a building; the previous one remains.
        """
        settings = replace(self.settings, task=task)
        self._tasks = [_prepared(task, agent) for agent in firsts]
        self.settings = settings

    def replace(self, row: int, agent: Agent, building: int) -> None:
        """Replaces an agent by one of another world, whose next episode begins.

        Args:
            row: Index of the agent.
            agent: The other agent.
            building: Index of its building.
        """
        self.agents[row] = agent
        self._lasers[row] = agent.laser
        self._buildings[row] = building
        if self._batch is not None:
            self._batch.agent_changed(row)

    def begin(
        self, row: int, rng: np.random.Generator, occupied: Occupied, options: Mapping[str, Any]
    ) -> None:
        """Begins an episode of an agent whose world is in its initial state.

        Args:
            row: Index of the agent.
            rng: Source of all random numbers.
            occupied: The places that other agents of the world occupy.
            options: `start`, a pose, and `goal`, a place, instead of those of the task.

        Raises:
            WorldError: The start or the goal is not free, or no path leads there.
            TypeError: The task draws something else than a start and a goal.
            ValueError: An option is invalid.
        """
        agent, s = self.agents[row], self.situation
        self.randomization.begin(row, agent, rng)
        task = self._tasks[self._buildings[row]]
        start, goal = _drawn(task, agent, rng, occupied)
        start = finite_pose(options.get("start", start), "start")
        goal = finite_place("goal", options.get("goal", goal))
        self._refuse_taken(agent, start, goal, occupied)
        if options:
            task.check_paths(start, goal)
        # Agents that have not been placed yet may overlap the start.
        agent.world.move_model(agent.model.name, start, "allow")
        s.goals[row] = goal
        s.steps[row] = 0
        s.actions[row] = s.previous_actions[row] = 0.0
        s.collided[row] = False

    @staticmethod
    def _refuse_taken(agent: Agent, start: Pose, goal: Vector2, occupied: Occupied) -> None:
        physics, bodies = agent.world.physics, agent.model.bodies
        unplaced = list(occupied.unplaced)
        if not physics.free_poses(bodies, [start], ignored=unplaced, least_gap=-TOLERANCE)[0]:
            x, y, theta = start
            raise WorldError(f"the start ({x:g}, {y:g}, {theta:g}) is not free")
        if not physics.free_discs(
            [(*goal, 0.0)], agent.radius, agent.bits, ignored=[*bodies, *unplaced]
        )[0]:
            raise WorldError(f"the goal ({goal[0]:g}, {goal[1]:g}) is not free")

    def read_actions(self, actions: object, n: int | None) -> DoubleArray:
        """Returns actions as numbers from -1 to 1; see `Action.read`.

        Raises:
            InvalidAction: The actions are not elements of the space.
        """
        numbers: DoubleArray = self.settings.action.read(
            actions, n, self.situation.low, self.situation.high
        )
        return numbers

    def step(
        self,
        actions: DoubleArray,
        rows: Rows | None = None,
        observed: Rows | None = None,
        meanwhile: Callable[[], object] = lambda: None,
    ) -> None:
        """Carries out actions for one step of the environment, and observes agents.

        Args:
            actions: Numbers in [-1, 1] of all agents, as `read_actions` returns them.
            rows: Agents that act; None for all. The others stand still.
            observed: Agents that must be observed; None for all.
            meanwhile: Called before the observation of the agents that do not act; may begin their
                next episodes.
        """
        s = self.situation
        commands = np.zeros((len(s), 3))
        numbers = s.low + (actions + 1.0) * self._half_range
        for i, column in enumerate(self.settings.action.columns):  # faster than an index array
            commands[:, column] = numbers[:, i]
        acting = self._mask_of(rows)
        if acting is None:
            s.previous_actions[:] = s.actions
            s.actions[:] = actions
            s.previous_distance[:] = s.distance
            s.steps += 1
        else:  # Faster than an index array.
            chosen = acting[:, np.newaxis]
            np.copyto(s.previous_actions, s.actions, where=chosen)
            np.copyto(s.actions, actions, where=chosen)
            np.copyto(s.previous_distance, s.distance, where=acting)
            s.steps += acting
        acting_rows = self._all if rows is None else rows
        self.randomization.change_commands(commands, s, acting_rows)
        n = self.settings.physics_steps
        if self._batch is None:
            meanwhile()
            agents = [self.agents[row] for row in acting_rows.tolist()]
            step_agents(agents, commands[acting_rows], n, self._num_threads)
            s.collided[acting_rows] = [agent.touches.touched for agent in agents]
            self.look(observed)
            return
        seen = self._mask_of(observed)
        self._measure(self._batch.perform(commands, acting, seen, n, meanwhile))
        self._observe(observed)

    def _mask_of(self, rows: Rows | None) -> BoolArray | None:
        if rows is None:
            return None
        mask = np.zeros(len(self._all), np.bool_)
        mask[rows] = True
        return mask

    def look(self, rows: Rows | None = None) -> None:
        """Performs scans and computes the observations.

        Args:
            rows: Agents whose observations are computed; None for all.
        """
        self._measure(self._all if rows is None else rows)
        self._observe(rows)

    def _measure(self, rows: Rows) -> None:
        """Reads poses and velocities of some agents, and performs scans."""
        if not len(rows):
            return
        s = self.situation
        bodies = [self.agents[row].body for row in rows.tolist()]
        s.poses[rows] = [body.pose for body in bodies]
        s.velocities[rows] = [body.velocity for body in bodies]
        if len(rows) == len(s):
            compute_scans(self._lasers, s.ranges, self._num_threads)
            return
        lasers = [self._lasers[row] for row in rows.tolist()]
        ranges = np.empty((len(rows), s.ranges.shape[1]), np.float32)
        compute_scans(lasers, ranges, self._num_threads)
        s.ranges[rows] = ranges

    def _observe(self, rows: Rows | None) -> None:
        """Computes the observations of some agents; None for all."""
        s = self.situation
        if rows is None:
            self.randomization.change_scans(s, self._all)
            s.locate(self.goal_radius)
            self.layout.write(s, self._present)
        else:
            self.randomization.change_scans(s, rows)
            part = s.take(rows)
            part.locate(self.goal_radius)
            observations = self._present[rows]
            self.layout.write(part, observations)
            self._present[rows] = observations
            s.put(rows, part)
        chosen = self._all if rows is None else rows
        self.observations = self.randomization.change_observations(self._present, s, chosen)

    def judge(self) -> tuple[DoubleArray, BoolArray, BoolArray]:
        """Returns rewards, which episodes terminated and which were truncated, (n,) each.

        Raises:
            TypeError: A custom reward or ending returned values of another type.
            ValueError: It returned another shape, NaN or infinite numbers.
        """
        s, settings = self.situation, self.settings
        rewards = rewards_of(self._reward, s)
        terminated = endings_of(self._ending, s)
        limit = math.inf if settings.max_steps is None else settings.max_steps
        truncated: BoolArray = (s.steps >= limit) & ~terminated
        return rewards, terminated, truncated

    def infos(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the info of all agents after their last step, arrays of shape (n,)."""
        s = self.situation
        return {"distance": s.distance, "is_success": s.arrived, "collision": s.collided}

    def info(self, row: int) -> dict[str, Any]:
        """Returns the info of one agent after its last step."""
        return {name: values[row].item() for name, values in self.infos().items()}


def _prepared(task: Task, agent: Agent) -> Task:
    """Returns a copy of a task that is prepared for the world of an agent."""
    prepared = copy.copy(task)
    prepared.prepare(agent)
    checked_positive(f"goal_radius of {type(task).__name__}", prepared.goal_radius, "m")
    return prepared


def _drawn(
    task: Task, agent: Agent, rng: np.random.Generator, occupied: Occupied
) -> tuple[Pose, Vector2]:
    """Returns the start and the goal that a task draws.

    Raises:
        TypeError: The task returns something else.
        WorldError: There is no room.
    """
    drawn = task.draw(agent, rng, occupied)
    try:
        start, goal = drawn
        return finite_pose(start), finite_place("goal", goal)
    except (TypeError, ValueError):
        raise TypeError(
            f"{type(task).__name__}.draw must return a start (x, y, theta) and a goal (x, y), got "
            f"{shown(drawn)}"
        ) from None
