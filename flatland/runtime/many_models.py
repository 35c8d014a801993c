"""The methods of a world that change several models in one request."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar, cast

from flatland.loading.model_source import ModelSpec
from flatland.runtime.model_batches import ModelBatches
from flatland.runtime.placement import IfBlocked, check_if_blocked

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import Placement
    from flatland.runtime.plugin_host import PluginHost
    from flatland.world import World

R = TypeVar("R")


class ManyModels:
    """The part of `World` that changes several models at once; the base class of `Contents`."""

    plugin_host: PluginHost

    _models: ModelSet
    _observers: Observers
    _placement: Placement

    def spawn_models(
        self, models: Iterable[ModelSpec], if_blocked: IfBlocked = "warn"
    ) -> list[Model] | None:
        """Adds several models to the world: all of them, or none.

        Equivalent to calls of `spawn_model` in the same order, but faster, since each file is
        parsed once.

        Args:
            models: The models.
            if_blocked: As in `spawn_model`; models before the blocked one are considered.

        Returns:
            The models in the same order; None if a plugin's hook calls this: they are then spawned
            after the step.

        Raises:
            BatchError: A model is invalid, or its pose is blocked; the world is unchanged.
            ValueError: `if_blocked` is invalid.
        """
        specs = [replace(spec, pose=plain_pose(spec.pose)) for spec in models]
        check_if_blocked(if_blocked)
        return self._change(
            "spawn_models",
            {"models": specs, "if_blocked": if_blocked},
            lambda: self._batches.spawn(specs, if_blocked),
        )

    def move_models(
        self,
        poses: Mapping[str, Sequence[float]] | Iterable[tuple[str, Sequence[float]]],
        if_blocked: IfBlocked = "warn",
        *,
        keep_odometry: bool = False,
    ) -> list[Model] | None:
        """Moves several models: all of them, or none.

        The models move together: whether a pose is blocked is determined with all others at their
        new poses, so that two models can exchange their places. With `nearest`, the models are
        moved away from blocked poses in the order of the request.

        Args:
            poses: The pose (x, y, theta) of each model in the world frame [m, rad], by name or as
                pairs (name, pose).
            if_blocked: As in `spawn_model`.
            keep_odometry: As in `move_model`.

        Returns:
            The models in the same order; None if a plugin's hook calls this, since the models move
            after the step.

        Raises:
            BatchError: A model does not exist or occurs twice, or a pose is not finite or blocked;
                the world is unchanged.
            ValueError: `if_blocked` is invalid.
        """
        pairs = poses.items() if isinstance(poses, Mapping) else poses
        targets = [(name, plain_pose(pose)) for name, pose in pairs]
        check_if_blocked(if_blocked)
        return self._change(
            "move_models",
            {"poses": targets, "if_blocked": if_blocked, "keep_odometry": keep_odometry},
            lambda: self._batches.move(targets, if_blocked, keep_odometry),
        )

    def delete_models(self, names: Iterable[str]) -> None:
        """Removes several models: all of them, or none; from a hook, after the step.

        Raises:
            BatchError: A model does not exist or occurs twice; the world is unchanged.
        """
        listed = list(names)
        self._change("delete_models", {"names": listed}, lambda: self._batches.delete(listed))

    @property
    def _batches(self) -> ModelBatches:
        world = cast("World", self)
        return ModelBatches(world, self._models, self.plugin_host, self._placement, self._observers)

    def _change(
        self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]
    ) -> R | None:
        raise NotImplementedError


def plain_pose(pose: Sequence[float]) -> Sequence[float]:
    """Returns a pose as plain numbers if it is one; an invalid one is rejected later."""
    try:
        return tuple(float(number) for number in pose)
    except (TypeError, ValueError):
        return repr(pose)  # type: ignore[return-value]
