"""The node's services: models come, go and move; time stops, runs on, runs faster."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Any, Final

import rospy
from std_srvs.srv import Empty, EmptyResponse

from flatland.errors import FlatlandError
from flatland.ros.names import sendable_text
from flatland.ros.registrar import Registrar
from flatland.ros.transport.service import Service, wait_for
from flatland.simulation import Simulation
from flatland.srv import (
    DeleteModel,
    DeleteModelRequest,
    DeleteModelResponse,
    MoveModel,
    MoveModelRequest,
    MoveModelResponse,
    SetRate,
    SetRateRequest,
    SetRateResponse,
    SpawnModel,
    SpawnModelRequest,
    SpawnModelResponse,
)

_LOG = logging.getLogger("flatland")

_REGISTRATION_PATIENCE: Final = 5.0  # s that an answer waits for the ROS master to know the topics


class Services:
    """Offers the services of one simulation in the node's namespace.

    Each call is carried out in the simulation's thread between two steps, in order of arrival,
    also while paused, and answered when it has taken effect.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation) -> None:
        """Offers the services, soon.

        Args:
            registrar: Talks to the ROS master.
            simulation: What the services act on.

        Raises:
            FlatlandError: A plugin has taken the name of a service.
        """
        self._registrar = registrar
        self._simulation = simulation
        world = simulation.world
        for name, service_type, handler in (
            ("spawn_model", SpawnModel, self._spawn_model),
            ("delete_model", DeleteModel, self._delete_model),
            ("move_model", MoveModel, self._move_model),
            ("set_rate", SetRate, self._set_rate),
            ("pause", Empty, self._switch(world.pause)),
            ("resume", Empty, self._switch(world.resume)),
            ("toggle_pause", Empty, self._switch(world.toggle_pause)),
        ):
            Service(registrar, name, service_type, handler)

    def _spawn_model(self, request: SpawnModelRequest) -> SpawnModelResponse:
        pose = _pose(request.pose)
        return SpawnModelResponse(
            *self._carry_out(
                lambda: self._simulation.world.spawn_model(
                    request.yaml_path, request.name, request.ns, pose
                )
            )
        )

    def _delete_model(self, request: DeleteModelRequest) -> DeleteModelResponse:
        return DeleteModelResponse(
            *self._carry_out(lambda: self._simulation.world.delete_model(request.name))
        )

    def _move_model(self, request: MoveModelRequest) -> MoveModelResponse:
        pose = _pose(request.pose)
        return MoveModelResponse(
            *self._carry_out(lambda: self._simulation.world.move_model(request.name, pose))
        )

    def _set_rate(self, request: SetRateRequest) -> SetRateResponse:
        rate = request.update_rate
        if math.isnan(rate) or rate < 0:
            return SetRateResponse(False, f"update_rate must not be negative, got {rate}")
        done, message = self._carry_out(lambda: self._simulation.set_rate(rate))
        if done:
            # Who looks there is to find what holds now.
            value = 0.0 if math.isinf(rate) else rate
            self._registrar.submit(lambda: rospy.set_param("~update_rate", value))
            self._registrar.flush(_REGISTRATION_PATIENCE)
        return SetRateResponse(done, message)

    def _switch(self, action: Callable[[], None]) -> Callable[[Any], EmptyResponse]:
        def serve(_request: Any) -> EmptyResponse:
            self._carry_out(action)
            return EmptyResponse()

        return serve

    def _carry_out(self, action: Callable[[], object]) -> tuple[bool, str]:
        """Runs an action between two steps and says whether it worked, and if not, why."""
        try:
            wait_for(self._simulation.post(action))
            # Whoever spawned a model may look for its topics at once.
            self._registrar.flush(_REGISTRATION_PATIENCE)
        except (FlatlandError, rospy.ServiceException) as error:
            self._registrar.flush(_REGISTRATION_PATIENCE)
            return False, sendable_text(str(error))
        except Exception as error:
            _LOG.exception("a service call failed in an unforeseen way")
            return False, sendable_text(f"{type(error).__name__}: {error}")
        return True, ""


def _pose(pose: Any) -> tuple[float, float, float]:
    return (pose.x, pose.y, pose.theta)
