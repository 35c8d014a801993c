"""What environments have in common that take place on a stage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.checks import shown
from flatland.gym.recreation import Recreated

if TYPE_CHECKING:
    from flatland.gym.episodes import Episodes
    from flatland.gym.stage import Stage
    from flatland.gym.tasks import Task


def episodes_of(env: object) -> Episodes:
    """Returns the episodes of an environment or a vector, also within wrappers.

    Raises:
        TypeError: It is another environment.
    """
    inner = getattr(env, "unwrapped", None)
    if not isinstance(inner, Staged):
        raise TypeError(f"env must be a FlatlandEnv or a FlatlandVectorEnv, got {shown(env)}")
    return inner.episodes


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
