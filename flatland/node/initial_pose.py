"""Moves a model to the poses received on `initialpose`, RViz's tool *2D Pose Estimate*."""

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import Any, Final

from flatland.errors import FlatlandError
from flatland.node.transport import Transport
from flatland.node.values import WORLD_FRAME, ReceivedPose
from flatland.runtime.placement import IfBlocked
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

TOPIC: Final = "initialpose"


class InitialPose:
    """Kidnaps one model: moves it between two steps, while its odometry continues."""

    def __init__(
        self, transport: Transport, simulation: Simulation, model: str, if_blocked: IfBlocked
    ) -> None:
        """Subscribes asynchronously.

        Args:
            transport: Subscribes.
            simulation: Simulation of the world of the model.
            model: Name of the model, which need not exist yet.
            if_blocked: Behaviour at poses that are not free.
        """
        self._simulation = simulation
        self._model = model
        self._if_blocked: IfBlocked = if_blocked
        message_type, convert = transport.receivable(ReceivedPose)
        transport.subscribe(TOPIC, message_type, lambda message: self._receive(convert(message)))

    def _receive(self, value: ReceivedPose) -> None:
        """Queues a move; called in any thread."""
        self._simulation.post(lambda: self._move(value)).add_done_callback(_log_failure)

    def _move(self, value: ReceivedPose) -> None:
        try:
            if value.frame_id not in (WORLD_FRAME, *self._world_frames()):
                _LOG.warning(
                    '%s: ignoring a pose in frame "%s", expected "map"', TOPIC, value.frame_id
                )
            elif value.pose is None:
                _LOG.warning("%s: ignoring a pose that is not finite or has no rotation", TOPIC)
            else:
                self._simulation.world.move_model(
                    self._model, value.pose, self._if_blocked, keep_odometry=True
                )
        except FlatlandError as error:
            _LOG.warning("%s: %s", TOPIC, error)

    def _world_frames(self) -> set[str]:
        """Returns the names that the plugins of the model use for the world frame."""
        plugins = self._simulation.world.model(self._model).plugins
        return {plugin.world_frame_id.lstrip("/") for plugin in plugins if plugin.world_frame_id}


def _log_failure(done: Future[Any]) -> None:
    if not done.cancelled() and done.exception() is not None:
        _LOG.error("%s: unexpected internal error", TOPIC, exc_info=done.exception())
