"""What clients of the viewer can do with a world."""

from __future__ import annotations

import math
from concurrent.futures import Future
from typing import Protocol

from flatland.errors import WorldError
from flatland.geometry import Pose
from flatland.simulation import PauseHolds, Simulation
from flatland.world import World


class WorldController(Protocol):
    """Carries out what clients request; a host of the viewer may pass one of its own.

    All methods but `step` are called between two steps. Those that cannot carry out a request raise
    a `FlatlandError` or a `ValueError`, whose text is sent to the client.
    """

    @property
    def holds(self) -> PauseHolds:
        """Pause the world while clients drag models."""

    @property
    def rate(self) -> float | None:
        """Target steps per second of wall time [Hz], inf for no limit, None if there is none."""

    @property
    def lockstep(self) -> bool:
        """Whether time passes only on request."""

    def set_rate(self, rate: float) -> None:
        """Changes the target rate [Hz]; 0 for no limit."""

    def pause(self) -> None:
        """Pauses the world."""

    def resume(self) -> None:
        """Resumes the world."""

    def step(self, count: int) -> Future[object]:
        """Steps a paused world, which stays paused; called from any thread.

        Returns:
            Done after the last step.
        """

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> object:
        """Adds a model to the world."""

    def move(self, name: str, pose: Pose) -> object:
        """Moves a model to a pose in the world frame [m, rad]."""

    def delete(self, name: str) -> None:
        """Removes a model."""


class DefaultController:
    """Acts on a world, and on the simulation that steps it, if there is one."""

    def __init__(self, world: World, simulation: Simulation | None) -> None:
        """Creates a controller.

        Args:
            world: The world.
            simulation: The simulation that steps the world, None if something else does.
        """
        self._world = world
        self._simulation = simulation
        self._holds = PauseHolds(world) if simulation is None else simulation.holds

    @property
    def holds(self) -> PauseHolds:
        """Pause the world while clients drag models."""
        return self._holds

    @property
    def rate(self) -> float | None:
        """Target steps per second of wall time [Hz], inf for no limit, None if there is none."""
        simulation = self._simulation
        return None if simulation is None or simulation.lockstep else simulation.rate

    @property
    def lockstep(self) -> bool:
        """Whether time passes only on request."""
        return self._simulation is not None and self._simulation.lockstep

    def set_rate(self, rate: float) -> None:
        """Changes the target rate [Hz]; 0 for no limit."""
        if self._simulation is None:
            raise WorldError("the rate cannot be set: a program steps the world itself")
        self._simulation.set_rate(rate or math.inf)

    def pause(self) -> None:
        """Pauses the world."""
        self._world.pause()

    def resume(self) -> None:
        """Resumes the world."""
        self._world.resume()

    def step(self, count: int) -> Future[object]:
        """Steps a paused world, which stays paused; called from any thread."""
        if self._simulation is not None:
            return self._simulation.request_steps(count)  # type: ignore[return-value]
        return self._world.post(lambda: self._world.step(count, while_paused=True))

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> None:
        """Adds a model to the world."""
        self._world.spawn_model(file, name, namespace, pose, if_blocked="allow")

    def move(self, name: str, pose: Pose) -> None:
        """Moves a model to a pose in the world frame [m, rad]."""
        self._world.move_model(name, pose, if_blocked="allow")

    def delete(self, name: str) -> None:
        """Removes a model."""
        self._world.delete_model(name)
