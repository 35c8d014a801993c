"""The world: layers, models and plugins, stepped together."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

import numpy as np
import numpy.typing as npt

from flatland.checks import (
    check_function,
    check_kind,
    checked_count,
    checked_number,
    checked_path,
)
from flatland.config.inputs import Params
from flatland.defaults import WEB_HOST
from flatland.entities.collision_filter import CollisionFilter
from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.errors import WorldError
from flatland.loading.model_source import ModelSources, ModelSpec
from flatland.loading.world_loader import MAX_ITERATIONS, load_world, reload_world
from flatland.loading.world_source import WorldSource
from flatland.physics import PhysicsWorld
from flatland.plugin_api.noise import checked_seed
from flatland.plugin_api.port_registry import PortRegistry
from flatland.runtime.body_monitor import BodyMonitor, InvalidBodyPolicy
from flatland.runtime.changes import ChangeLog, Changes
from flatland.runtime.faults import FaultPolicy, Faults
from flatland.runtime.layer_set import LayerSet
from flatland.runtime.model_set import ModelSet
from flatland.runtime.model_states import ModelStates, model_states
from flatland.runtime.observer import Observers, WorldObserver
from flatland.runtime.placement import IfBlocked, Models, Placement
from flatland.runtime.plugin_calls import recorded_method
from flatland.runtime.plugin_host import PluginHost
from flatland.runtime.randomization import randomize_plugins
from flatland.runtime.requests import Requests
from flatland.runtime.snapshot import Snapshots, WorldSnapshot
from flatland.runtime.state_hash import state_hash
from flatland.runtime.stepping import MAX_STEPS, Stepping
from flatland.runtime.transforms import TransformBuffer
from flatland.timekeeper import Timekeeper
from flatland.uncopied import uncopied
from flatland.values import OccupancyGrid

if TYPE_CHECKING:
    from concurrent.futures import Future

    from flatland.entities.body import Body
    from flatland.entities.contact import Contact
    from flatland.geometry import DoubleArray
    from flatland.plugin_api.plugin import FlatlandPlugin, WorldPlugin
    from flatland.plugin_api.ports import CommandTopic, Output
    from flatland.runtime.transforms import FramePair
    from flatland.values import Transform

_LOG = logging.getLogger("flatland")

R = TypeVar("R")


@uncopied("World.clone() returns an independent copy, World.snapshot() a state for World.restore()")
class World:
    """A simulated world; created by `World.from_yaml`.

    One thread steps it. Other threads may spawn, move and delete models and set commands at any
    time: their requests are carried out between two steps (`flatland.runtime.requests`). Changes
    that a plugin's hook requests take effect after the step.

    The world creates its parts, and is their interface: most methods call the part that does the
    work.

    Attributes:
        timekeeper: The simulated time.
        physics: The physics world: ray casts, and all that is not part of models and layers.
        collision_filter: Layer names and their bits.
        seed: Seed of all random numbers.
        source: The file of the world, and how this file and all other files are read.
        plugin_host: Starts plugins and calls their hooks.
        ports: All outputs and commands by resolved topic.
        requests: The queue of actions that run between two steps.
        stepping: Performs the steps.
        transform_buffer: Collects the transforms of plugins.
        plugin_errors: Policy for exceptions, see `from_yaml`.
        on_invalid_body: Policy for invalid bodies, see `from_yaml`.
    """

    def __init__(  # noqa: D417 - the other arguments are those of from_yaml
        self,
        *,
        source: WorldSource | None = None,
        collision_filter: CollisionFilter | None = None,
        seed: int | None = None,
        step_size: float = 0.005,
        velocity_iterations: int = 10,
        position_iterations: int = 10,
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = None,
        plugin_errors: FaultPolicy = "raise",
        on_invalid_body: InvalidBodyPolicy = "raise",
    ) -> None:
        """Creates an empty world; `from_yaml` describes the other arguments.

        Args:
            source: The file of the world; None for a world without a file.
            collision_filter: Names the layers; None for a filter without layers.
            velocity_iterations: Velocity iterations of the Box2D solver.
            position_iterations: Position iterations of the Box2D solver.

        Raises:
            ValueError: An argument is out of range.
        """
        if plugin_timeout is not None:
            plugin_timeout = checked_number("plugin_timeout", plugin_timeout, "s")
            if not plugin_timeout > 0:
                text = f"plugin_timeout must be positive [s] or None, got {plugin_timeout}"
                raise ValueError(text)
        self.source = WorldSource() if source is None else source
        self.seed = checked_seed(seed)
        self._velocity_iterations = _checked_iterations("velocity", velocity_iterations)
        self._position_iterations = _checked_iterations("position", position_iterations)
        self.plugin_errors, self.on_invalid_body = plugin_errors, on_invalid_body
        self._paused = False
        self._closed = False
        self._view: OpenView | None = None

        self.physics = PhysicsWorld()
        self.timekeeper = Timekeeper(step_size, self.physics)
        self.collision_filter = collision_filter or CollisionFilter()
        self.requests = Requests(self.physics.jobs.interrupt)
        self._changes = Changes(self.requests, self.check_open)
        self._faults = Faults(plugin_errors)
        self._observers = Observers(self._faults)
        self.transform_buffer = TransformBuffer(self._observers)
        self.plugin_host = PluginHost(
            self, self._observers, self.requests, self._faults, plugin_timeout
        )
        self.ports: PortRegistry = PortRegistry(
            self._observers,
            self._faults.add_of_subscriber,
            self.plugin_host.jobs.change,
            self.plugin_host.find_owner,
        )
        self._contacts = self.plugin_host.contacts
        self._layers = LayerSet(
            self.source,
            self.physics,
            self._contacts,
            self._observers,
            self.requests,
            self._changes,
            lambda: self._models.react_to_walls(),
        )
        self._placement = Placement(
            self.physics,
            self.collision_filter,
            self._layers,
            self._contacts,
            self.model,
            lambda: self.seed,
        )
        self._models: ModelSet = ModelSet(
            self.physics,
            self.collision_filter,
            partial(Model, self),
            self.plugin_host,
            self._contacts,
            self._placement,
            self._observers,
            self.requests,
            self._changes,
            lambda: ModelSources(self.source),
        )
        self._body_monitor = BodyMonitor(
            self.physics, self._contacts, self._models, on_invalid_body
        )
        self.stepping = Stepping(
            self,
            self.plugin_host,
            self._body_monitor,
            self._observers,
            self.transform_buffer,
            self._faults,
        )
        self._snapshots = Snapshots(
            (
                _Settings(self),
                self.timekeeper,
                self.collision_filter,
                self.plugin_host,
                self.ports,
                self.transform_buffer,
                self._changes,
                self._faults,
                self._contacts,
                self._layers,
                self._placement,
                self._models,
                self._body_monitor,
            ),
            (self, self.requests, self.stepping, self._observers),
            self.physics,
            self.timekeeper,
            self._layers,
            self._models,
            self.plugin_host,
            self.ports,
            self._observers,
        )
        self._observers.add(self._body_monitor)
        for observer in observers:
            self.add_observer(observer)

    @classmethod
    def from_yaml(
        cls,
        path: str | os.PathLike[str],
        seed: int | None = None,
        params: Params = None,
        simplify_map: int = 0,
        step_size: float = 0.005,
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = None,
        plugin_errors: FaultPolicy = "raise",
        on_invalid_body: InvalidBodyPolicy = "raise",
        model_path: Iterable[str | os.PathLike[str]] | None = None,
    ) -> World:
        """Loads a world file: properties, layers, models with their plugins, world plugins.

        Args:
            path: The world file.
            seed: Seed of all random numbers, at least 0; None draws a seed and logs it.
            params: Source of the values of `param()` in YAML files: a dictionary, or a function
                that returns None for an unknown name.
            simplify_map: 0 exact, 1 simplified, 2 opened and simplified map boundaries.
            step_size: Simulated time of one step [s].
            observers: Receive notifications of all events from the start.
            plugin_timeout: Limit of wall time of `on_initialize` of a plugin [s], None for no
                limit; see `flatland.runtime.time_limit`.
            plugin_errors: What happens to exceptions of hooks, subscribers and observers; none of
                them interrupts a step. `raise`: `step` raises the first one when the step is
                complete. `disable`: they are logged, and a plugin whose hook raises three times in
                a row is disabled.
            on_invalid_body: What happens if a step leaves a body with a pose or velocity that is
                not finite. `raise`: `step` raises, and raises again, until the model is moved or
                deleted; the time stands still. `remove`: the model is removed with a logged error.
            model_path: Folders outside which `spawn_model` reads no file; None: no restriction.

        Raises:
            FlatlandError: A file is invalid; nothing is left behind.
            ValueError: An argument is out of range.
        """
        return load_world(
            cls,
            WorldSource(path, params=params, simplify_map=simplify_map, model_path=model_path),
            seed=seed,
            step_size=step_size,
            observers=observers,
            plugin_timeout=plugin_timeout,
            plugin_errors=plugin_errors,
            on_invalid_body=on_invalid_body,
        )

    def __enter__(self) -> World:
        """Returns the world, which is closed at the end of the block."""
        return self

    def __exit__(self, *error: object) -> None:
        """Closes the world; exceptions of the block take precedence over exceptions of plugins."""
        try:
            self.close()
        except Exception:
            if error[0] is None:
                raise
            _LOG.exception("closing the world failed")

    def __repr__(self) -> str:
        """Returns the file, the time and the number of layers and models."""
        file = "/".join(Path(self.path).parts[-2:])
        if self._closed:
            return f"<World {file!r}, closed>"
        counts = f"layers: {len(self.layers)}, models: {len(self._models.by_name)}"
        return f"<World {file!r} at {self.time:.3f} s, {counts}>"

    @property
    def path(self) -> str:
        """Absolute path of the world file, empty for none; relative paths start from its folder."""
        return self.source.path

    @property
    def params(self) -> Params:
        """Source of the values of `param()` in YAML files."""
        return self.source.params

    @property
    def map_layer(self) -> str:
        """Name of the layer that the ROS node publishes as a map; empty for none."""
        return self.source.map_layer

    @property
    def model_path(self) -> tuple[str, ...] | None:
        """Real paths of the folders outside which `spawn_model` reads no file; None for all."""
        return self.source.inputs.folders

    # -- time and steps ------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.timekeeper.sim_time

    @property
    def velocity_iterations(self) -> int:
        """Velocity iterations of the Box2D solver; settable."""
        return self._velocity_iterations

    @velocity_iterations.setter
    def velocity_iterations(self, count: int) -> None:
        self._velocity_iterations = _checked_iterations("velocity", count)
        self.physics.jobs.interrupt()

    @property
    def position_iterations(self) -> int:
        """Position iterations of the Box2D solver; settable."""
        return self._position_iterations

    @position_iterations.setter
    def position_iterations(self, count: int) -> None:
        self._position_iterations = _checked_iterations("position", count)
        self.physics.jobs.interrupt()

    def step(self, n: int = 1, *, while_paused: bool = False) -> None:
        """Steps `n` times; has no effect on a paused world unless `while_paused` is true.

        Args:
            n: Number of steps, at least 0.
            while_paused: Whether a paused world is stepped as well.

        Raises:
            ValueError: `n` is no integer, or out of range.
            WorldError: The world is closed, a plugin calls this, or a body is not finite.
            Exception: Raised by a plugin, subscriber or observer, with `plugin_errors="raise"`.
        """
        if type(n) is not int or not 0 <= n <= MAX_STEPS:
            n = checked_count("n", n, 0, MAX_STEPS)
        self.stepping.step(n, while_paused=while_paused)

    @property
    def paused(self) -> bool:
        """Whether steps have no effect."""
        return self._paused

    def pause(self) -> None:
        """Pauses the world from the next step on."""
        self._paused = True
        self.physics.jobs.interrupt()

    def resume(self) -> None:
        """Resumes a paused world."""
        self._paused = False

    def toggle_pause(self) -> None:
        """Pauses a running world, resumes a paused one."""
        self._paused = not self._paused
        self.physics.jobs.interrupt()

    # -- models --------------------------------------------------------------------------------

    @property
    def models(self) -> list[Model]:
        """All models in the order in which they were spawned."""
        return list(self._models.by_name.values())

    def model(self, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: The model does not exist.
        """
        return self._models.find(name)

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
        return self._models.spawn_model(yaml_path, name, namespace, pose, if_blocked)

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
        return self._models.move_model(name, pose, if_blocked, keep_odometry)

    def delete_model(self, name: str) -> None:
        """Removes a model: plugins first, then joints and bodies; from a hook, after the step.

        Raises:
            WorldError: The model does not exist.
        """
        self._models.delete_model(name)

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
        return self._models.spawn_models(models, if_blocked)

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
        return self._models.move_models(poses, if_blocked, keep_odometry)

    def delete_models(self, names: Iterable[str]) -> None:
        """Removes several models: all of them, or none; from a hook, after the step.

        Raises:
            BatchError: A model does not exist or occurs twice; the world is unchanged.
        """
        self._models.delete_models(names)

    def set_appearance(
        self,
        model: str,
        body: str = "",
        *,
        color: Sequence[float] | None = None,
        layers: str | Iterable[str] | None = None,
        visible: bool | None = None,
    ) -> None:
        """Changes the colour, layers and visibility of bodies of a model: all, or nothing.

        New layers change what the footprints collide with, and which lasers detect them. Footprints
        that have no layers (`layers: []`) or collide with nothing (`collision: false`) remain so. A
        model that then overlaps walls or other models is logged with a warning, and all bodies
        wake. `visible` affects only markers and drawings. `reset` returns to the appearance in the
        model file. A hook of a plugin may call this: it takes effect after the step.

        Args:
            model: Name of the model.
            body: Name of the body; empty for all bodies of the model.
            color: (r, g, b) or (r, g, b, a), each from 0 to 1; three numbers keep the opacity, None
                keeps the colour.
            layers: Name or names of the layers of all footprints of the body, at least one; the
                single name `all` stands for all layers, None keeps them.
            visible: Whether the body is drawn; None for no change.

        Raises:
            WorldError: The model, the body or a layer does not exist, or the colour is invalid;
                the world is unchanged.
        """
        self._models.set_appearance(model, body, color, layers, visible)

    # -- layers --------------------------------------------------------------------------------

    @property
    def layers(self) -> list[Layer]:
        """All layers in the order of the file."""
        return self._layers.all

    def layer(self, name: str) -> Layer:
        """Returns the layer that has a name, possibly among others.

        Raises:
            WorldError: It does not exist.
        """
        return self._layers.find(name)

    def set_layer_map(self, layer: str, source: str | os.PathLike[str] | OccupancyGrid) -> None:
        """Replaces the map of a layer and all of its walls, including those that plugins added.

        A model that overlaps the new walls is logged with a warning. Plugins keep no handle of the
        old walls, and bodies wake. `reset` returns to the map of the world file, or, for a layer
        whose map is `topic://…`, to the last grid. A hook of a plugin may call this: it takes
        effect after the step.

        Args:
            layer: A name of the layer.
            source: Map file, absolute or relative to the folder of the world file, subject to
                `model_path`; or a grid, in which cells of at least 65 are occupied, and unknown
                cells are free.

        Raises:
            WorldError: The layer does not exist, or the map does not fit the range of the physics.
            FlatlandError: The map is invalid, or cannot be read. In all cases, the previous map
                remains.
        """
        self._layers.set_map(layer, source)

    def add_layer(self, layer: Layer) -> None:
        """Adds a layer whose names are registered; for the loader."""
        self._layers.add(layer)

    def layer_changed(self, layer: Layer) -> None:
        """Notifies the observers that the edges of a layer changed."""
        self._observers.layer_changed(layer.name)

    def resolve_path(self, path: str) -> str:
        """Returns the absolute path of a model or map file.

        Args:
            path: An absolute path, one that starts with `~`, or one relative to the folder of the
                world file, also if it is given in a file that the world file includes.
        """
        return self.source.resolve(path)

    # -- free places ---------------------------------------------------------------------------

    def describe_overlap(self, model: str) -> str:
        """Returns which walls and other models a model overlaps, as a text.

        Args:
            model: Name of the model.

        Returns:
            Such as `overlaps layer "walls" at (1.000, 2.000, 0.000)`; empty if there are none.

        Raises:
            WorldError: The model does not exist, or the world is closed.
        """
        return self.between_steps(lambda: self._placement.describe_overlap(self.model(model)))

    def is_free(
        self,
        pose: Sequence[float],
        radius: float | None = None,
        *,
        model: str | Model | None = None,
        layers: str | Iterable[str] = "all",
        clearance: float = 0.0,
        ignore: Models = (),
    ) -> bool:
        """Returns whether a disc or a model does not overlap anything at a pose.

        Both can overlap the edges of walls and the solid footprints of models with which they would
        collide. Overlaps of up to 5 mm are ignored. Walls are edges without an interior: the
        interior of a solid obstacle of a map image is free, too, unless an edge is touched.

        Args:
            pose: (x, y) or (x, y, theta) of the centre of the disc, or of the first body of the
                model, in the world frame [m, rad].
            radius: Radius of the disc [m]; either this or `model` is required.
            model: A model of the world, or its name; its bodies keep their poses relative to each
                other, and it does not overlap itself.
            layers: Names of the layers that the disc collides with; the footprints of a model have
                their own layers.
            clearance: Distance to keep from everything that can be overlapped [m].
            ignore: Models, or their names, that may be overlapped.

        Raises:
            WorldError: A model or layer does not exist, or the world is closed.
            ValueError: A number is out of range, or not exactly one of radius and model is given.
        """
        return self._changes.read(
            lambda: self._placement.is_free(pose, radius, model, layers, clearance, ignore)
        )

    def sample_free(
        self,
        n: int,
        radius: float,
        clearance: float = 0.0,
        rng: np.random.Generator | int | None = None,
        *,
        connected_to: Sequence[float] | None = None,
        layers: str | Iterable[str] = "all",
        bounds: Sequence[float] | None = None,
        ignore: Models = (),
    ) -> DoubleArray:
        """Samples random free poses, for example to spawn robots at.

        The poses are within the bounds of the walls, at least `clearance` away from walls, models
        and each other. The interior of solid obstacles and of closed rooms is free space, too;
        with `connected_to`, only places that the disc can reach are sampled.

        Args:
            n: Number of poses.
            radius: Radius of the discs [m].
            clearance: Distance that the discs keep [m].
            rng: Generator or seed; the same seed results in the same poses. None for a generator
                that derives from the seed of the world.
            connected_to: A point (x, y) in the world frame [m]. From there, a path of a disc leads
                to each pose without touching a wall; models do not block paths. A passage that is
                wider than the disc by less than a cell of the planning grid (at most 5 cm for maps
                of less than 200 m by 200 m) may be treated as closed.
            layers: Names of the layers that the discs collide with.
            bounds: (x_min, y_min, x_max, y_max) of the area of the samples and of the paths, in the
                world frame [m]; None for the bounds of the walls.
            ignore: Models, or their names, that may be overlapped.

        Returns:
            (x, y, theta) of each pose [m, rad], theta from -pi to pi, shape (n, 3).

        Raises:
            WorldError: There are too few free places, the disc does not fit at `connected_to`, no
                wall bounds the area, a model or layer does not exist, or the world is closed.
            ValueError: A number is out of range.
        """
        return self._changes.read(
            lambda: self._placement.sample_free(
                n, radius, clearance, rng, connected_to, layers, bounds, ignore
            )
        )

    # -- plugins, ports, transforms, contacts --------------------------------------------------

    @property
    def plugins(self) -> list[WorldPlugin]:
        """The world plugins in the order of the file."""
        return list(self.plugin_host.world_plugins)

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
        name, owner, call = recorded_method(
            plugin, method, model, self.plugins, self._models.by_name
        )
        return self._changes.make(
            "call_plugin",
            {"plugin": name, "method": method, "arguments": dict(arguments), "model": owner},
            lambda: call(**arguments),
        )

    def output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic, such as `/r1/scan`, and makes it wanted.

        Raises:
            WorldError: The output does not exist.
        """
        output = self.ports.find_output(topic)
        output.want(self)
        return output

    def command(self, topic: str) -> CommandTopic[Any]:
        """Returns the commands of a resolved topic, such as `/r1/cmd_vel`.

        Raises:
            WorldError: The command does not exist.
        """
        return self.ports.find_command(topic)

    @property
    def transforms(self) -> dict[FramePair, Transform]:
        """The latest transform of each (parent, child)."""
        self.plugin_host.jobs.settle()
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

    # -- requests and observers ----------------------------------------------------------------

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action that runs between two steps; see `Requests.post`."""
        check_function("action", action)
        return self.requests.post(action)

    def between_steps(self, action: Callable[[], R]) -> R:
        """Returns the result of a function that reads the world, run while no step is in progress.

        Safe from any thread; in a plugin's hook it runs at once.
        """
        check_function("action", action)
        return self.requests.run(action)

    def add_observer(self, observer: WorldObserver) -> None:
        """Notifies an observer of all events from now on."""
        check_kind("observer", observer, WorldObserver, "a WorldObserver")
        observer.attached(self)
        owner = self.plugin_host.find_owner(None)
        if owner is None:
            self._observers.add(observer)
        else:
            self._observers.add_of_plugin(observer, owner)
        self.physics.jobs.interrupt()

    def remove_observer(self, observer: WorldObserver) -> None:
        """Stops the notifications of an observer.

        Raises:
            ValueError: The observer was not added, or has been removed.
        """
        self._observers.remove(observer)
        self.physics.jobs.interrupt()

    @property
    def change_count(self) -> int:
        """Number of changes since the file was loaded, including attempts that failed."""
        return self._changes.count

    @change_count.setter
    def change_count(self, count: int) -> None:
        self._changes.count = count

    def log_changes(self, log: ChangeLog | None) -> None:
        """Notifies a log of all further changes and steps, instead of the previous one."""
        self.stepping.change_log = self._changes.log = log
        self.physics.jobs.interrupt()

    # -- state ---------------------------------------------------------------------------------

    def state(self) -> ModelStates:
        """Returns the names, poses and velocities of all models.

        Raises:
            WorldError: The world is closed.
        """
        return self._changes.read(lambda: model_states(self.physics, self._models.by_name))

    def state_hash(self) -> str:
        """Returns a hash of the state: equal for two runs that have been the same so far.

        The hash covers, bit by bit, the time, the transforms and velocities of all bodies, the
        models, commands, random number generators and noise of all plugins, and what they return
        from `state`. The hash depends neither on subscribers, viewers and threads nor on the wall
        time.

        Returns:
            32 hexadecimal digits.

        Raises:
            WorldError: The world is closed, or the state of a plugin cannot be hashed.
        """
        return self._changes.read(self._hash)

    def snapshot(self, *, original: WorldSnapshot | None = None) -> WorldSnapshot:
        """Returns the current state of the world, for `restore`.

        The snapshot includes everything that affects later steps: bodies, contacts, the attributes
        of all plugins with all that they refer to, random numbers, commands, the time and the last
        values of outputs. It does not include pending requests, the pause, observers and
        subscribers.

        Args:
            original: A snapshot of the world of which this one is a clone, if neither has changed
                since. Both snapshots then share the copy of all bodies, which is most of a
                snapshot.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a plugin has an attribute that
                cannot be copied; see *Snapshots* in `docs/write_a_plugin.md`.
            ValueError: The bodies of this world differ from those of `original`.
        """
        if original is not None:
            check_kind("original", original, WorldSnapshot, "a WorldSnapshot or None")
        return self._changes.save_or_restore(
            "snapshot", lambda: self._snapshots.taken, lambda: self._snapshots.take(original)
        )

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Returns to an earlier state: the same steps have the same results, bit by bit.

        Models, bodies, plugins, outputs and commands that exist in both states are the same
        objects. Models that were spawned since are deleted, and deleted ones are restored. A
        snapshot can be restored any number of times.

        Args:
            snapshot: Result of `snapshot` of this world.

        Raises:
            WorldError: The world is closed, a plugin calls this, the snapshot is one of another
                world, or a plugin that a deletion or a reset has ended since had a connection.
        """
        check_kind("snapshot", snapshot, WorldSnapshot, "a WorldSnapshot")
        self._changes.save_or_restore(
            "restore", lambda: snapshot.number, lambda: self._snapshots.restore(snapshot)
        )

    def randomize(self, seed: int) -> None:
        """Draws the start of an episode, usually after `restore`.

        All plugins get new random numbers. People whose places were drawn get other places, and
        models that follow paths or tweens are at other places of their motions, unless their
        parameter `redraw` is false. Other models remain where they are. Equal seeds in equal states
        give equal results, bit by bit. If a hook of a plugin calls this, it takes effect after the
        step.

        Args:
            seed: Seed of all that is drawn.

        Raises:
            WorldError: The world is closed, or there are too few free places for people; other
                plugins may have drawn already.
            ValueError: The seed is no integer, or negative.
        """
        seed = checked_count("seed", seed, 0)

        def randomize() -> None:
            randomize_plugins(self.models, self.plugins, np.random.default_rng(seed))

        self._changes.make("randomize", {"seed": seed}, randomize)

    def clone(self) -> World:
        """Returns an independent copy of the world in its current state.

        The same steps have the same results in both worlds, bit by bit. The worlds share only
        immutable data, such as parsed files and trees of map edges; the clone can be used in
        another thread and outlives the original. The clone has no observers, no subscribers other
        than its own plugins, no requests, is not paused, and its plugins have no access to ROS.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a plugin has an attribute that
                cannot be copied; see *Snapshots* in `docs/write_a_plugin.md`.
        """
        self.requests.refuse_in_plugin("clone")
        return self._changes.read(self._clone)

    def reset(self, seed: int | None = None, keep_time: bool = False) -> None:
        """Returns to the state after loading: the same steps have the same results, bit by bit.

        All models and plugins end. The contents of the world file are created again, with the files
        and parameters as they were when the world was loaded; models spawned since are removed.
        Models, bodies and plugins are new objects and have to be looked up again. Outputs and
        commands that exist before and after, layers, observers and subscribers remain. Pending
        requests and the pause do not change. If a hook of a plugin calls this, it takes effect
        after the step.

        Args:
            seed: Seed of all random numbers, also of those in expressions of the files: the state
                is that after loading with this seed. None for the current seed.
            keep_time: Whether the simulated time continues, instead of starting at 0 again. Updates
                at a rate then continue in phase.

        Raises:
            WorldError: The world is closed or was not loaded from a file.
            FlatlandError: With this seed, a file is invalid, or a plugin fails; the world is as
                before, or empty if a plugin cannot be copied (see `snapshot`).
            ValueError: The seed is no integer, or negative.
        """
        if seed is not None:
            seed = checked_seed(seed)
        arguments = {"seed": seed, "keep_time": keep_time}
        self._changes.make("reset", arguments, lambda: self._reset(seed, keep_time))

    def _hash(self) -> str:
        self.plugin_host.jobs.settle()
        return state_hash(self.seed, self.timekeeper, self.physics, self.models, self.plugins)

    def _clone(self) -> World:
        clone = type(self)(
            source=self.source.copy(),
            seed=self.seed,
            step_size=self.timekeeper.step_size,
            plugin_errors=self.plugin_errors,
            on_invalid_body=self.on_invalid_body,
        )
        self._snapshots.copy_to(clone._snapshots)
        return clone

    def _reset(self, seed: int | None, keep_time: bool) -> None:
        if not self.path:
            raise WorldError("only a world that was loaded from a file can be reset")
        try:
            before = self._snapshots.take()
        except WorldError:
            before = None  # A plugin cannot be copied.
        with self.ports.keeping():
            self._empty()
            if not keep_time:
                self.timekeeper.sim_time_ns = 0
                self._observers.time_advanced(0)
            try:
                reload_world(self, self.seed if seed is None else seed)
            except BaseException:
                self._empty()
                self._snapshots.restore_or_log(before)
                raise
            finally:
                self._layers.forget_former()

    def _empty(self) -> None:
        """Removes all contents."""
        self.plugin_host.shut_down(list(self.plugin_host.world_plugins))
        self._models.clear()
        self._layers.clear()
        self.collision_filter.clear()
        self._contacts.clear()
        self._placement.forget_random_state()
        self.physics.clear()

    # -- recordings and images -------------------------------------------------------------

    def record(self, path: str | os.PathLike[str]) -> OpenRecording:
        """Records this run, so that `flatland replay` can repeat it and find differences.

        Args:
            path: The file; an existing one is replaced.

        Returns:
            The `flatland.recording.Recorder`, whose `close` ends the recording, as does the end of
            the world.

        Raises:
            WorldError: The world was not loaded from a file, or has changed since.
            RecordingError: The file cannot be written.
        """
        from flatland.recording import Recorder  # Late: the simulation does not depend on it.

        recorder = Recorder(self, checked_path("path", path))
        self.log_changes(recorder)
        self.add_observer(recorder)
        return recorder

    def draw(
        self,
        *,
        size: tuple[int, int] | None = None,
        dpi: float = 100.0,
        view: Sequence[float] | None = None,
        layers: Iterable[str] | None = None,
        scans: bool = True,
        names: bool = False,
        axes: bool = True,
    ) -> npt.NDArray[np.uint8]:
        """Draws the current state of the world; see `flatland.draw` for the arguments.

        Returns:
            RGB image, top row first, shape (height, width, 3).

        Raises:
            FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
            ValueError: `size`, `dpi`, `view` or `layers` is invalid.
        """
        # Imported late: the simulation does not depend on drawing.
        from flatland.drawing import draw

        return draw(
            self, size=size, dpi=dpi, view=view, layers=layers, scans=scans, names=names, axes=axes
        )

    def view(
        self,
        *,
        host: str = WEB_HOST,
        port: int = 0,
        token: str | None = None,
        read_only: bool = False,
        height: int = 480,
    ) -> OpenView:
        """Shows the world live: as the result of a cell of a notebook, else at a printed address.

        The view ends with the world. A further call replaces it.

        Args:
            host: Address to listen on; `0.0.0.0` for access from other machines.
            port: TCP port, 0 for any free one.
            token: Part of the address, None for a random one.
            read_only: Whether the page only displays the world.
            height: Height in a notebook [pixels].

        Raises:
            FlatlandError: The world is closed, or the port is in use.
            ValueError: An argument is out of range.
        """
        from flatland.web.view import open_view  # Late, as in `draw`.

        return open_view(self, host, port, token, read_only, height)

    def _repr_png_(self) -> bytes | None:
        """Returns a PNG image for Jupyter; None for a closed world and without matplotlib."""
        from flatland.drawing import draw_png

        return draw_png(self)

    # -- end -----------------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def check_open(self) -> None:
        """Raises `WorldError` if the world is closed."""
        if self._closed:
            raise WorldError("the world is closed")

    def close(self) -> None:
        """Ends all plugins and releases everything; further calls have no effect.

        Raises:
            WorldError: A plugin calls this.
            Exception: Raised by a plugin or observer, with `plugin_errors="raise"`.
        """
        self.requests.refuse_in_plugin("close")
        with self.requests.lock:
            if self._closed:
                return
            if self._changes.log is not None:
                self._changes.log.world_closing()
            self.plugin_host.shut_down(list(self.plugin_host.world_plugins))
            self._models.clear()
            self._closed = True
            self._observers.remove_all()
            self._contacts.clear()
            self.physics.close()
            # Requests that wait fail, since the world is closed.
            self.requests.process()
        self._faults.raise_first()


class OpenRecording(Protocol):
    """The result of `World.record`, a `flatland.recording.Recorder`."""

    @property
    def is_open(self) -> bool:
        """Whether the recording is being written."""

    @property
    def error(self) -> str:
        """Why the recording ended before its end and is incomplete; empty if it did not."""

    def close(self) -> None:
        """Writes the last state and ends the recording; idempotent."""


class OpenView(Protocol):
    """The result of `World.view`, a `flatland.web.view.LiveView`."""

    @property
    def url(self) -> str:
        """Address of the page, with the token."""

    @property
    def closed(self) -> bool:
        """Whether the view has ended."""

    def close(self) -> None:
        """Ends the view, not the world; further calls have no effect."""

    def __enter__(self) -> Self:
        """Returns the view; the end of the block closes the view."""

    def __exit__(self, *error: object) -> None:
        """Closes the view."""


def _checked_iterations(kind: str, count: int) -> int:
    return checked_count(f"{kind}_iterations", count, 0, MAX_ITERATIONS)


class _Settings:
    """The attributes of a world that loading sets and that can change later."""

    def __init__(self, world: World) -> None:
        """Stores the world."""
        self._world = world

    def __getstate__(self) -> tuple[Any, ...]:
        """Returns the part of the state of the world that a snapshot saves."""
        world = self._world
        return (
            world.seed,
            world.source.save(),
            world.velocity_iterations,
            world.position_iterations,
        )

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Restores a saved state."""
        world = self._world
        world.seed, source, world._velocity_iterations, world._position_iterations = state
        world.physics.jobs.interrupt()
        world.source.restore(source)
