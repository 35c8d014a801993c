"""The services of the node for single models, pause and rate; creates all other services."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import rospy
from std_srvs.srv import Empty, EmptyResponse

from flatland.ros.appearance_service import AppearanceService
from flatland.ros.batch_services import BatchServices
from flatland.ros.clock import NodeClock
from flatland.ros.layer_maps import LayerMaps
from flatland.ros.message_types import service_class
from flatland.ros.model_states import ModelStatesService, ModelStatesTopic
from flatland.ros.names import sendable_text
from flatland.ros.operations import Operations
from flatland.ros.reset_service import ResetService
from flatland.ros.service_calls import CallError, ServiceCalls, pose_of
from flatland.ros.step_service import StepService
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service
from flatland.runtime.placement import IfBlocked
from flatland.simulation import Simulation


class Services:
    """The services of one simulation in the namespace of the node.

    Each call is carried out between two steps in the thread that steps the world, in order of
    arrival, also while paused. The response is sent after the call has taken effect.
    """

    def __init__(
        self,
        registrar: Registrar,
        simulation: Simulation,
        clock: NodeClock,
        operations: Operations,
        if_blocked: IfBlocked = "warn",
        *,
        move_keeps_odometry: bool = False,
        model_states_rate: float = 0.0,
    ) -> None:
        """Advertises the services asynchronously.

        Args:
            registrar: Registers the services with the ROS master.
            simulation: Simulation that the services control.
            clock: Publishes the time.
            operations: Changes single models and the rate.
            if_blocked: Behaviour of `spawn_models` and `move_models` at poses that are not free.
            move_keeps_odometry: Whether `move_models` keeps the odometry of the models.
            model_states_rate: Rate of the topic `model_states` in simulated time [Hz]; 0 for one
                message per step.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._operations = operations
        self._calls = ServiceCalls(registrar, simulation)
        world = simulation.world
        StepService(self._calls, clock)
        ResetService(self._calls)
        LayerMaps(self._calls)
        AppearanceService(self._calls)
        ModelStatesService(self._calls)
        ModelStatesTopic(self._calls, model_states_rate)
        BatchServices(self._calls, if_blocked, move_keeps_odometry=move_keeps_odometry)
        for name, service_type, handler in (
            ("spawn_model", service_class("SpawnModel"), self._spawn_model),
            ("delete_model", service_class("DeleteModel"), self._delete_model),
            ("move_model", service_class("MoveModel"), self._move_model),
            ("set_rate", service_class("SetRate"), self._set_rate),
            ("pause", Empty, self._switch(operations.pause)),
            ("resume", Empty, self._switch(operations.resume)),
            ("toggle_pause", Empty, self._switch(world.toggle_pause)),
        ):
            Service(registrar, name, service_type, handler)

    # rospy converts the returned fields to the response class of the service.

    def _spawn_model(self, request: Any) -> tuple[bool, str]:
        path, name, namespace = request.yaml_path, request.name, request.ns
        pose = pose_of(request.pose)
        return self._carry_out(lambda: self._operations.spawn(path, name, namespace, pose))

    def _delete_model(self, request: Any) -> tuple[bool, str]:
        return self._carry_out(lambda: self._operations.delete(request.name))

    def _move_model(self, request: Any) -> tuple[bool, str]:
        pose = pose_of(request.pose)
        return self._carry_out(lambda: self._operations.move(request.name, pose))

    def _set_rate(self, request: Any) -> tuple[bool, str]:
        rate = request.update_rate
        if math.isnan(rate) or rate < 0:
            return False, f"update_rate must not be negative, got {rate}"
        return self._carry_out(lambda: self._operations.set_rate(rate))

    def _switch(self, action: Callable[[], None]) -> Callable[[Any], EmptyResponse]:
        def serve(_request: Any) -> EmptyResponse:
            done, message = self._carry_out(action)
            if not done:
                # The response has no field for an error.
                raise rospy.ServiceException(message)
            return EmptyResponse()

        return serve

    def _carry_out(self, action: Callable[[], str | None]) -> tuple[bool, str]:
        """Runs an action between two steps.

        Returns:
            Whether it succeeded, and the text that it returned or the error.
        """
        try:
            return True, sendable_text(self._calls.carry_out(action) or "")
        except CallError as error:
            return False, str(error)
