"""The services `spawn_models`, `move_models` and `delete_models`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Pose2D

from flatland.entities.model import Model
from flatland.geometry import Pose
from flatland.loading.model_source import ModelSpec
from flatland.ros.message_types import service_class
from flatland.ros.names import sendable_text
from flatland.ros.service_calls import CallError, ServiceCalls, describe_displacement, pose_of
from flatland.ros.transport.service import Service
from flatland.runtime.placement import IfBlocked


class BatchServices:
    """Services that change several models in one call: all of them, or none."""

    def __init__(
        self, calls: ServiceCalls, if_blocked: IfBlocked, *, move_keeps_odometry: bool
    ) -> None:
        """Advertises the services asynchronously.

        Args:
            calls: Carries out the calls.
            if_blocked: Behaviour at poses that are not free.
            move_keeps_odometry: Whether `move_models` keeps the odometry of the models.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._world = calls.simulation.world
        self._if_blocked = if_blocked
        self._keep_odometry = move_keeps_odometry
        for name, type_name, handler in (
            ("spawn_models", "SpawnModels", self._spawn),
            ("move_models", "MoveModels", self._move),
            ("delete_models", "DeleteModels", self._delete),
        ):
            Service(calls.registrar, name, service_class(type_name), handler)

    # rospy converts the returned fields to the response class of the service.

    def _spawn(self, request: Any) -> tuple[bool, str, int, list[Pose2D]]:
        specs = [
            ModelSpec(model.yaml_path, model.name, model.ns, pose_of(model.pose))
            for model in request.models
        ]
        return self._place(
            [pose_of(model.pose) for model in request.models],
            lambda: self._world.spawn_models(specs, self._if_blocked),
        )

    def _move(self, request: Any) -> tuple[bool, str, int, list[Pose2D]]:
        poses = [(model.name, pose_of(model.pose)) for model in request.models]
        return self._place(
            [pose for _, pose in poses],
            lambda: self._world.move_models(
                poses, self._if_blocked, keep_odometry=self._keep_odometry
            ),
        )

    def _delete(self, request: Any) -> tuple[bool, str, int]:
        try:
            self._calls.carry_out(lambda: self._world.delete_models(request.names))
        except CallError as error:
            return False, str(error), error.index
        return True, "", -1

    def _place(
        self, requested: list[Pose], action: Callable[[], list[Model] | None]
    ) -> tuple[bool, str, int, list[Pose2D]]:
        """Carries out a request and returns the poses of the models."""

        def place() -> tuple[list[str], list[Pose2D]]:
            models = action() or []
            texts = map(describe_displacement, models, requested)
            return [text for text in texts if text], [Pose2D(*model.pose) for model in models]

        try:
            texts, poses = self._calls.carry_out(place)
        except CallError as error:
            return False, str(error), error.index, []
        return True, sendable_text("; ".join(texts)), -1, poses
