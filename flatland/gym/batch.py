"""The agents of an environment with a world for each agent, stepped and scanned by the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flatland.physics import AgentBatch, Run
from flatland.plugin_api.drive import MAX_COMMAND
from flatland.runtime.batch import step_worlds
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import BoolArray, DoubleArray
    from flatland.gym.agents import Agent
    from flatland.gym.situation import Rows, Situation
    from flatland.physics import RunResult
    from flatland.world import World


_NO_ROWS = np.empty(0, np.intp)


class Batch:
    """Performs a step of an environment in one call of the core, for all agents that permit it.

    An agent is excluded from a step while something observes its world or waits for its next step,
    such as a request of a viewer or a plugin that was just reset. Its results are the same then.
    """

    def __init__(self, agents: Sequence[Agent], situation: Situation, num_threads: int) -> None:
        """Prepares the agents.

        Args:
            agents: The agents, for which `is_possible` is true. If elements are replaced,
                `agents_changed` must be called.
            situation: Receives what the agents observe.
            num_threads: Number of threads that step and scan, 0 for one per core.
        """
        self._agents = agents
        self._situation = situation
        self._num_threads = num_threads
        self._is_current = False
        self._order: list[int] = []
        self._noisy: list[int] = []
        self._noises = np.zeros((len(agents), 2), np.uint64)  # see `Laser.next_computed`
        self._sensor_poses = np.zeros((len(agents), 3))
        self._ranges = list(situation.ranges)  # a view of each row

    def agents_changed(self) -> None:
        """Reads the agents again before the next step."""
        self._is_current = False

    def _read_agents(self) -> None:
        agents = self._agents
        self._is_current = True
        # Threads that step overlapping sets of worlds lock them in the same order.
        self._order = sorted(range(len(agents)), key=lambda row: id(agents[row].world))
        self._core = AgentBatch(
            [
                (agent.body.physics, agent.controller, agent.touches, agent.laser.finder)
                for agent in agents
                if agent.controller is not None
            ]
        )
        self._noisy = [row for row, agent in enumerate(agents) if agent.laser.has_noise]

    @staticmethod
    def is_possible(agents: Sequence[Agent], low: DoubleArray, high: DoubleArray) -> bool:
        """Returns whether the core can step agents.

        Args:
            agents: The agents.
            low: Lowest command, see `Action.bounds`.
            high: Highest command.
        """
        return (
            len({id(agent.world) for agent in agents}) == len(agents)
            and all(agent.controller is not None for agent in agents)
            and not any(agent.laser.measures_intensities for agent in agents)
            and bool((np.abs([low, high]) <= MAX_COMMAND).all())
        )

    def perform(self, commands: DoubleArray, acting: BoolArray, n: int) -> Rows:
        """Carries out commands for some steps of the worlds, and observes all agents.

        Args:
            commands: Forward and sideways velocity and yaw rate of each agent, or speed, 0 and
                steering angle [m/s, rad/s, rad], shape (n, 3).
            acting: Agents that act, shape (n,); the worlds of others are not stepped.
            n: Number of steps.

        Returns:
            The agents that remain to be observed.

        Raises:
            Exception: As `World.step`.
        """
        if not self._is_current:
            self._read_agents()
        agents = self._agents
        timekeeper = agents[0].world.timekeeper
        first = agents[0].world
        velocity, position = first.velocity_iterations, first.position_iterations
        run = Run(
            0, timekeeper.step_size_ns, n, timekeeper.step_size, velocity, position, False, False
        )
        steps, observes = acting.copy(), np.ones(len(agents), np.bool_)
        begun: list[int] = []
        others: list[int] = []
        unfinished: dict[int, RunResult | Exception] = {}
        made = 0
        is_acting, values = acting.tolist(), commands.tolist()
        try:
            for row in self._order:
                if not is_acting[row]:
                    continue
                agent = agents[row]
                world = agent.world
                if (
                    agent.command.on_set is None
                    and world.velocity_iterations == velocity
                    and world.position_iterations == position
                    and not world.physics.has_materials
                    and world.stepping.begin_unattended()
                ):
                    begun.append(row)
                    agent.command.assign(Twist(*values[row]))
                else:
                    others.append(row)
            if others:
                steps[others] = observes[others] = False
            unfinished = self._call_core(run, commands, steps, observes)
            made = n
        finally:
            results = [unfinished.get(row) for row in begun]
            _end([agents[row].world for row in begun], made, results)
        if not others and not unfinished:
            return _NO_ROWS
        step_agents([agents[row] for row in others], commands[others], n, self._num_threads)
        rest = sorted([*others, *unfinished])
        self._situation.collided[rest] = [agents[row].touches.touched for row in rest]
        return np.array(rest, np.intp)

    def _call_core(
        self, run: Run, commands: DoubleArray, steps: BoolArray, observes: BoolArray
    ) -> dict[int, RunResult | Exception]:
        agents, s = self._agents, self._situation
        for row in self._noisy:
            self._noises[row] = agents[row].laser.next_computed
        unfinished = dict(
            self._core.perform(
                run,
                steps,
                observes,
                np.ascontiguousarray(commands),
                np.array([agent.world.timekeeper.sim_time_ns for agent in agents], np.int64),
                self._noises,
                s.poses,
                s.velocities,
                self._sensor_poses,
                s.ranges,
                s.collided,
                self._num_threads,
            )
        )
        observed = observes.tolist()
        for row, (x, y, theta) in enumerate(self._sensor_poses.tolist()):
            if observed[row] and row not in unfinished:
                agents[row].laser.count_computed((x, y, theta), self._ranges[row])
        return unfinished


def step_agents(agents: Sequence[Agent], commands: DoubleArray, n: int, num_threads: int) -> None:
    """Carries out commands by steps of the worlds of agents, which may share worlds.

    Args:
        agents: The agents; their collected contacts are cleared first.
        commands: Commands of the agents, as for `Batch.perform`, shape (len(agents), 3).
        n: Number of steps.
        num_threads: Number of threads, 0 for one per core.

    Raises:
        Exception: As `World.step`.
    """
    for agent, command in zip(agents, commands.tolist(), strict=True):
        agent.command.set(Twist(*command))
        agent.touches.clear()
    worlds = list({id(agent.world): agent.world for agent in agents}.values())
    step_worlds(worlds, n, num_threads)


def _end(worlds: list[World], n: int, results: list[RunResult | Exception | None]) -> None:
    """Completes n steps of worlds; raises the exception of the first one that fails."""
    error: BaseException | None = None
    for world, result in zip(worlds, results, strict=True):
        try:
            world.stepping.end_unattended(n, result)
        except BaseException as raised:
            error = error or raised
    if error is not None:
        raise error
