"""A service that moves models back to their initial poses."""

from typing import Any

from flatland import WorldPlugin, YamlReader


class ResetPoses(WorldPlugin):
    """Moves models back to their initial poses on request.

    With ROS, it provides the service `reset_models` (`std_srvs/Trigger`); without ROS, call
    `reset`.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, stores the poses and advertises the service."""
        poses = {model.name: model.pose for model in self.world.models}
        names = config.get_list("models", "string", list(poses))
        service = config.get("service", "string", "reset_models")
        for name in names:
            if name not in poses:
                raise config.error(f'Invalid "models", model "{name}" does not exist at the start')
        self._start = {name: poses[name] for name in names}
        if self.ros is not None:
            from std_srvs.srv import Trigger

            self.ros.advertise_service(service, Trigger, self._serve)

    def reset(self) -> list[str]:
        """Moves all models that still exist, sets their velocities to 0 and returns their names."""
        existing = {model.name for model in self.world.models}
        names = [name for name in self._start if name in existing]
        for name in names:
            # Until all models have moved, one may be at the initial pose of another one.
            self.world.move_model(name, self._start[name], if_blocked="allow")
        return names

    def _serve(self, request: Any) -> Any:
        """Handles a call of the service; called between two steps."""
        from std_srvs.srv import TriggerResponse

        return TriggerResponse(success=True, message=f"moved: {', '.join(self.reset())}")
