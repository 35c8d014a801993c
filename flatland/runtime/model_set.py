"""The models of a world: spawned, moved and deleted between two steps, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from flatland.entities.model import Model
from flatland.errors import WorldError, YamlError
from flatland.geometry import Pose, finite_pose
from flatland.graph_names import is_legal_namespace
from flatland.loading.model_loader import ModelLoader
from flatland.loading.model_source import ModelSources, ModelSpec

if TYPE_CHECKING:
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.observer import Observers
    from flatland.runtime.placement import IfBlocked, Placement
    from flatland.runtime.plugin_host import PluginHost
    from flatland.runtime.requests import Requests
    from flatland.world import World


class ModelSet:
    """The models of one world by name, in the order in which they were spawned.

    Attributes:
        by_name: The models; not to be changed from outside.
    """

    def __init__(
        self,
        world: World,
        host: PluginHost,
        contacts: ContactReporter,
        placement: Placement,
        observers: Observers,
        requests: Requests,
    ) -> None:
        """Creates an empty set.

        Args:
            world: The world of the models.
            host: Starts and ends the plugins of models.
            contacts: Reports the contacts of the bodies.
            placement: Finds out whether a pose is free.
            observers: Notified of changes.
            requests: Notified while plugins react to the end of a model.
        """
        self.by_name: dict[str, Model] = {}
        self._world = world
        self._host = host
        self._contacts = contacts
        self._placement = placement
        self._observers = observers
        self._requests = requests

    def find(self, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: It does not exist.
        """
        try:
            return self.by_name[name]
        except KeyError:
            raise WorldError(f'model with name "{name}" does not exist') from None

    def spawn(self, spec: ModelSpec, if_blocked: IfBlocked) -> Model:
        """Creates a model; see `World.spawn_model`."""
        model = self.create(spec, if_blocked, ModelSources(self._world))
        self.announce(model, if_blocked)
        return model

    def create(self, spec: ModelSpec, if_blocked: IfBlocked, sources: ModelSources) -> Model:
        """Adds a model to the world; `announce` or `discard` must follow.

        Args:
            spec: The model.
            if_blocked: As for `World.spawn_model`.
            sources: Reads the model file.

        Raises:
            FlatlandError: The model is invalid, or the pose is blocked; nothing was changed.
        """
        world, name = self._world, spec.name
        checked_pose = self._check_spawn(spec)
        path, reader = sources.read(spec.yaml_path)
        model = Model(world, name, spec.namespace, path)
        loader = ModelLoader(world.physics, world.collision_filter, model, reader)
        try:
            loader.load_bodies_and_joints(checked_pose)
            self._place(model, model.pose, if_blocked, "spawn")
            self._contacts.add_bodies(model.bodies)
            for entry in self._host.require_plugins(loader.plugin_entries(), name):
                with entry.collect_errors():
                    self._host.start_model_plugin(model, entry)
        except BaseException:
            self._remove(model)
            raise
        self.by_name[name] = model
        return model

    def announce(self, model: Model, if_blocked: IfBlocked) -> None:
        """Notifies the observers of a created model, and logs if its pose is blocked."""
        if if_blocked == "warn":
            self._placement.warn_if_blocked(model)
        self._observers.model_added(model)

    def discard(self, model: Model) -> None:
        """Removes a created model of which the observers were not notified."""
        # A plugin of a later model may have deleted it.
        if self.by_name.get(model.name) is model:
            del self.by_name[model.name]
            self._remove(model)

    def put(self, model: Model, pose: Pose) -> None:
        """Moves a model to a pose, whether it is blocked or not.

        Raises:
            WorldError: The pose is out of the range of the physics.
        """
        try:
            model.set_pose(*pose)
        except ValueError as error:
            raise WorldError(f'failed to move model "{model.name}", {error}') from None

    def move(
        self, name: str, pose: Sequence[float], if_blocked: IfBlocked, keep_odometry: bool
    ) -> Model:
        """Moves a model; see `World.move_model`."""
        model = self.find_to("move", name)
        previous = {body.name: body.pose for body in model.bodies}
        try:
            self._place(model, finite_pose(pose), if_blocked, "move")
        except ValueError as error:
            raise WorldError(f'failed to move model "{name}", {error}') from None
        self._host.model_moved(model, previous, keep_odometry)
        if if_blocked == "warn":
            self._placement.warn_if_blocked(model)
        self._observers.model_moved(model)
        return model

    def delete(self, name: str) -> None:
        """Deletes a model; see `World.delete_model`."""
        model = self.find_to("delete", name)
        del self.by_name[name]
        self._remove(model)
        self._observers.model_removed(model)

    def _check_spawn(self, spec: ModelSpec) -> Pose:
        name, namespace = spec.name, spec.namespace
        if not name:
            raise WorldError("failed to spawn model, its name must not be empty")
        if name in self.by_name:
            raise YamlError(f'Model with name "{name}" already exists')
        if not spec.yaml_path:
            raise WorldError(f'failed to spawn model "{name}", the path must not be empty')
        if not is_legal_namespace(namespace):
            raise WorldError(
                f'failed to spawn model "{name}", namespace "{namespace}" is not a legal ROS '
                'name: it must start with a letter and hold only letters, digits, "_" and "/"'
            )
        try:
            return finite_pose(spec.pose)
        except ValueError as error:
            raise WorldError(f'failed to spawn model "{name}", {error}') from None

    def find_to(self, verb: str, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: It does not exist; the text names the operation.
        """
        try:
            return self.by_name[name]
        except KeyError:
            raise WorldError(
                f'failed to {verb} model, model with name "{name}" does not exist'
            ) from None

    def _place(self, model: Model, pose: Pose, if_blocked: IfBlocked, verb: str) -> None:
        """Puts a model at a pose, or at another one if that is blocked."""
        chosen = self._placement.choose_pose(model, pose, if_blocked, verb)
        # The bodies of a new model are already where its file puts them, exactly.
        if verb == "move" or chosen != pose:
            model.set_pose(*chosen)
        model.displacement = (chosen[0] - pose[0], chosen[1] - pose[1])

    def _remove(self, model: Model) -> None:
        """Removes a complete or incomplete model; other plugins are notified of ended contacts."""
        self._host.shut_down(model.plugins)
        for joint in reversed(model.joints):
            joint.destroy()
        for body in reversed(model.bodies):
            body.destroy()
        with self._requests.hooks():
            self._contacts.dispatch()
        self._contacts.remove_bodies(model.bodies)
