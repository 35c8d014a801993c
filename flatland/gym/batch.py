"""The agents of many worlds, stepped and scanned by the core."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
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
    """Performs a step of an environment in one call of the core, for all worlds that permit it.

    A world is excluded from a step while something observes it or waits for its next step, such as
    a request of a viewer or a plugin that was just reset. The results are the same then.
    """

    def __init__(self, agents: Sequence[Agent], situation: Situation, num_threads: int) -> None:
        """Prepares the agents.

        Args:
            agents: The agents, for which `is_possible` is true; each world has the same number of
                neighbours. If elements are replaced, `agent_changed` must be called.
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
        self._team_size = n // len({id(agent.world) for agent in agents})
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
            all(agent.controller is not None for agent in agents)
            and not any(agent.laser.measures_intensities for agent in agents)
            and bool((np.abs([low, high]) <= MAX_COMMAND).all())
        )

    def perform(
        self,
        commands: DoubleArray,
        acting: BoolArray | None,
        observed: BoolArray | None,
        n: int,
        meanwhile: Callable[[], object],
    ) -> Rows:
        """Carries out commands for some steps of the worlds, and observes agents.

        Args:
            commands: Forward and sideways velocity and yaw rate of each agent, or speed, 0 and
                steering angle [m/s, rad/s, rad], shape (n, 3).
            acting: Agents that act, shape (n,); None for all. Worlds in which no agent acts are not
                stepped.
            observed: Agents that are observed, shape (n,); None for all.
            n: Number of steps.
            meanwhile: Called while other threads step; it may change the worlds in which no agent
                acts, and replace their agents. They are observed afterwards.

        Returns:
            The agents that remain to be observed.

        Raises:
            Exception: As `World.step`, or raised by `meanwhile`.
        """
        acting = self._all if acting is None else acting
        observed = self._all if observed is None else observed
        # Code of a plugin that calls this holds the lock already.
        is_free = not self._requests.lock.is_owned
        with self._requests.lock:
            refused = self._not_permitted(acting, is_free)
            alone, observes = acting, observed
            standing = self._standing(acting)
            if standing is not None:
                observes = observes & ~standing
            if refused:
                permitted = np.ones(len(acting), np.bool_)
                permitted[refused] = False
                alone, observes = alone & permitted, observes & permitted
            self._start(commands, alone, observes, n)
            idle: list[int] = []
            try:
                meanwhile()
                if standing is not None:
                    idle = self._observe_beside((standing & observed).nonzero()[0].tolist())
                    # For the next call, since this one waits for the other threads in any case.
                    if is_free:
                        self._not_permitted(standing, True)
            finally:
                unfinished = self._finish(observes)
                np.copyto(self._commands, commands, where=alone[:, np.newaxis])
                self._counts += alone
                self._complete(unfinished, n)
        if refused:
            rows = [row for row in refused if acting[row]]
            step_agents([self._agents[row] for row in rows], commands[rows], n, self._num_threads)
        incomplete = self._teams(unfinished)
        for row in (*refused, *incomplete):
            if acting[row]:
                self._situation.collided[row] = self._agents[row].touches.touched
        left = [row for row in (*incomplete, *idle) if observed[row]]
        return self._observe(left, [row for row in refused if observed[row]])

    def _team(self, row: int) -> range:
        """Returns the agents of the world of an agent."""
        first = row - row % self._team_size
        return range(first, first + self._team_size)

    def _teams(self, rows: Iterable[int]) -> list[int]:
        """Returns all agents of some worlds, each of which is given by one agent."""
        return [each for row in rows for each in self._team(row)]

    def _standing(self, acting: BoolArray) -> BoolArray | None:
        """Returns the agents of the worlds in which no agent acts, shape (n,); None for none."""
        if acting is self._all:
            return None
        standing = ~acting
        if self._team_size == 1:
            return standing
        return np.repeat(standing.reshape(-1, self._team_size).all(axis=1), self._team_size)

    def _not_permitted(self, acting: BoolArray, is_free: bool) -> list[int]:
        """Permits the core to step worlds alone, where this is possible.

        Args:
            acting: Agents whose worlds are to step, shape (n,).
            is_free: Whether the caller may permit anything.

        Returns:
            All agents of the worlds that have no permission.
        """
        refused: list[int] = []
        examined = range(0)
        for row in self._core.not_permitted(acting):
            if row in examined:
                continue
            examined = self._team(row)
            if not (is_free and self._permit(examined)):
                refused.extend(examined)
        return refused

    def _observe_beside(self, rows: list[int]) -> list[int]:
        """Observes agents of other worlds, while these step; returns those that remain."""
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
            acts, observes = np.zeros((2, len(agents)), np.bool_)
            observes[chosen] = True
            self._start(self._commands, acts, observes, 0)
            for error in self._finish(observes).values():
                if isinstance(error, Exception):
                    raise error
        return np.array(sorted({*rows, *others} - set(chosen)), np.intp)

    def _permit(self, rows: range) -> bool:
        """Permits the core to step the world of some agents alone, if this is possible."""
        team, first = [self._agents[row] for row in rows], self._agents[0].world
        world = team[0].world
        for agent in team:
            agent.command.settle()
        for row in rows:
            self._core.permit(row)
        if (
            all(agent.command.on_set is None for agent in team)
            and world.velocity_iterations == first.velocity_iterations
            and world.position_iterations == first.position_iterations
            and not world.physics.has_materials
            and world.stepping.prepare_unattended()
        ):
            for row, agent in zip(rows, team, strict=True):
                twist = agent.command.value
                self._commands[row] = twist.linear_x, twist.linear_y, twist.angular_z
                agent.command.follow(_Commands(self._commands, self._counts, row, world))
                agent.laser.last_scan = None
            return True
        for row in rows:
            self._core.withdraw(row)
        return False

    def _start(self, commands: DoubleArray, acts: BoolArray, observes: BoolArray, n: int) -> None:
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
            acts,
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
        """Completes what was begun; returns the worlds with steps that remain, by an agent."""
        unfinished = dict(self._core.finish())
        incomplete = set(self._teams(unfinished))
        for row in self._noisy:
            if observes[row] and row not in incomplete:
                self._agents[row].laser.count_computed()
        return unfinished

    def _complete(self, unfinished: dict[int, RunResult | Exception], n: int) -> None:
        """Completes n steps of worlds; raises the exception of the first one that fails."""
        error: BaseException | None = None
        for row, result in unfinished.items():
            for each in self._team(row):
                self._core.withdraw(each)
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
