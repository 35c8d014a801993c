"""Carries out the events of a scenario."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flatland.errors import FlatlandError
from flatland.geometry import compose
from flatland.runtime.plain_commands import set_command
from flatland.scenarios.stage import ScenarioError

if TYPE_CHECKING:
    from flatland.scenarios.scenario import Event, Scenario, Spawn, Trigger
    from flatland.scenarios.stage import Stage


class Events:
    """The events of a run that have not taken place yet.

    Attributes:
        kidnapped: Whether the robot was moved by the last call of `update`.
        done: Actions of the events that the last call of `update` has carried out.
    """

    def __init__(self, scenario: Scenario, stage: Stage) -> None:
        """Begins with all events of the scenario."""
        self._stage = stage
        self._waiting = list(scenario.events)
        self.kidnapped = False
        self.done: list[str] = []

    def update(self, goals: int) -> None:
        """Carries out what is due now, in the order of the file.

        Args:
            goals: Number of goals that were reached.

        Raises:
            ScenarioError: An event is not possible.
        """
        self.kidnapped = False
        due = [event for event in self._waiting if self._is_due(event.trigger, goals)]
        self.done = [event.action for event in due]
        for event in due:
            self._waiting.remove(event)
            try:
                self.carry_out(event)
            except FlatlandError as error:
                raise ScenarioError(f"{event.action} [{event.text}]: {error.message}") from error

    def _is_due(self, trigger: Trigger, goals: int) -> bool:
        if trigger.time is not None:
            return self._stage.time >= trigger.time - 1e-9
        if trigger.goals is not None:
            return goals >= trigger.goals
        place = trigger.place or (0.0, 0.0)
        return math.dist(self._stage.robot.pose[:2], place) <= trigger.radius

    def carry_out(self, event: Event) -> None:
        """Carries out an event now.

        Raises:
            FlatlandError: It is not possible.
        """
        world, values = self._stage.world, event.values
        match event.action:
            case "spawn":
                self._spawn(values["spawn"])
            case "delete":
                world.delete_model(values["model"])
            case "move":
                world.move_model(
                    values["model"],
                    values["pose"],
                    if_blocked="allow",
                    keep_odometry=values["keep_odometry"],
                )
            case "kidnap":
                name = self._stage.robot.name
                world.move_model(name, values["pose"], if_blocked="refuse", keep_odometry=True)
                self.kidnapped = True
            case "command":
                set_command(world, values["topic"], values["value"])
            case "fail":
                self._stage.laser.fail(values["fault"], values["duration"])
            case "people":
                self._direct(values)
            case other:
                raise ValueError(f"unknown action {other!r}")

    def _spawn(self, spawn: Spawn) -> None:
        pose = spawn.pose
        if pose is None:
            pose = compose(self._stage.robot.pose, (spawn.ahead, 0.0, 0.0))
        self._stage.world.spawn_model(spawn.model, spawn.name, pose=pose, if_blocked="allow")

    def _direct(self, values: Any) -> None:
        people = self._stage.people
        if people is None:
            raise ScenarioError("the world has no plugin Pedestrians")
        match values["action"]:
            case "stop":
                people.stop(values["names"])
            case "resume":
                people.resume(values["names"])
            case _:
                people.send(values["names"], values["goal"])
