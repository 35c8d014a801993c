"""The models of a world: spawned, moved and deleted between two steps, all or nothing."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from flatland.checks import checked_names, plain_path, quoted, shown
from flatland.errors import BatchError, FlatlandError, WorldError, YamlError
from flatland.geometry import Pose, finite_pose
from flatland.graph_names import check_model_name, check_namespace
from flatland.loading.model_loader import ModelLoader
from flatland.loading.model_source import ModelSources, ModelSpec
from flatland.runtime.appearance import (
    checked_color,
    find_bodies,
    layer_bits,
    new_color,
    plain_numbers,
    set_layers,
)
from flatland.runtime.placement import check_if_blocked
from flatland.suggestions import did_you_mean

if TYPE_CHECKING:
    from flatland.entities.collision_filter import CollisionFilter
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.runtime.changes import Changes
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import IfBlocked, Placement
    from flatland.runtime.plugin_host import PluginHost
    from flatland.runtime.requests import Requests


class ModelSet:
    """The models of one world, in the order in which they were spawned.

    A request for several models changes all of them or none. Observers are notified when it has
    succeeded.

    Attributes:
        by_name: The models by name; not to be changed from outside.
    """

    def __init__(
        self,
        physics: PhysicsWorld,
        collision_filter: CollisionFilter,
        make_model: Callable[[str, str, str], Model],
        host: PluginHost,
        contacts: ContactReporter,
        placement: Placement,
        observers: Observers,
        requests: Requests,
        changes: Changes,
        new_sources: Callable[[], ModelSources],
    ) -> None:
        """Creates an empty set.

        Args:
            physics: Contains the bodies and joints.
            collision_filter: The names of layers.
            make_model: Returns an empty model with a name, a namespace and a path.
            host: Starts and ends the plugins of models.
            contacts: Reports the contacts of the bodies.
            placement: Finds out whether a pose is free.
            observers: Notified of changes.
            requests: Notified while plugins react to the end of a model.
            changes: Carries out the changes.
            new_sources: Returns a reader of the model files of one request.
        """
        self.by_name: dict[str, Model] = {}
        self._physics = physics
        self._collision_filter = collision_filter
        self._make_model = make_model
        self._host = host
        self._contacts = contacts
        self._placement = placement
        self._observers = observers
        self._requests = requests
        self._changes = changes
        self._new_sources = new_sources

    def __getstate__(self) -> dict[str, Model]:
        """Returns the part of the state of the world that a snapshot saves."""
        return self.by_name.copy()

    def __setstate__(self, models: dict[str, Model]) -> None:
        """Restores a saved state."""
        self.by_name.clear()
        self.by_name.update(models)

    def find(self, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: The model does not exist.
        """
        try:
            return self.by_name[name]
        except (KeyError, TypeError):
            similar = ""
            if self.by_name and isinstance(name, str):
                similar = did_you_mean(name, self.by_name, "models of the world")
            text = f"model with name {quoted(name)} does not exist"
            raise WorldError(text, hint=similar) from None

    # -- requests --------------------------------------------------------------------------

    def spawn_model(
        self,
        yaml_path: str | os.PathLike[str],
        name: str,
        namespace: str,
        pose: Sequence[float],
        if_blocked: IfBlocked,
    ) -> Model | None:
        """Adds a model; see `World.spawn_model`."""
        check_if_blocked(if_blocked)
        spec = self._checked_spec(yaml_path, name, namespace, pose)
        arguments = {
            "yaml_path": spec.yaml_path,
            "name": name,
            "namespace": namespace,
            "pose": spec.pose,
            "if_blocked": if_blocked,
        }
        return self._changes.make("spawn_model", arguments, lambda: self._spawn(spec, if_blocked))

    def move_model(
        self, name: str, pose: Sequence[float], if_blocked: IfBlocked, keep_odometry: bool
    ) -> Model | None:
        """Moves a model; see `World.move_model`."""
        check_if_blocked(if_blocked)
        target = _checked_pose("move", name, pose)
        arguments = {
            "name": name,
            "pose": target,
            "if_blocked": if_blocked,
            "keep_odometry": keep_odometry,
        }
        return self._changes.make(
            "move_model",
            arguments,
            lambda: self._move(name, target, if_blocked, keep_odometry),
        )

    def delete_model(self, name: str) -> None:
        """Removes a model; see `World.delete_model`."""
        self._changes.make("delete_model", {"name": name}, lambda: self.delete(name))

    def spawn_models(
        self, models: Iterable[ModelSpec], if_blocked: IfBlocked
    ) -> list[Model] | None:
        """Adds several models; see `World.spawn_models`."""
        check_if_blocked(if_blocked)
        specs = []
        for index, spec in enumerate(models):
            with _item(f"models[{index}]", index):
                if not isinstance(spec, ModelSpec):
                    raise WorldError(f"a model must be a ModelSpec, got {shown(spec)}")
                specs.append(
                    self._checked_spec(spec.yaml_path, spec.name, spec.namespace, spec.pose)
                )
        arguments = {"models": specs, "if_blocked": if_blocked}
        return self._changes.make(
            "spawn_models", arguments, lambda: self._spawn_all(specs, if_blocked)
        )

    def move_models(
        self,
        poses: Mapping[str, Sequence[float]] | Iterable[tuple[str, Sequence[float]]],
        if_blocked: IfBlocked,
        keep_odometry: bool,
    ) -> list[Model] | None:
        """Moves several models; see `World.move_models`."""
        check_if_blocked(if_blocked)
        targets = []
        for index, (name, pose) in enumerate(_pairs(poses)):
            with _item(f"models[{index}]", index):
                targets.append((name, _checked_pose("move", name, pose)))
        return self._changes.make(
            "move_models",
            {"poses": targets, "if_blocked": if_blocked, "keep_odometry": keep_odometry},
            lambda: self._move_all(targets, if_blocked, keep_odometry),
        )

    def delete_models(self, names: Iterable[str]) -> None:
        """Removes several models; see `World.delete_models`."""
        listed = checked_names("names", names)
        self._changes.make("delete_models", {"names": listed}, lambda: self._delete_all(listed))

    def set_appearance(
        self,
        model: str,
        body: str,
        color: Sequence[float] | None,
        layers: str | Iterable[str] | None,
        visible: bool | None,
    ) -> None:
        """Changes colour, layers and visibility; see `World.set_appearance`."""
        names = None if layers is None else checked_names("layers", layers)
        numbers = None if color is None else plain_numbers(color)
        shown = None if visible is None else bool(visible)
        self._changes.make(
            "set_appearance",
            {"model": model, "body": body, "color": numbers, "layers": names, "visible": shown},
            lambda: self._set_appearance(model, body, numbers, names, shown),
        )

    # -- changes ---------------------------------------------------------------------------

    def _spawn(self, spec: ModelSpec, if_blocked: IfBlocked) -> Model:
        model = self._create(spec, if_blocked, self._new_sources())
        self._announce(model, if_blocked)
        return model

    def _spawn_all(self, specs: Sequence[ModelSpec], if_blocked: IfBlocked) -> list[Model]:
        """Spawns models one after the other."""
        sources = self._new_sources()
        spawned: list[Model] = []
        count, newest = len(self.by_name), self._physics.newest_objects
        try:
            for index, spec in enumerate(specs):
                with _item(f"models[{index}]", index):
                    spawned.append(self._create(spec, if_blocked, sources))
        except BaseException:
            self._undo_spawns(count, spawned)
            self._destroy_unowned(newest)
            raise
        for model in spawned:
            self._announce(model, if_blocked)
        return spawned

    def _move_all(
        self,
        poses: Sequence[tuple[str, Pose]],
        if_blocked: IfBlocked,
        keep_odometry: bool,
    ) -> list[Model]:
        """Moves models together."""
        moved: dict[str, Model] = {}
        for index, (name, _) in enumerate(poses):
            with _item(f"models[{index}]", index):
                moved[name] = self._find_to("move", name)
                _refuse_repetition(moved, index, name)
        models, targets = list(moved.values()), [pose for _, pose in poses]
        previous: list[Mapping[str, Pose]] = [
            {body.name: body.pose for body in model.bodies} for model in models
        ]
        displacements = [model.displacement for model in models]
        saved = self._physics.saved_motions()
        try:
            self._place_all(models, targets, if_blocked)
        except BaseException:
            self._physics.restore_motions(saved)
            for model, displacement in zip(models, displacements, strict=True):
                model.displacement = displacement
            raise
        self._announce_moves(models, previous, if_blocked, keep_odometry)
        return models

    def _announce_moves(
        self,
        models: list[Model],
        previous: list[Mapping[str, Pose]],
        if_blocked: IfBlocked,
        keep_odometry: bool,
    ) -> None:
        """Notifies the plugins of moved models and the observers, and logs blocked poses."""
        for model, before in zip(models, previous, strict=True):
            self._host.model_moved(model, before, keep_odometry)
        for model in models:
            if if_blocked == "warn":
                self._placement.warn_if_blocked(model)
            self._observers.model_moved(model)

    def _delete_all(self, names: Sequence[str]) -> None:
        """Deletes models one after the other."""
        found: dict[str, Model] = {}
        for index, name in enumerate(names):
            with _item(f"names[{index}]", index):
                found[name] = self._find_to("delete", name)
                _refuse_repetition(found, index, name)
        for name in found:
            # A plugin that reacts to the end of a model may have deleted the next one.
            if name in self.by_name:
                self.delete(name)

    def _place_all(self, models: list[Model], targets: list[Pose], if_blocked: IfBlocked) -> None:
        """Moves all models to their poses, and then away from overlaps."""
        for index, (model, target) in enumerate(zip(models, targets, strict=True)):
            with _item(f"models[{index}]", index):
                self._put(model, target)
        for index, (model, target) in enumerate(zip(models, targets, strict=True)):
            with _item(f"models[{index}]", index):
                chosen = self._placement.choose_pose(model, target, if_blocked, "move")
                model.displacement = (chosen[0] - target[0], chosen[1] - target[1])
                if chosen != target:
                    self._put(model, chosen)

    # -- changes of one model ---------------------------------------------------------------

    def _create(self, spec: ModelSpec, if_blocked: IfBlocked, sources: ModelSources) -> Model:
        """Adds a model to the world; `_announce` or `_undo_spawns` must follow.

        Args:
            spec: The model.
            if_blocked: As for `World.spawn_model`.
            sources: Reads the model file.

        Raises:
            FlatlandError: The model is invalid, or the pose is blocked; nothing was changed.
        """
        name = spec.name
        if name in self.by_name:
            raise YamlError(f'Model with name "{name}" already exists')
        path, reader = sources.read(spec.yaml_path)
        model = self._make_model(name, spec.namespace, path)
        loader = ModelLoader(self._physics, self._collision_filter, model, reader)
        count, newest = len(self.by_name), self._physics.newest_objects
        try:
            loader.load_bodies_and_joints(finite_pose(spec.pose))
            self._place(model, model.pose, if_blocked, "spawn")
            self._contacts.add_bodies(model.bodies)
            for entry in self._host.require_plugins(loader.plugin_entries(), name):
                with entry.collect_errors():
                    self._host.start_model_plugin(model, entry)
        except BaseException:
            self._undo_spawns(count)
            self._remove(model)
            self._destroy_unowned(newest)
            raise
        self.by_name[name] = model
        return model

    def _announce(self, model: Model, if_blocked: IfBlocked) -> None:
        """Notifies the observers of a created model, and logs if its pose is blocked."""
        if if_blocked == "warn":
            self._placement.warn_if_blocked(model)
        self._observers.model_added(model)

    def _destroy_unowned(self, newest: tuple[int, int]) -> None:
        """Destroys what the plugins of failed models have created besides models.

        Args:
            newest: Value of `PhysicsWorld.newest_objects` before the plugins were started.
        """
        bodies, joints = self._physics.objects_since(newest)
        for joint in map(self._physics.joint, joints):
            joint.destroy()
        for body in map(self._physics.body, bodies):
            if self._contacts.find_body(body) is None:
                body.destroy()

    def _undo_spawns(self, before: int, unannounced: Sequence[Model] = ()) -> None:
        """Removes the newest models, also those that plugins have spawned meanwhile.

        Args:
            before: Number of models before.
            unannounced: Models of which the observers were not notified.
        """
        for name, model in reversed(list(self.by_name.items())[before:]):
            # A plugin that reacts to the end of a model may have deleted others.
            if self.by_name.get(name) is not model:
                continue
            if model in unannounced:
                del self.by_name[name]
                self._remove(model)
            else:
                self.delete(name)

    def _put(self, model: Model, pose: Pose) -> None:
        """Moves a model to a pose, whether it is blocked or not.

        Raises:
            WorldError: The pose is out of the range of the physics.
        """
        try:
            model.set_pose(*pose)
        except ValueError as error:
            raise WorldError(f'failed to move model "{model.name}", {error}') from None

    def _move(self, name: str, pose: Pose, if_blocked: IfBlocked, keep_odometry: bool) -> Model:
        model = self._find_to("move", name)
        previous = {body.name: body.pose for body in model.bodies}
        try:
            self._place(model, pose, if_blocked, "move")
        except ValueError as error:
            raise WorldError(f'failed to move model "{name}", {error}') from None
        self._announce_moves([model], [previous], if_blocked, keep_odometry)
        return model

    def _set_appearance(
        self,
        name: str,
        body_name: str,
        color: tuple[float, ...] | str | None,
        layers: list[str] | None,
        visible: bool | None,
    ) -> None:
        model = self._find_to("change the appearance of", name)
        try:
            bodies = find_bodies(model, body_name)
            painted = None if color is None else checked_color(color)
            bits = None if layers is None else layer_bits(self._collision_filter, layers)
        except WorldError as error:
            text = f'failed to change the appearance of model "{name}", {error.message}'
            raise WorldError(text, hint=error.hint) from None
        for body in bodies:
            if painted is not None:
                body.color = new_color(body.color, painted)
            if visible is not None:
                body.visible = visible
        if bits is not None:
            set_layers(bodies, bits)
            self._physics.find_new_contacts()
            # A body that rested on the model, or that the model now overlaps, may be asleep.
            self._wake()
            self._placement.warn_if_blocked(model)
        self._observers.model_changed(model)

    def delete(self, name: str) -> None:
        """Deletes a model; see `World.delete_model`."""
        model = self._find_to("delete", name)
        del self.by_name[name]
        try:
            self._remove(model)
        finally:
            self._observers.model_removed(model)

    def clear(self) -> None:
        """Deletes all models, the last one first."""
        for name in reversed(list(self.by_name)):
            # A plugin that reacts to the end of a model may have deleted others.
            if name in self.by_name:
                self.delete(name)

    def react_to_walls(self) -> None:
        """Wakes all models after a change of walls, and logs those that overlap walls."""
        self._wake()
        for model in self.by_name.values():
            self._placement.warn_if_blocked(model)

    def _wake(self) -> None:
        for model in self.by_name.values():
            for body in model.bodies:
                body.awake = True

    def _checked_spec(
        self,
        yaml_path: str | os.PathLike[str],
        name: str,
        namespace: str,
        pose: Sequence[float],
    ) -> ModelSpec:
        """Returns a model to spawn; see `ModelSpec` for the arguments.

        Raises:
            WorldError: An argument is invalid.
        """
        try:
            check_model_name(name, is_of_file=self._new_sources().of_world_file)
        except ValueError as error:
            raise WorldError(f"failed to spawn model, {error}") from None
        try:
            path = plain_path("yaml_path", yaml_path)
            check_namespace(namespace)
        except ValueError as error:
            raise WorldError(f'failed to spawn model "{name}", {error}') from None
        if not path:
            raise WorldError(f'failed to spawn model "{name}", the path must not be empty')
        return ModelSpec(path, name, namespace, _checked_pose("spawn", name, pose))

    def _find_to(self, verb: str, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: The model does not exist; the text names the operation.
        """
        try:
            return self.find(name)
        except WorldError as error:
            raise WorldError(f"failed to {verb} model, {error.message}", hint=error.hint) from None

    def _place(self, model: Model, pose: Pose, if_blocked: IfBlocked, verb: str) -> None:
        """Puts a model at a pose, or at another one if that is blocked."""
        chosen = self._placement.choose_pose(model, pose, if_blocked, verb)
        # The bodies of a new model are already where its file puts them, exactly.
        if verb == "move" or chosen != pose:
            model.set_pose(*chosen)
        model.displacement = (chosen[0] - pose[0], chosen[1] - pose[1])

    def _remove(self, model: Model) -> None:
        """Removes a complete or incomplete model; other plugins are notified of ended contacts."""
        try:
            self._host.shut_down(model.plugins)
        finally:
            # A plugin may have destroyed some of them.
            for joint in reversed(model.joints):
                if joint.alive:
                    joint.destroy()
            for body in reversed(model.bodies):
                if body.alive:
                    body.destroy()
            try:
                with self._requests.hooks():
                    self._contacts.dispatch()
            finally:
                self._contacts.remove_bodies(model.bodies)


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


def _pairs(
    poses: Mapping[str, Sequence[float]] | Iterable[tuple[str, Sequence[float]]],
) -> list[tuple[str, Sequence[float]]]:
    """Returns the poses of models as pairs (name, pose).

    Raises:
        ValueError: They are neither a dictionary nor pairs.
    """
    try:
        pairs = poses.items() if isinstance(poses, Mapping) else poses
        return [(name, pose) for name, pose in pairs]
    except (TypeError, ValueError):
        raise ValueError(
            f"poses must be a dictionary of poses by name, or pairs (name, pose), got "
            f"{shown(poses)}"
        ) from None


def _checked_pose(verb: str, name: object, pose: Sequence[float]) -> Pose:
    """Returns the pose of a request.

    Args:
        verb: Name of the operation for the error, such as `spawn`.
        name: Name of the model.
        pose: The pose.

    Raises:
        WorldError: It does not consist of three finite numbers.
    """
    try:
        return finite_pose(pose)
    except ValueError as error:
        raise WorldError(f"failed to {verb} model {quoted(name)}, {error}") from None
