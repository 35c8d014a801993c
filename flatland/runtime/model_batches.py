"""Changes of several models in one request: all of them, or none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from flatland.errors import BatchError, FlatlandError, WorldError
from flatland.geometry import Pose, finite_pose
from flatland.loading.model_source import ModelSources, ModelSpec

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import IfBlocked, Placement
    from flatland.runtime.plugin_host import PluginHost
    from flatland.world import World


class ModelBatches:
    """Spawns, moves and deletes several models of one world.

    Observers are notified when the whole request has succeeded.
    """

    def __init__(
        self,
        world: World,
        models: ModelSet,
        host: PluginHost,
        placement: Placement,
        observers: Observers,
    ) -> None:
        """Stores the parts of the world.

        Args:
            world: The world.
            models: Its models.
            host: Notifies plugins of moves.
            placement: Finds out whether a pose is free.
            observers: Notified of changes.
        """
        self._world = world
        self._models = models
        self._host = host
        self._placement = placement
        self._observers = observers

    @property
    def _physics(self) -> PhysicsWorld:
        return self._world.physics

    def spawn(self, specs: Sequence[ModelSpec], if_blocked: IfBlocked) -> list[Model]:
        """Spawns models one after the other; see `World.spawn_models`."""
        sources = ModelSources(self._world)
        spawned: list[Model] = []
        try:
            for index, spec in enumerate(specs):
                with _item(f"models[{index}]", index):
                    spawned.append(self._models.create(spec, if_blocked, sources))
        except BaseException:
            for model in reversed(spawned):
                self._models.discard(model)
            raise
        for model in spawned:
            self._models.announce(model, if_blocked)
        return spawned

    def move(
        self,
        poses: Sequence[tuple[str, Sequence[float]]],
        if_blocked: IfBlocked,
        keep_odometry: bool,
    ) -> list[Model]:
        """Moves models together; see `World.move_models`."""
        moved: dict[str, Model] = {}
        targets: list[Pose] = []
        for index, (name, pose) in enumerate(poses):
            with _item(f"models[{index}]", index):
                moved[name] = self._models.find_to("move", name)
                _refuse_repetition(moved, index, name)
                try:
                    targets.append(finite_pose(pose))
                except ValueError as error:
                    raise WorldError(f'failed to move model "{name}", {error}') from None
        models = list(moved.values())
        previous: list[Mapping[str, Pose]] = [
            {body.name: body.pose for body in model.bodies} for model in models
        ]
        displacements = [model.displacement for model in models]
        saved = self._physics.saved_motions()
        try:
            self._place(models, targets, if_blocked)
        except BaseException:
            self._physics.restore_motions(saved)
            for model, displacement in zip(models, displacements, strict=True):
                model.displacement = displacement
            raise
        for model, before in zip(models, previous, strict=True):
            self._host.model_moved(model, before, keep_odometry)
        for model in models:
            if if_blocked == "warn":
                self._placement.warn_if_blocked(model)
            self._observers.model_moved(model)
        return models

    def delete(self, names: Sequence[str]) -> None:
        """Deletes models; see `World.delete_models`."""
        found: dict[str, Model] = {}
        for index, name in enumerate(names):
            with _item(f"names[{index}]", index):
                found[name] = self._models.find_to("delete", name)
                _refuse_repetition(found, index, name)
        for name in found:
            # A plugin that reacts to the end of a model may have deleted the next one.
            if name in self._models.by_name:
                self._models.delete(name)

    def _place(self, models: list[Model], targets: list[Pose], if_blocked: IfBlocked) -> None:
        """Moves all models to their poses, and then away from overlaps."""
        for index, (model, target) in enumerate(zip(models, targets, strict=True)):
            with _item(f"models[{index}]", index):
                self._models.put(model, target)
        for index, (model, target) in enumerate(zip(models, targets, strict=True)):
            with _item(f"models[{index}]", index):
                chosen = self._placement.choose_pose(model, target, if_blocked, "move")
                model.displacement = (chosen[0] - target[0], chosen[1] - target[1])
                if chosen != target:
                    self._models.put(model, chosen)


@contextmanager
def _item(what: str, index: int) -> Iterator[None]:
    """Adds the item of a request to the errors of a block."""
    try:
        yield
    except FlatlandError as error:
        raise BatchError(what, index, error) from error


def _refuse_repetition(found: Mapping[str, Model], index: int, name: str) -> None:
    if len(found) <= index:
        raise WorldError(f'model "{name}" occurs twice in the request')
