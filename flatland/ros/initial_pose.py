"""Moves a model to the poses received on `initialpose`, RViz's tool *2D Pose Estimate*."""

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped

from flatland.errors import FlatlandError
from flatland.ros.adapters import convert
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.subscriber import Subscriber
from flatland.runtime.placement import IfBlocked
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

TOPIC: Final = "initialpose"
FRAME: Final = "map"


class InitialPose:
    """Kidnaps one model: moves it between two steps, while its odometry continues."""

    def __init__(
        self, registrar: Registrar, simulation: Simulation, model: str, if_blocked: IfBlocked
    ) -> None:
        """Subscribes asynchronously.

        Args:
            registrar: Registers the subscription with the ROS master.
            simulation: Simulation of the world of the model.
            model: Name of the model, which need not exist yet.
            if_blocked: Behaviour at poses that are not free.
        """
        self._simulation = simulation
        self._model = model
        self._if_blocked: IfBlocked = if_blocked
        Subscriber(registrar, TOPIC, PoseWithCovarianceStamped, self._receive)

    def _receive(self, message: PoseWithCovarianceStamped) -> None:
        """Queues a move; called in a rospy thread."""
        self._simulation.post(lambda: self._move(message)).add_done_callback(_log_failure)

    def _move(self, message: PoseWithCovarianceStamped) -> None:
        frame, pose = message.header.frame_id.lstrip("/"), convert.planar_pose(message.pose.pose)
        try:
            if frame not in (FRAME, *self._world_frames()):
                _LOG.warning('%s: ignoring a pose in frame "%s", expected "map"', TOPIC, frame)
            elif pose is None:
                _LOG.warning("%s: ignoring a pose that is not finite or has no rotation", TOPIC)
            else:
                self._simulation.world.move_model(
                    self._model, pose, self._if_blocked, keep_odometry=True
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
