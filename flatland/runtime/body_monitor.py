"""Handles the bodies that a physics step reports: jammed bodies and bodies that are not finite."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, get_args

from flatland.entities.model import Model
from flatland.errors import WorldError
from flatland.runtime.observer import WorldObserver
from flatland.suggestions import MOST_NAMES

if TYPE_CHECKING:
    from flatland.entities.body import Body
    from flatland.physics import PhysicsWorld, StepReport
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.model_set import ModelSet
    from flatland.timekeeper import Timekeeper

_LOG = logging.getLogger("flatland")

JAM_STEPS: Final = 20
"""Successive steps in which the engine limits a model before the model counts as jammed."""
FREE_TIME: Final = 5.0
"""Simulated time [s] without a limited step after which a jam of the same model is a new one."""

InvalidBodyPolicy = Literal["raise", "remove"]


@dataclass(slots=True)
class _Jam:
    steps: int = 0  # successive limited steps
    last_ns: int = 0  # simulated time of the latest one
    is_logged: bool = False


class BodyMonitor(WorldObserver):
    """Logs models that are jammed, and handles bodies with an invalid pose or velocity.

    A model is jammed when the engine limits one of its bodies in `JAM_STEPS` successive steps. It
    is logged once, and again only after `FREE_TIME` without a limited step, or after a move.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        contacts: ContactReporter,
        models: ModelSet,
        on_invalid_body: InvalidBodyPolicy,
    ) -> None:
        """Creates a monitor.

        Args:
            physics: The physics world.
            contacts: Finds the owners of physics bodies.
            models: The models.
            on_invalid_body: `raise` or `remove`, see `World`.

        Raises:
            ValueError: The policy is unknown.
        """
        if on_invalid_body not in get_args(InvalidBodyPolicy):
            raise ValueError(
                f"on_invalid_body must be 'raise' or 'remove', got {on_invalid_body!r}"
            )
        self._physics = physics
        self._contacts = contacts
        self._models = models
        self._removes = on_invalid_body == "remove"
        self._jams: dict[Model, _Jam] = {}

    def examine(self, report: StepReport, timekeeper: Timekeeper) -> None:
        """Handles the bodies that a physics step reported.

        Args:
            report: The report.
            timekeeper: The simulated time, before it advances.

        Raises:
            WorldError: A body has an invalid pose or velocity, and the policy is `raise`.
        """
        for model in dict.fromkeys(map(self._model_of, report.limited)):
            if model is not None:
                self._limited(model, timekeeper)
        if report.invalid:
            self._invalid(report.invalid)

    def model_moved(self, model: Model) -> None:
        """Removes the record of a jam of the model."""
        self._jams.pop(model, None)

    def model_removed(self, model: Model) -> None:
        """Removes the record of a jam of the model."""
        self._jams.pop(model, None)

    def _model_of(self, body_id: int) -> Model | None:
        body = self._body(body_id)
        return body.entity if body is not None and isinstance(body.entity, Model) else None

    def _body(self, body_id: int) -> Body | None:
        return self._contacts.find_body(self._physics.body(body_id))

    def _limited(self, model: Model, timekeeper: Timekeeper) -> None:
        now = timekeeper.sim_time_ns
        jam = self._jams.setdefault(model, _Jam())
        pause_ns = now - jam.last_ns
        jam.steps = jam.steps + 1 if pause_ns <= timekeeper.step_size_ns else 1
        jam.is_logged = jam.is_logged and pause_ns <= FREE_TIME * 1e9
        jam.last_ns = now
        if jam.steps >= JAM_STEPS and not jam.is_logged:
            jam.is_logged = True
            x, y, _ = model.pose
            _LOG.warning(
                'model "%s" is jammed between walls at (%.2f, %.2f): it overlaps them or the gap '
                "is too narrow for it; its contacts are limited until it is free",
                model.name,
                x,
                y,
            )

    def _invalid(self, body_ids: Sequence[int]) -> None:
        text = self._describe(body_ids)
        if not self._removes:
            raise WorldError(text)
        _LOG.error("%s: removed from the world", text)
        for body_id in body_ids:
            model = self._model_of(body_id)
            if model is not None:
                self._models.delete(model.name)
            elif self._physics.body(body_id).alive:
                self._physics.body(body_id).destroy()

    def _describe(self, body_ids: Sequence[int]) -> str:
        names = []
        for body_id in body_ids:
            body = self._body(body_id)
            if body is None:
                names.append(f"body {body_id}, which belongs to no model,")
            else:
                names.append(f'body "{body.name}" of model "{body.entity.name}"')
        if len(names) > MOST_NAMES:
            names[MOST_NAMES:] = [f"{len(names) - MOST_NAMES} more"]
        verb = "has" if len(names) == 1 else "have each"
        return f"{' and '.join(names)} {verb} a pose or velocity that is not finite"
