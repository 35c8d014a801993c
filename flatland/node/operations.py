"""What services and the viewer in the browser do with a running world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from flatland.node.clock import WallClock

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.geometry import Pose
    from flatland.loading.model_source import ModelSpec
    from flatland.node.clock import NodeClock
    from flatland.node.transport import Transport
    from flatland.runtime.placement import IfBlocked
    from flatland.runtime.snapshot import WorldSnapshot
    from flatland.simulation import PauseHolds, Simulation


class Operations:
    """Changes of a world, as configured by the parameters of the node.

    All methods except `step` must be called between two steps.
    """

    def __init__(
        self,
        transport: Transport,
        simulation: Simulation,
        clock: NodeClock,
        if_blocked: IfBlocked,
        *,
        move_keeps_odometry: bool,
    ) -> None:
        """Stores the arguments.

        Args:
            transport: Sets parameters of the node, and keeps topics registered in a reset.
            simulation: Simulation of the world.
            clock: Publishes the time.
            if_blocked: Behaviour of spawns and moves at poses that are not free.
            move_keeps_odometry: Whether a move keeps the odometry of the model.
        """
        self._transport = transport
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
        self._transport.set_parameter("~update_rate", 0.0 if math.isinf(rate) else rate)

    def pause(self) -> None:
        """Pauses the world, also beyond the end of a drag."""
        self._world.pause()
        self.holds.keep_paused()

    def resume(self) -> None:
        """Resumes the world."""
        self._world.resume()

    def toggle_pause(self) -> None:
        """Resumes a paused world, otherwise pauses it, also beyond the end of a drag."""
        if self._world.paused:
            self.resume()
        else:
            self.pause()

    def step(self, count: int) -> Future[Any]:
        """Requests steps, also of a paused world and in lockstep; safe from any thread.

        Returns:
            Holds the simulated time after the last step [ns].
        """
        done = self._simulation.request_steps(count)
        # With a limited rate, the time after the last step may not be published yet.
        done.add_done_callback(lambda _done: self._clock.flush())
        return done

    @property
    def set_back_effect(self) -> str:
        """What a time that is set back does to other nodes, for users; empty for nothing."""
        if isinstance(self._clock, WallClock):
            return ""
        return (
            "/clock is set back: nodes with use_sim_time clear their tf buffers, and their sleeps "
            "may raise errors"
        )

    def reset(self, seed: int | None = None, *, keep_time: bool = False) -> None:
        """Returns the world to its state after loading.

        Topics that exist before and after stay registered.

        Args:
            seed: The new seed; None for the current one.
            keep_time: Whether the simulated time continues; otherwise it starts at 0.

        Raises:
            FlatlandError: The world file has become invalid; the world is unchanged.
        """
        with self._transport.closing_last():
            self._world.reset(seed=seed, keep_time=keep_time)

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Returns the world to an earlier state; `/clock` is set back as by a reset.

        Topics that exist in both states stay registered.

        Args:
            snapshot: A snapshot of the world.

        Raises:
            WorldError: A plugin that has ended since had a connection.
        """
        with self._transport.closing_last():
            self._world.restore(snapshot)

    # -- models ----------------------------------------------------------------------------

    def spawn(self, file: str, name: str, namespace: str, pose: Pose) -> str:
        """Spawns a model.

        Returns:
            Where the model was put if its pose is not free; otherwise empty.

        Raises:
            FlatlandError: The model is invalid, or the pose is blocked; the world is unchanged.
        """
        model = self._world.spawn_model(file, name, namespace, pose, self._if_blocked)
        return _describe_displacement(model, pose)

    def spawn_all(self, specs: Sequence[ModelSpec]) -> tuple[str, list[Pose]]:
        """Spawns all of several models, or none.

        Returns:
            Where models were put whose pose is not free; and the poses of all models.

        Raises:
            BatchError: A model is invalid, or its pose is blocked; the world is unchanged.
        """
        models = self._world.spawn_models(specs, self._if_blocked)
        poses = [(x, y, theta) for x, y, theta in (spec.pose for spec in specs)]
        return _describe_displacements(models or [], poses)

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
        return _describe_displacement(model, pose)

    def move_all(self, poses: Sequence[tuple[str, Pose]]) -> tuple[str, list[Pose]]:
        """Moves all of several models, or none.

        Returns:
            Where models were put whose pose is not free; and the poses of all models.

        Raises:
            BatchError: A model does not exist, or its pose is not finite or blocked.
        """
        models = self._world.move_models(poses, self._if_blocked, keep_odometry=self._keep_odometry)
        return _describe_displacements(models or [], [pose for _, pose in poses])

    def delete(self, name: str) -> None:
        """Deletes a model.

        Raises:
            WorldError: The model does not exist.
        """
        self._world.delete_model(name)


def _describe_displacement(model: Model | None, requested: Pose) -> str:
    """Describes a pose that differs from the requested one; empty if it does not."""
    if model is None or model.displacement == (0.0, 0.0):
        return ""
    dx, dy = model.displacement
    x, y, theta = requested[0] + dx, requested[1] + dy, requested[2]
    return (
        f'the requested pose is blocked: model "{model.name}" was put at '
        f"({x:.3f}, {y:.3f}, {theta:.3f}), {math.hypot(dx, dy):.3f} m away"
    )


def _describe_displacements(
    models: Sequence[Model], requested: Sequence[Pose]
) -> tuple[str, list[Pose]]:
    texts = map(_describe_displacement, models, requested)
    return "; ".join(filter(None, texts)), [model.pose for model in models]
