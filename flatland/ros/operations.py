"""What services and the viewer in the browser do with a running world."""

from __future__ import annotations

import math
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from flatland.ros.service_calls import describe_displacement

if TYPE_CHECKING:
    from flatland.geometry import Pose
    from flatland.ros.clock import NodeClock
    from flatland.ros.transport.registrar import Registrar
    from flatland.runtime.placement import IfBlocked
    from flatland.simulation import PauseHolds, Simulation


class Operations:
    """Changes of a world, as configured by the parameters of the node.

    All methods except `step` must be called between two steps.
    """

    def __init__(
        self,
        registrar: Registrar,
        simulation: Simulation,
        clock: NodeClock,
        if_blocked: IfBlocked = "warn",
        *,
        move_keeps_odometry: bool = False,
    ) -> None:
        """Stores the arguments.

        Args:
            registrar: Sets parameters of the node.
            simulation: Simulation of the world.
            clock: Publishes the time.
            if_blocked: Behaviour of spawns and moves at poses that are not free.
            move_keeps_odometry: Whether a move keeps the odometry of the model.
        """
        self._registrar = registrar
        self._simulation = simulation
        self._clock = clock
        self._world = simulation.world
        self._if_blocked: IfBlocked = if_blocked
        self._keep_odometry = move_keeps_odometry

    # -- time ------------------------------------------------------------------------------

    @property
    def holds(self) -> PauseHolds:
        """Pause the world while clients drag models."""
        return self._simulation.holds

    @property
    def rate(self) -> float | None:
        """Target steps per second of wall time [Hz], inf for no limit, None in lockstep."""
        return None if self.lockstep else self._simulation.rate

    @property
    def lockstep(self) -> bool:
        """Whether time passes only on request."""
        return self._simulation.lockstep

    def set_rate(self, rate: float) -> None:
        """Sets the update rate, and the parameter from which clients read it.

        Args:
            rate: Steps per second of wall time [Hz]; 0 or inf for as many as possible.

        Raises:
            ValueError: The rate is negative or not a number.
            WorldError: The simulation is in lockstep.
        """
        self._simulation.set_rate(rate)
        self._registrar.set_parameter("~update_rate", 0.0 if math.isinf(rate) else rate)

    def pause(self) -> None:
        """Pauses the world, also beyond the end of a drag."""
        self._world.pause()
        self.holds.keep_paused()

    def resume(self) -> None:
        """Resumes the world."""
        self._world.resume()

    def step(self, count: int) -> Future[Any]:
        """Requests steps, also of a paused world and in lockstep; safe from any thread.

        Returns:
            Holds the simulated time after the last step [ns].
        """
        done = self._simulation.request_steps(count)
        # With a limited rate, the time after the last step may not be published yet.
        done.add_done_callback(lambda _done: self._clock.flush())
        return done

    # -- models ----------------------------------------------------------------------------

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> str:
        """Spawns a model.

        Returns:
            Where the model was put if its pose is not free; otherwise empty.

        Raises:
            FlatlandError: The model is invalid, or the pose is blocked; the world is unchanged.
        """
        model = self._world.spawn_model(file, name, namespace, pose, self._if_blocked)
        return describe_displacement(model, pose)

    def move(self, name: str, pose: Pose) -> str:
        """Moves a model.

        While a client drags a model, no warning is logged for a pose that is not free, because a
        drag consists of many moves.

        Returns:
            Where the model was put if its pose is not free; otherwise empty.

        Raises:
            WorldError: The model does not exist, or the pose is not finite or blocked.
        """
        if_blocked = self._if_blocked
        if if_blocked == "warn" and self.holds:
            if_blocked = "allow"
        model = self._world.move_model(name, pose, if_blocked, keep_odometry=self._keep_odometry)
        return describe_displacement(model, pose)

    def delete(self, name: str) -> None:
        """Deletes a model.

        Raises:
            WorldError: The model does not exist.
        """
        self._world.delete_model(name)
