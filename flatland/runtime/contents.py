"""The contents of a world: layers, models, ports; how they change, and where there is room."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

from flatland.config.reader import ReadYaml, YamlReader
from flatland.errors import WorldError
from flatland.loading.model_source import ModelSpec
from flatland.plugin_api.plugin import ModelPlugin
from flatland.runtime.appearance import Appearance
from flatland.runtime.free_places import FreePlaces
from flatland.runtime.layer_maps import LayerMaps
from flatland.runtime.many_models import ManyModels, plain_pose
from flatland.runtime.placement import IfBlocked, check_if_blocked
from flatland.runtime.saved_states import SavedStates
from flatland.runtime.state_hash import state_hash

if TYPE_CHECKING:
    from concurrent.futures import Future

    from flatland.config.inputs import Inputs
    from flatland.config.node import Source
    from flatland.entities.body import Body
    from flatland.entities.contact import Contact
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.plugin_api.plugin import FlatlandPlugin, WorldPlugin
    from flatland.plugin_api.port_registry import PortRegistry
    from flatland.plugin_api.ports import CommandTopic, Output
    from flatland.runtime.change_log import ChangeLog
    from flatland.runtime.contacts import ContactReporter
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.observer import Observers, WorldObserver
    from flatland.runtime.placement import Placement
    from flatland.runtime.plugin_host import PluginHost
    from flatland.runtime.requests import Requests
    from flatland.runtime.stepping import Stepping
    from flatland.runtime.transforms import FramePair, TransformBuffer
    from flatland.timekeeper import Timekeeper
    from flatland.values import Transform
    from flatland.world import World

R = TypeVar("R")


class Contents(ManyModels, LayerMaps, Appearance, FreePlaces, SavedStates):
    """Everything that is in a world; the base class of `World`, which creates and steps it.

    Changes that a plugin's hook requests take effect after the step.

    Attributes:
        layers: The layers in the order of the file.
        map_layer: Name of the layer that the ROS node publishes as a map; empty for none.
        plugin_host: Starts plugins and calls their hooks.
        ports: All outputs and commands by resolved topic.
        requests: The queue of actions that run between two steps.
        stepping: Performs the steps.
        transform_buffer: Collects the transforms of plugins.
        read_yaml: Loads a model file; `YamlReader.from_file`, or a method that collects errors.
        change_count: Number of models that were spawned, moved or deleted since the world file was
            loaded, including attempts that failed.
        inputs: The files and parameters that were read.
        model_path: Real paths of the folders outside which `spawn_model` reads no file; None for no
            restriction.
    """

    read_yaml: ReadYaml = YamlReader.from_file

    model_path: tuple[str, ...] | None = None

    layers: list[Layer]
    map_layer: str = ""
    physics: PhysicsWorld
    plugin_host: PluginHost
    ports: PortRegistry
    requests: Requests
    stepping: Stepping
    seed: int
    timekeeper: Timekeeper
    transform_buffer: TransformBuffer
    change_count: int
    inputs: Inputs

    _contacts: ContactReporter
    _files: Source
    _models: ModelSet
    _observers: Observers
    _paused: bool
    _former_layers: dict[str, Layer]
    _placement: Placement

    @property
    def models(self) -> list[Model]:
        """All models in the order in which they were spawned."""
        return list(self._models.by_name.values())

    def model(self, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: It does not exist.
        """
        return self._models.find(name)

    def layer(self, name: str) -> Layer:
        """Returns the layer that has a name, possibly among others.

        Raises:
            WorldError: It does not exist.
        """
        for layer in self.layers:
            if name in layer.names:
                return layer
        raise WorldError(f'layer with name "{name}" does not exist')

    def add_layer(self, layer: Layer) -> None:
        """Adds a layer whose names are registered; for the loader."""
        former = self._former_layers.pop(layer.name, None)
        if former is not None:
            former.renew(layer)
            layer = former
        self.layers.append(layer)
        self._contacts.add_bodies([layer.body])
        self.layer_changed(layer)

    def layer_changed(self, layer: Layer) -> None:
        """Notifies the observers that the edges of a layer changed."""
        self._observers.layer_changed(layer.name)

    def log_changes(self, log: ChangeLog | None) -> None:
        """Notifies a log of all further changes and steps, instead of the previous one."""
        self.stepping.change_log = log

    def resolve_path(self, path: str) -> str:
        """Returns the absolute path of a model or map file.

        Args:
            path: An absolute path, one that starts with `~`, or one relative to the folder of the
                world file, also if it is given in a file that the world file includes.
        """
        return self._files.resolve(path)

    def spawn_model(
        self,
        yaml_path: str | os.PathLike[str],
        name: str,
        namespace: str = "",
        pose: Sequence[float] = (0.0, 0.0, 0.0),
        if_blocked: IfBlocked = "warn",
    ) -> Model | None:
        """Reads a model file and adds the model to the world.

        Args:
            yaml_path: Model file; a relative path starts from the folder of the world file. Or YAML
                text that begins with a line break or with `{`; relative paths in it start there,
                too.
            name: Name of the model, unique in the world.
            namespace: Namespace of its topics and frames, may be empty.
            pose: (x, y, theta) of its first body in the world frame [m, rad].
            if_blocked: What to do if a footprint would overlap a wall or another model that it
                collides with, by more than 5 mm: `allow` nothing, `warn` log one line, `refuse`
                raise, `nearest` take the closest free place within 5 m with the same heading;
                `displacement` of the model is the distance to it.

        Returns:
            The model; None if a plugin's hook calls this: the model is then spawned after the step.

        Raises:
            FlatlandError: The model is invalid, or the pose is blocked; the world is unchanged.
            ValueError: `if_blocked` is invalid.
        """
        path = os.fspath(yaml_path)
        check_if_blocked(if_blocked)
        return self._change(
            "spawn_model",
            {
                "yaml_path": path,
                "name": name,
                "namespace": namespace,
                "pose": plain_pose(pose),
                "if_blocked": if_blocked,
            },
            lambda: self._models.spawn(ModelSpec(path, name, namespace, pose), if_blocked),
        )

    def move_model(
        self,
        name: str,
        pose: Sequence[float],
        if_blocked: IfBlocked = "warn",
        *,
        keep_odometry: bool = False,
    ) -> Model | None:
        """Moves a model rigidly so that its first body is at a pose, at rest.

        Args:
            name: Name of the model.
            pose: (x, y, theta) in the world frame [m, rad].
            if_blocked: As in `spawn_model`.
            keep_odometry: Whether the odometry of its drives, and the transform from the odometry
                frame, continue as if the model had not moved: the robot is kidnapped. By default,
                they jump along with it.

        Returns:
            The model; None if a plugin's hook calls this, since the model moves after the step.

        Raises:
            WorldError: The model does not exist, the pose is not finite or blocked; the world is
                unchanged.
            ValueError: `if_blocked` is invalid.
        """
        check_if_blocked(if_blocked)
        return self._change(
            "move_model",
            {
                "name": name,
                "pose": plain_pose(pose),
                "if_blocked": if_blocked,
                "keep_odometry": keep_odometry,
            },
            lambda: self._models.move(name, pose, if_blocked, keep_odometry),
        )

    def delete_model(self, name: str) -> None:
        """Removes a model: plugins first, then joints and bodies; from a hook, after the step.

        Raises:
            WorldError: The model does not exist.
        """
        self._change("delete_model", {"name": name}, lambda: self._models.delete(name))

    def call_plugin(
        self,
        plugin: FlatlandPlugin | str,
        method: str,
        arguments: Mapping[str, object],
        model: str = "",
    ) -> Any:
        """Calls a method of a plugin between two steps, as a change of the world.

        Recordings contain the call with its arguments, so that a replay repeats it.

        Args:
            plugin: The plugin or its name.
            method: One of `FlatlandPlugin.recorded_methods` of its class.
            arguments: Arguments of the method by name: values that a recording can contain.
            model: Name of the model if `plugin` is the name of a model plugin.

        Returns:
            What the method returns; None if a hook calls this: it is then called after the step.

        Raises:
            WorldError: The plugin or the method does not exist.
        """
        if isinstance(plugin, ModelPlugin):
            model = plugin.model.name
        name = plugin if isinstance(plugin, str) else plugin.name
        plugins: Iterable[FlatlandPlugin] = self.plugins
        if model:
            owner = self._models.by_name.get(model)
            plugins = () if owner is None else owner.plugins
        found = next((one for one in plugins if plugin in (one, one.name)), None)
        if found is None or method not in type(found).recorded_methods:
            what = f'plugin "{name}" of model "{model}"' if model else f'world plugin "{name}"'
            raise WorldError(f"{what} with the method {method} does not exist")
        call = getattr(found, method)
        return self._change(
            "call_plugin",
            {"plugin": name, "method": method, "arguments": dict(arguments), "model": model},
            lambda: call(**arguments),
        )

    def _change(
        self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]
    ) -> R | None:
        """Carries out a change; one that a hook requests is repeated by the same hook in a replay.

        Args:
            kind: Name of the method, for a recording and messages.
            arguments: Arguments of the method.
            action: The change.
        """
        is_external = not self.requests.in_hook

        def checked() -> R:
            self.check_open()
            self.change_count += 1
            return self._logged(kind, arguments if is_external else None, action)

        name = arguments.get("name")
        return self.requests.change(checked, kind if name is None else f'{kind} "{name}"')

    def _logged(
        self, kind: str, arguments: Mapping[str, object] | None, action: Callable[[], R]
    ) -> R:
        """Carries out a change, which is added to a recording if there is one.

        Args:
            kind: Name of the method.
            arguments: Arguments of the method; None if a hook repeats the change in a replay.
            action: The change.
        """
        log = self.stepping.change_log
        if log is None:
            return action()
        with log.repeated() if arguments is None else log.change(kind, arguments):
            return action()

    # -- requests --------------------------------------------------------------------------

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action that runs between two steps; see `Requests.post`."""
        return self.requests.post(action)

    def between_steps(self, action: Callable[[], R]) -> R:
        """Returns the result of a function that reads the world, run while no step is in progress.

        Safe from any thread; in a plugin's hook it runs at once.
        """
        return self.requests.read(action)

    @property
    def paused(self) -> bool:
        """Whether steps have no effect."""
        return self._paused

    def pause(self) -> None:
        """Pauses the world from the next step on."""
        self._paused = True
        self.physics.plan.interrupt()

    def resume(self) -> None:
        """Resumes a paused world."""
        self._paused = False

    def toggle_pause(self) -> None:
        """Pauses a running world, resumes a paused one."""
        self._paused = not self._paused
        self.physics.plan.interrupt()

    # -- observers -------------------------------------------------------------------------

    def add_observer(self, observer: WorldObserver) -> None:
        """Notifies an observer of all events from now on."""
        self._observers.add(observer, cast("World", self))

    def remove_observer(self, observer: WorldObserver) -> None:
        """Stops the notifications of an observer.

        Raises:
            ValueError: It was not added, or has been removed.
        """
        self._observers.remove(observer)

    # -- plugins, ports, transforms, contacts ----------------------------------------------

    @property
    def plugins(self) -> list[WorldPlugin]:
        """The world plugins in the order of the file."""
        return list(self.plugin_host.world_plugins)

    def output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic, such as `/r1/scan`, and makes it wanted.

        Raises:
            WorldError: It does not exist.
        """
        output = self.ports.find_output(topic)
        output.want(self)
        return output

    def command(self, topic: str) -> CommandTopic[Any]:
        """Returns the commands of a resolved topic, such as `/r1/cmd_vel`.

        Raises:
            WorldError: It does not exist.
        """
        return self.ports.find_command(topic)

    @property
    def transforms(self) -> dict[FramePair, Transform]:
        """The latest transform of each (parent, child)."""
        self.plugin_host.schedule.settle()
        return self.transform_buffer.latest

    @property
    def contacts(self) -> list[Contact]:
        """All pairs of fixtures that touch now."""
        return self._contacts.touching

    def body_of_id(self, body_id: int) -> Body:
        """Returns the body of a model or a layer by its id, as in `flatland.physics.Touch`.

        Raises:
            WorldError: No model or layer has it.
        """
        body = self._contacts.find_body(self.physics.body(body_id))
        if body is None:
            raise WorldError(f"no model or layer has the body {body_id}")
        return body

    # -- state -----------------------------------------------------------------------------

    def state_hash(self) -> str:
        """Returns a hash of the state: equal for two runs that have been the same so far.

        It covers, bit by bit, the time, the transforms and velocities of all bodies, the models,
        commands, random number generators and noise of all plugins, and what they return from
        `state`. It depends neither on subscribers, viewers and threads nor on the wall time.

        Returns:
            32 hexadecimal digits.

        Raises:
            WorldError: The world is closed, or the state of a plugin cannot be hashed.
        """

        def read() -> str:
            self.plugin_host.schedule.settle()
            return state_hash(self.seed, self.timekeeper, self.physics, self.models, self.plugins)

        return self._read(read)

    def _read(self, action: Callable[[], R]) -> R:
        self.check_open()
        return self.requests.read(action)

    def check_open(self) -> None:
        """Raises `WorldError` if the world is closed."""
        raise NotImplementedError
