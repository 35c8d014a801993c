"""The agents of an environment with a world for each agent, stepped and scanned by the core."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from flatland.physics import AgentBatch, Run
from flatland.plugin_api.drive import MAX_COMMAND
from flatland.runtime.batch import step_worlds
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.geometry import BoolArray, DoubleArray
    from flatland.gym.agents import Agent
    from flatland.gym.situation import Rows, Situation
    from flatland.physics import Controller, PhysicsBody, RangeFinder, RunResult, Touches
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
                `agent_changed` must be called.
            situation: Receives what the agents observe.
            num_threads: Number of threads that step and scan, 0 for one per core.
        """
        n = len(agents)
        self._agents = agents
        self._situation = situation
        self._num_threads = num_threads
        self._core = AgentBatch([_core_of(agent) for agent in agents])
        # One thread at a time uses the worlds, and holds the lock of all of them.
        self._requests = agents[0].world.requests
        self._all = np.ones(n, np.bool_)
        self._commands = np.zeros((n, 3))
        self._counts = np.zeros(n, np.int64)  # of commands of each agent
        self._noises = np.zeros((n, 2), np.uint64)  # see `Laser.next_computed`
        self._sensor_poses = np.zeros((n, 3))
        self._noisy: set[int] = set()
        for row in range(n):
            self._adopt(row)

    def agent_changed(self, row: int) -> None:
        """Uses the present agent with an index, which was replaced."""
        self._core.replace(row, _core_of(self._agents[row]))
        self._adopt(row)

    def _adopt(self, row: int) -> None:
        agent = self._agents[row]
        agent.world.requests.share_lock(self._requests)
        (self._noisy.add if agent.laser.has_noise else self._noisy.discard)(row)

    def close(self) -> None:
        """Ends the threads; a further step starts new ones."""
        self._core.stop_threads()

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

    def perform(
        self,
        commands: DoubleArray,
        acting: BoolArray | None,
        n: int,
        meanwhile: Callable[[], object],
    ) -> Rows:
        """Carries out commands for some steps of the worlds, and observes all agents.

        Args:
            commands: Forward and sideways velocity and yaw rate of each agent, or speed, 0 and
                steering angle [m/s, rad/s, rad], shape (n, 3).
            acting: Agents that act, shape (n,); None for all. The worlds of others are not stepped.
            n: Number of steps.
            meanwhile: Called while other threads step; it may change the worlds of agents that do
                not act, and replace these agents. They are observed afterwards.

        Returns:
            The agents that remain to be observed.

        Raises:
            Exception: As `World.step`, or raised by `meanwhile`.
        """
        # Code of a plugin that calls this holds the lock already.
        is_free = not self._requests.lock.is_owned
        with self._requests.lock:
            others = [
                row
                for row in self._core.not_permitted(self._all if acting is None else acting)
                if not (is_free and self._permit(row))
            ]
            alone = self._all if acting is None else acting
            if others:
                alone = alone.copy()
                alone[others] = False
            self._start(commands, alone, alone, n)
            idle: list[int] = []
            try:
                meanwhile()
                if acting is not None:
                    standing = ~acting
                    idle = self._observe_beside(standing.nonzero()[0].tolist())
                    # For the next call, since this one waits for the other threads in any case.
                    for row in self._core.not_permitted(standing) if is_free else ():
                        self._permit(row)
            finally:
                unfinished = self._finish(alone)
                if alone is self._all:
                    self._commands[:] = commands
                else:
                    self._commands[alone] = commands[alone]
                self._counts += alone
                self._complete(unfinished, n)
        if others:
            agents = [self._agents[row] for row in others]
            step_agents(agents, commands[others], n, self._num_threads)
        for row in (*others, *unfinished):
            self._situation.collided[row] = self._agents[row].touches.touched
        return self._observe([*unfinished, *idle], others)

    def _observe_beside(self, rows: list[int]) -> list[int]:
        """Observes agents that do not act, while others step; returns those that remain."""
        agents = self._agents
        chosen = [row for row in rows if not agents[row].world.physics.has_materials]
        noisy = [row for row in chosen if row in self._noisy]
        for row in noisy:
            self._noises[row] = agents[row].laser.next_computed
        self._core.observe(chosen)
        for row in noisy:
            agents[row].laser.count_computed()
        return [row for row in rows if row not in chosen]

    def _observe(self, rows: Sequence[int], others: Sequence[int]) -> Rows:
        """Observes agents; returns those for which the core cannot do this, and others."""
        if not rows and not others:
            return _NO_ROWS
        agents = self._agents
        chosen = [row for row in rows if not agents[row].world.physics.has_materials]
        if chosen:
            steps, observes = np.zeros((2, len(agents)), np.bool_)
            observes[chosen] = True
            self._start(self._commands, steps, observes, 0)
            for error in self._finish(observes).values():
                if isinstance(error, Exception):
                    raise error
        return np.array(sorted({*rows, *others} - set(chosen)), np.intp)

    def _permit(self, row: int) -> bool:
        """Permits the core to step the world of an agent alone, if this is possible."""
        agent, first = self._agents[row], self._agents[0].world
        world = agent.world
        agent.command.settle()
        self._core.permit(row)
        if (
            agent.command.on_set is None
            and world.velocity_iterations == first.velocity_iterations
            and world.position_iterations == first.position_iterations
            and not world.physics.has_materials
            and world.stepping.prepare_unattended()
        ):
            twist = agent.command.value
            self._commands[row] = twist.linear_x, twist.linear_y, twist.angular_z
            agent.command.follow(_Commands(self._commands, self._counts, row, world))
            agent.laser.last_scan = None
            return True
        self._core.withdraw(row)
        return False

    def _start(self, commands: DoubleArray, steps: BoolArray, observes: BoolArray, n: int) -> None:
        """Begins to carry out commands by n steps, and to observe agents."""
        agents, s = self._agents, self._situation
        world, timekeeper = agents[0].world, agents[0].world.timekeeper
        for row in self._noisy:
            self._noises[row] = agents[row].laser.next_computed
        self._core.start(
            Run(
                0,
                timekeeper.step_size_ns,
                n,
                timekeeper.step_size,
                world.velocity_iterations,
                world.position_iterations,
                False,
                False,
            ),
            steps,
            observes,
            np.ascontiguousarray(commands),
            self._noises,
            s.poses,
            s.velocities,
            self._sensor_poses,
            s.ranges,
            s.collided,
            self._num_threads,
        )

    def _finish(self, observes: BoolArray) -> dict[int, RunResult | Exception]:
        """Completes what was begun; returns the rows with steps that remain."""
        unfinished = dict(self._core.finish())
        for row in self._noisy:
            if observes[row] and row not in unfinished:
                self._agents[row].laser.count_computed()
        return unfinished

    def _complete(self, unfinished: dict[int, RunResult | Exception], n: int) -> None:
        """Completes n steps of worlds; raises the exception of the first one that fails."""
        error: BaseException | None = None
        for row, result in unfinished.items():
            self._core.withdraw(row)
            try:
                self._agents[row].world.stepping.continue_unattended(n, result)
            except BaseException as raised:
                error = error or raised
        if error is not None:
            raise error


class _Commands:
    """The commands that the core passes to the drive of an agent."""

    __slots__ = ("_commands", "_counts", "_first", "_row", "_world")

    def __init__(
        self, commands: DoubleArray, counts: npt.NDArray[np.int64], row: int, world: World
    ) -> None:
        self._commands, self._counts, self._row = commands, counts, row
        self._first = int(counts[row])
        self._world = world

    @property
    def value(self) -> Twist:
        return Twist(*self._commands[self._row].tolist())

    @property
    def received(self) -> int:
        return int(self._counts[self._row]) - self._first

    def settled(self) -> None:
        self._world.physics.jobs.interrupt()


def _core_of(agent: Agent) -> tuple[PhysicsBody, Controller, Touches, RangeFinder]:
    controller = agent.controller
    if controller is None:
        raise ValueError(f'the core cannot command model "{agent.model.name}"')
    return agent.body.physics, controller, agent.touches, agent.laser.finder


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
