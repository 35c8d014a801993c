"""Controllers that drive to a goal without learning, to compare policies with.

A controller is created for an environment, and called with an observation or with those of all
environments of a vector: `action = controller(observation)`. It uses nothing but the observation,
which must contain the parts `Scan` and `Goal`, and `Velocity` for `DynamicWindow`. It has no
memory.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from flatland import controllers
from flatland.controllers import Capabilities, Perception
from flatland.geometry import FloatArray
from flatland.gym.actions import VelocityAction, limit_to_unit
from flatland.gym.observations import Goal, ObservationPart, Scan, Velocity
from flatland.gym.staged import episodes_of

if TYPE_CHECKING:
    import gymnasium


class Controller:
    """Chooses actions from observations by a controller of `flatland.controllers`.

    Attributes:
        robot: The capabilities of the robot.
    """

    _kind: ClassVar[type[controllers.Controller]]
    _needs: ClassVar[tuple[type[ObservationPart], ...]] = (Scan, Goal)

    def __init__(
        self,
        env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any],
        **options: Any,
    ) -> None:
        """Reads the properties of the robot from an environment.

        Args:
            env: A `FlatlandEnv` or a `FlatlandVectorEnv`, also within wrappers that change neither
                observations nor actions.
            options: Options of the controller, see the class of the same name in
                `flatland.controllers`.

        Raises:
            TypeError: It is another environment.
            ValueError: The observation lacks a part, the action is no `VelocityAction`, or an
                option is out of range.
        """
        episodes = episodes_of(env)
        agent, situation = episodes.agents[0], episodes.situation
        if not isinstance(episodes.settings.action, VelocityAction):
            raise ValueError("controllers require environments with a VelocityAction")
        self.robot = Capabilities(agent.radius, situation.low, situation.high, episodes.settings.dt)
        self._layout = episodes.layout
        self._max_range: float = situation.max_range
        x, y, theta = agent.laser.origin
        c, s = math.cos(theta), math.sin(theta)
        self._beams = agent.laser.beam_ends / agent.laser.range @ np.array([[c, s], [-s, c]])
        self._sensor = np.array((x, y))
        for kind in self._needs:
            self._layout.find(kind)
        self._controller = self._kind(self.robot, **options)

    def __call__(self, observation: Any) -> FloatArray:
        """Returns the action for an observation, or the actions for several.

        Args:
            observation: One observation, or those of a vector.

        Returns:
            Actions in [-1, 1], shape (2,), or (n, 2) for several observations.
        """
        part, columns = self._layout.find(Scan)
        values = self._layout.select(observation, part, columns)
        commands = self._controller.choose(self._perceive(observation))
        low, high = self.robot.low, self.robot.high
        actions = 2.0 * (commands - low) / (high - low) - 1.0
        result: FloatArray = limit_to_unit(actions.astype(np.float32))
        return result[0] if values.ndim == 1 else result

    def _perceive(self, observation: Any) -> Perception:
        def read(kind: type[Any]) -> Any:
            part, columns = self._layout.find(kind)
            values = self._layout.select(observation, part, columns)
            return part, np.atleast_2d(values).astype(np.float64)

        scan, values = read(Scan)
        ranges = scan.ranges_of(values, self._max_range, len(self._beams))
        goal, values = read(Goal)
        velocities = None
        if self._layout.has(Velocity):
            velocity, numbers = read(Velocity)
            velocities = velocity.velocities_of(numbers, self.robot.low, self.robot.high)
        return Perception(
            self._sensor + ranges[..., np.newaxis] * self._beams,
            ranges < self._max_range,
            goal.positions_of(values),
            self._max_range,
            velocities,
        )


class Straight(Controller):
    """Turns to the goal and drives there, without regard for obstacles."""

    _kind = controllers.Straight


class Gap(Controller):
    """Drives along the free heading that is nearest to the goal."""

    _kind = controllers.Gap


class DynamicWindow(Controller):
    """Chooses the best of the velocities that can be reached within an action.

    The default accelerations are those of the included robot.
    """

    _kind = controllers.DynamicWindow
    _needs = (Scan, Goal, Velocity)


CONTROLLERS: Final[dict[str, type[Controller]]] = {
    "straight": Straight,
    "gap": Gap,
    "window": DynamicWindow,
}
"""The controllers by name."""
