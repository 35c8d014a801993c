"""What clients of the viewer can do with a world."""

from __future__ import annotations

import math
from concurrent.futures import Future
from typing import Protocol

from flatland.errors import WorldError
from flatland.geometry import Pose
from flatland.runtime.snapshot import WorldSnapshot
from flatland.simulation import PauseHolds, Simulation
from flatland.world import World


class WorldController(Protocol):
    """Performs the requests of clients; a program may pass a controller to `WebViewer.add_world`.

    All methods except `step` are called between two steps. A method that cannot perform a request
    raises a `FlatlandError` or a `ValueError`, whose text is sent to the client.
    """

    @property
    def holds(self) -> PauseHolds:
        """Holds that pause the world while clients drag models."""

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
            A future that is completed after the last step.
        """

    @property
    def set_back_effect(self) -> str:
        """What a time that is set back does to other programs, for users; empty for nothing."""

    def reset(self) -> None:
        """Returns the world to its state after loading, with the time 0."""

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Returns the world to an earlier state, with its time."""

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> object:
        """Adds a model to the world."""

    def move(self, name: str, pose: Pose) -> object:
        """Moves a model to a pose in the world frame [m, rad]."""

    def delete(self, name: str) -> None:
        """Removes a model."""


def controller_of(world: World, simulation: Simulation | None) -> WorldController:
    """Returns a controller that acts on a world, and on the simulation that steps the world.

    Args:
        world: The world.
        simulation: The simulation, None if a program steps the world.
    """
    return _DefaultController(world, simulation)


class _DefaultController:
    def __init__(self, world: World, simulation: Simulation | None) -> None:
        self._world = world
        self._simulation = simulation
        self._holds = PauseHolds(world) if simulation is None else simulation.holds

    @property
    def holds(self) -> PauseHolds:
        return self._holds

    @property
    def rate(self) -> float | None:
        simulation = self._simulation
        return None if simulation is None or simulation.lockstep else simulation.rate

    @property
    def lockstep(self) -> bool:
        return self._simulation is not None and self._simulation.lockstep

    def set_rate(self, rate: float) -> None:
        if self._simulation is None:
            raise WorldError("the rate cannot be set: a program steps the world itself")
        self._simulation.set_rate(rate or math.inf)

    def pause(self) -> None:
        self._world.pause()

    def resume(self) -> None:
        self._world.resume()

    def step(self, count: int) -> Future[object]:
        if self._simulation is not None:
            return self._simulation.request_steps(count)  # type: ignore[return-value]
        return self._world.post(lambda: self._world.step(count, while_paused=True))

    @property
    def set_back_effect(self) -> str:
        return ""

    def reset(self) -> None:
        self._world.reset()

    def restore(self, snapshot: WorldSnapshot) -> None:
        self._world.restore(snapshot)

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> None:
        self._world.spawn_model(file, name, namespace, pose, if_blocked="allow")

    def move(self, name: str, pose: Pose) -> None:
        self._world.move_model(name, pose, if_blocked="allow")

    def delete(self, name: str) -> None:
        self._world.delete_model(name)
