"""A service that puts models back where they started."""

from typing import Any

from flatland import WorldPlugin, YamlReader


class ResetPoses(WorldPlugin):
    """Remembers where models stand at the start, and moves them back on request.

    With ROS it offers the service `reset_models` (`std_srvs/Trigger`), without ROS `reset()`.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters, notes the poses and offers the service."""
        poses = {model.name: model.pose for model in self.world.models}
        names = config.get_list("models", "string", list(poses))
        service = config.get("service", "string", "reset_models")
        for name in names:
            if name not in poses:
                raise config.error(f'Invalid "models", there is no model "{name}" at the start')
        self._start = {name: poses[name] for name in names}
        if self.ros is not None:
            from std_srvs.srv import Trigger

            self.ros.advertise_service(service, Trigger, self._serve)

    def reset(self) -> list[str]:
        """Moves the models back, at rest, and returns their names; deleted ones are left out."""
        there = {model.name for model in self.world.models}
        names = [name for name in self._start if name in there]
        for name in names:
            # Until all are back, one may stand where another one belongs.
            self.world.move_model(name, self._start[name], if_blocked="allow")
        return names

    def _serve(self, request: Any) -> Any:
        """Answers a call of the service; runs between two steps."""
        from std_srvs.srv import TriggerResponse

        return TriggerResponse(success=True, message=f"moved: {', '.join(self.reset())}")
