"""What environments have in common that take place on a stage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gymnasium.vector import VectorEnv

from flatland.geometry import DoubleArray
from flatland.gym.recreation import Recreated

if TYPE_CHECKING:
    from flatland.gym.episodes import Episodes
    from flatland.gym.stage import Image, Stage
    from flatland.gym.tasks import Task
    from flatland.world import World


class Staged(Recreated):
    """An environment whose worlds and episodes are those of a stage."""

    _stage: Stage

    @property
    def task(self) -> Task:
        """The task, settable: starts and goals of all further episodes.

        Running episodes keep their goals; the `goal_radius` applies at once. A task that is
        impossible in a building is a `WorldError`, and the previous one remains.
        """
        return self._stage.episodes.settings.task

    @task.setter
    def task(self, task: Task) -> None:
        self._stage.set_task(task)
        self._replace_argument("task", task)

    @property
    def episodes(self) -> Episodes:
        """The episodes: agents, settings, and the layout of the observation."""
        return self._stage.episodes


class StagedVector(Staged, VectorEnv[Any, Any, Any]):
    """A vector of environments, one for each robot on a stage."""

    @property
    def worlds(self) -> tuple[World, ...]:
        """The worlds, which must be stepped only by the vector.

        With several buildings, each episode may be in another world.
        """
        return tuple(self._stage.worlds)

    @property
    def poses(self) -> DoubleArray:
        """A copy of the poses (x, y, theta) of all robots in the world frame, shape (num_envs, 3).

        They are those of the last observations [m, m, rad].
        """
        return self.episodes.situation.poses.copy()

    @property
    def goals(self) -> DoubleArray:
        """A copy of all goals (x, y) in the world frame [m], shape (num_envs, 2)."""
        return self.episodes.situation.goals.copy()

    def render(self) -> tuple[Image, ...] | None:
        """Returns an image of each world for `rgb_array`; for `human`, shows all worlds.

        Raises:
            ClosedEnvironmentError: The environments are closed.
            FlatlandError: The viewer cannot listen on its port, or matplotlib is missing.
        """
        images = self._stage.render()
        return None if images is None else tuple(images)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002 - as in the base class
        """Closes all worlds and their views."""
        self._stage.close()
