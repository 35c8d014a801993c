"""Models that are jammed, and bodies that a step left invalid."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from flatland.model import Model

if TYPE_CHECKING:
    from flatland.body import Body
    from flatland.timekeeper import Timekeeper

_LOG = logging.getLogger("flatland")

JAM_STEPS: Final = 20
"""Successive steps in which the engine limits a model before the model counts as jammed."""
FREE_TIME: Final = 5.0
"""Simulated time [s] without a limited step after which a jam of the same model is a new one."""
ON_INVALID_BODY: Final = ("raise", "remove")


@dataclass(slots=True)
class _Jam:
    steps: int = 0  # successive limited steps
    last_ns: int = 0  # simulated time of the latest one
    is_logged: bool = False


class JamWatch:
    """Logs each model that is jammed once, by name.

    A model is jammed when the engine limits one of its bodies in `JAM_STEPS` successive steps.
    It is logged again only after `FREE_TIME` without a limited step, or after `forget`.
    """

    def __init__(self) -> None:
        """Starts without jams."""
        self._jams: dict[Model, _Jam] = {}

    def update(self, limited: Iterable[Body], timekeeper: Timekeeper) -> None:
        """Takes the bodies that the engine limited in the latest step.

        Args:
            limited: The bodies; those of layers are ignored.
            timekeeper: The simulated time, before it advances.
        """
        now = timekeeper.sim_time_ns
        for model in {body.entity: None for body in limited}:
            if not isinstance(model, Model):
                continue
            jam = self._jams.setdefault(model, _Jam())
            pause_ns = now - jam.last_ns
            jam.steps = jam.steps + 1 if pause_ns <= timekeeper.step_size_ns else 1
            jam.is_logged = jam.is_logged and pause_ns <= FREE_TIME * 1e9
            jam.last_ns = now
            if jam.steps >= JAM_STEPS and not jam.is_logged:
                jam.is_logged = True
                x, y, _ = model.pose
                _LOG.warning(
                    'model "%s" is jammed between walls at (%.2f, %.2f): it overlaps them or the '
                    "gap is too narrow for it; its contacts are limited until it is free",
                    model.name,
                    x,
                    y,
                )

    def forget(self, model: Model) -> None:
        """Forgets a model that was moved or removed."""
        self._jams.pop(model, None)


def describe_invalid(body_ids: Iterable[int], bodies: Mapping[int, Body]) -> str:
    """Names bodies whose pose or velocity is not finite.

    Args:
        body_ids: Their ids in the physics world, at least one.
        bodies: The bodies of models and layers by id.

    Returns:
        Such as `body "base" of model "r1" has a pose or velocity that is not finite`.
    """
    names = []
    for body_id in body_ids:
        body = bodies.get(body_id)
        if body is None:
            names.append(f"body {body_id}, which belongs to no model,")
        else:
            names.append(f'body "{body.name}" of model "{body.entity.name}"')
    verb = "has" if len(names) == 1 else "have each"
    return f"{' and '.join(names)} {verb} a pose or velocity that is not finite"
