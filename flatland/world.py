"""The world: layers, models and plugins, stepped together."""

from __future__ import annotations

import logging
import os
import secrets
import threading
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from flatland.body import Body
from flatland.collision_filter import CollisionFilter
from flatland.contact import Contact
from flatland.errors import PLUGIN_FAULTS, FlatlandError, PluginError, WorldError, YamlError
from flatland.geometry import Pose, finite_pose
from flatland.jam import ON_INVALID_BODY, JamWatch, describe_invalid
from flatland.layer import Layer
from flatland.model import Model
from flatland.model_loader import ModelLoader
from flatland.observer import WorldObserver
from flatland.physics import PhysicsWorld, StepReport
from flatland.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin
from flatland.plugin_host import PluginHost, describe, initialize
from flatland.plugin_registry import PluginRegistry
from flatland.ports import CommandTopic, Output, PortRegistry, is_legal_namespace
from flatland.timekeeper import Timekeeper
from flatland.values import Transform
from flatland.yaml_node import Source
from flatland.yaml_reader import YamlReader

_LOG = logging.getLogger("flatland")
PLUGIN_TIMEOUT: Final = 60.0
_LOCK_PATIENCE: Final = 0.005  # s that a waiting thread sleeps before it looks again

R = TypeVar("R")
FramePair: TypeAlias = tuple[str, str]
TransformFields: TypeAlias = tuple[int, float, float, float, float]


class World:
    """A simulated world; made by `World.from_yaml`.

    One thread steps it. Other threads may spawn, move and delete models and set commands at any
    time: their requests are carried out between two steps.

    Attributes:
        timekeeper: The simulated time.
        collision_filter: Layer names and their bits.
        layers: In the order of the file.
        ports: All outputs and commands by resolved topic.
        velocity_iterations: Of Box2D's solver.
        position_iterations: Of Box2D's solver.
        seed: From which all random numbers come.
        path: The world file, as given; relative model paths start from its folder.
    """

    def __init__(
        self,
        *,
        seed: int | None = None,
        params: Mapping[str, object] | Callable[[str], object] | None = None,
        step_size: float = 0.005,
        velocity_iterations: int = 10,
        position_iterations: int = 10,
        base_dir: str | os.PathLike[str] = ".",
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = PLUGIN_TIMEOUT,
        on_invalid_body: str = "raise",
    ) -> None:
        """Makes an empty world; most users want `from_yaml`.

        Args:
            seed: Makes all noise repeatable; None draws one and logs it.
            params: What `param()` in YAML files answers from: a dictionary, or a function that
                returns None for an unknown name.
            step_size: Simulated time of one step [s].
            velocity_iterations: Of Box2D's solver.
            position_iterations: Of Box2D's solver.
            base_dir: Folder that relative paths of models and maps start from.
            observers: Told of all that happens, from the start.
            plugin_timeout: Wall time [s] that `on_initialize` of a plugin may take; None for as
                long as it likes, in the thread that loads.
            on_invalid_body: What a step does that leaves a body with a pose or velocity that is
                not finite: `raise` a WorldError that names the model, or `remove` the model with a
                logged error and go on.
        """
        if on_invalid_body not in ON_INVALID_BODY:
            raise ValueError(
                f"on_invalid_body must be one of {ON_INVALID_BODY}, got {on_invalid_body!r}"
            )
        if plugin_timeout is not None and not plugin_timeout > 0:
            raise ValueError(f"plugin_timeout must be positive [s] or None, got {plugin_timeout}")
        if seed is None:
            seed = secrets.randbits(31)
            _LOG.info("seed %d drawn at random, give it again to repeat this run", seed)
        if seed < 0:
            raise ValueError(f"seed must not be negative, got {seed}")
        self.seed = seed
        self.params = params
        self.path = ""
        self.timekeeper = Timekeeper(step_size)
        self.collision_filter = CollisionFilter()
        self.velocity_iterations = velocity_iterations
        self.position_iterations = position_iterations
        self.layers: list[Layer] = []
        self.ports = PortRegistry()
        self._files = Source("", str(Path(base_dir).absolute()))
        self._models: dict[str, Model] = {}
        self._physics = PhysicsWorld()
        self._registry = PluginRegistry()
        self._host = PluginHost()
        self._bodies: dict[int, Body] = {}
        # What transforms are made of: most are never looked at.
        self._transforms: dict[FramePair, TransformFields] = {}
        self._pending_transforms: dict[FramePair, TransformFields] = {}
        self._observers: list[WorldObserver] = []
        self._time_observers: list[WorldObserver] = []
        self._transform_observers: list[WorldObserver] = []
        self._lock = threading.RLock()
        self._requests: deque[Callable[[], None]] = deque()
        self._stepping_thread: int | None = None
        self._requests_thread: int | None = None
        self._records_contacts = False
        self._plugin_timeout = plugin_timeout
        self._on_invalid_body = on_invalid_body
        self._jams = JamWatch()
        self._initializing_thread: threading.Thread | None = None
        self._paused = False
        self._closed = False
        for observer in observers:
            self.add_observer(observer)

    @classmethod
    def from_yaml(
        cls,
        path: str | os.PathLike[str],
        seed: int | None = None,
        params: Mapping[str, object] | Callable[[str], object] | None = None,
        simplify_map: int = 0,
        step_size: float = 0.005,
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = PLUGIN_TIMEOUT,
        on_invalid_body: str = "raise",
    ) -> World:
        """Loads a world file: properties, layers, models with their plugins, world plugins.

        Args:
            path: The world file.
            seed: Makes all noise repeatable; None draws one and logs it.
            params: What `param()` in YAML files answers from.
            simplify_map: 0 exact, 1 simplified, 2 opened and simplified map boundaries.
            step_size: Simulated time of one step [s].
            observers: Told of all that happens, from the start.
            plugin_timeout: Wall time [s] that `on_initialize` of a plugin may take.
            on_invalid_body: `raise` or `remove`, as for `World`.

        Raises:
            FlatlandError: Something in the files is wrong; nothing is left behind.
            ValueError: An argument is out of its range.
        """
        # The loader knows the world, not the other way round; it is needed only here.
        from flatland.world_loader import load_world

        return load_world(
            cls,
            path,
            params=params,
            simplify_map=simplify_map,
            seed=seed,
            step_size=step_size,
            observers=observers,
            plugin_timeout=plugin_timeout,
            on_invalid_body=on_invalid_body,
        )

    def __enter__(self) -> World:
        """Gives the world itself, which ends with the block."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Ends the world."""
        self.close()

    # -- time ------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.timekeeper.sim_time

    def step(self, n: int = 1) -> None:
        """Steps `n` times; does nothing while paused.

        Raises:
            WorldError: The world is closed, this was called from a plugin's hook, or a step left a
                body with a pose or velocity that is not finite. In the last case the time stands
                still, and each further step raises, until the model is moved or deleted.
        """
        if self._stepping_thread == threading.get_ident():
            raise WorldError("step must not be called from a plugin's hook")
        for _ in range(n):
            with self._lock:
                self._check_open()
                if self._requests:
                    self.process_requests()
                if not self._paused:
                    self._step_once()
                if self._requests:
                    self.process_requests()

    def _step_once(self) -> None:
        timekeeper = self.timekeeper
        self._stepping_thread = threading.get_ident()
        try:
            self._host.before_physics_step(timekeeper)
            report = self._physics.step(
                timekeeper.step_size, self.velocity_iterations, self.position_iterations
            )
            if report is not None:
                self._examine(report)
            if self._physics.pre_solve is not None:
                for error in self._physics.take_pre_solve_errors():
                    # The host keeps what plugins raise; this is Control-C or the like.
                    raise error
            if self._records_contacts:
                self._dispatch_contacts()
            timekeeper.advance()
            for observer in self._time_observers:
                observer.time_advanced(timekeeper.sim_time_ns)
            self._host.after_physics_step(timekeeper)
            if self._pending_transforms:
                self._flush_transforms()
        finally:
            self._stepping_thread = None

    def _examine(self, report: StepReport) -> None:
        """Handles jammed and invalid bodies of a step."""
        bodies = map(self._bodies.get, report.limited)
        self._jams.update(filter(None, bodies), self.timekeeper)
        if not report.invalid:
            return
        text = describe_invalid(report.invalid, self._bodies)
        if self._on_invalid_body == "raise":
            raise WorldError(text)
        _LOG.error("%s: removed from the world", text)
        for body_id in report.invalid:
            body = self._bodies.get(body_id)
            if body is not None:
                self._delete(body.entity.name)
            elif self._physics.body(body_id).alive:
                self._physics.body(body_id).destroy()

    @property
    def paused(self) -> bool:
        """Whether steps do nothing."""
        return self._paused

    def pause(self) -> None:
        """Makes steps do nothing from the next one on."""
        self._paused = True

    def resume(self) -> None:
        """Makes steps count again."""
        self._paused = False

    def toggle_pause(self) -> None:
        """Pauses a running world, resumes a paused one."""
        self._paused = not self._paused

    # -- requests --------------------------------------------------------------------------

    def post(self, action: Callable[[], object]) -> Future[Any]:
        """Queues an action that runs between two steps; may be called from any thread.

        All inputs of a world that come from outside take this way, in order of arrival.

        Returns:
            Holds what the action returned or raised, once it has run.
        """
        future: Future[Any] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                future.set_result(action())
            except BaseException as error:
                future.set_exception(error)

        self._requests.append(run)
        return future

    def process_requests(self) -> None:
        """Runs what other threads asked for; `step` does so by itself, also while paused."""
        with self._lock:
            outer, self._requests_thread = self._requests_thread, threading.get_ident()
            try:
                # Only what is there now: an action that posts another must not keep us here. An
                # action may come back to here, so the queue can be empty sooner.
                for _ in range(len(self._requests)):
                    if self._requests:
                        self._requests.popleft()()
            finally:
                self._requests_thread = outer

    def _perform(self, action: Callable[[], R], what: str) -> R | None:
        """Runs a change of the world now, or after the step when a hook asks for it."""
        if self._stepping_thread == threading.get_ident():
            future = self.post(action)
            future.add_done_callback(lambda done: _log_failure(what, done))
            return None
        return self._run_between_steps(action)

    def _run_between_steps(self, action: Callable[[], R]) -> R:
        if self._requests_thread == threading.get_ident():
            # Part of a request: those that came after it wait for their turn.
            return action()
        if self._initializing_thread is threading.current_thread():
            # The thread that loads waits for this one, with the lock in its hands.
            return action()
        future = self.post(action)
        while not future.done():
            if self._lock.acquire(timeout=_LOCK_PATIENCE):
                try:
                    self.process_requests()
                finally:
                    self._lock.release()
        return future.result()  # type: ignore[no-any-return]

    def between_steps(self, look: Callable[[], R]) -> R:
        """Runs a function that only looks at the world, while no step is under way.

        From any thread; in a plugin's hook, or between two steps, it runs at once.

        Returns:
            What the function returns; what it raises is raised.
        """
        if self._stepping_thread == threading.get_ident():
            return look()
        return self._run_between_steps(look)

    @contextmanager
    def initialized_by(self, thread: threading.Thread) -> Iterator[None]:
        """Lets a thread that starts a plugin act for the one that waits for it meanwhile."""
        before, self._initializing_thread = self._initializing_thread, thread
        try:
            yield
        finally:
            self._initializing_thread = before

    # -- models ----------------------------------------------------------------------------

    @property
    def models(self) -> list[Model]:
        """All models in the order in which they came."""
        return list(self._models.values())

    def model(self, name: str) -> Model:
        """Returns the model of a name.

        Raises:
            WorldError: There is none.
        """
        try:
            return self._models[name]
        except KeyError:
            raise WorldError(f'model with name "{name}" does not exist') from None

    def layer(self, name: str) -> Layer:
        """Returns the layer that has a name, among its others.

        Raises:
            WorldError: There is none.
        """
        for layer in self.layers:
            if name in layer.names:
                return layer
        raise WorldError(f'layer with name "{name}" does not exist')

    def resolve_path(self, path: str) -> str:
        """Makes the path of a model or map absolute.

        Args:
            path: An absolute one, one that starts with `~`, or one relative to the folder of the
                world file, also where it stands in a file that this one includes.
        """
        return self._files.resolve(path)

    def spawn_model(
        self,
        yaml_path: str | os.PathLike[str],
        name: str,
        namespace: str = "",
        pose: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Model | None:
        """Reads a model file and puts the model into the world.

        Args:
            yaml_path: Model file; a relative path starts from the world file's folder.
            name: Unique in the world.
            namespace: Under which its topics and frames live, may be empty.
            pose: (x, y, theta) in the world frame [m, rad].

        Returns:
            The model; None when called from a plugin's hook, as it comes after the step then.

        Raises:
            FlatlandError: It cannot be made; the world is as it was.
        """
        path = os.fspath(yaml_path)
        return self._perform(
            lambda: self._spawn(path, name, namespace, pose), f'spawn of model "{name}"'
        )

    def move_model(self, name: str, pose: Sequence[float]) -> None:
        """Moves a model rigidly so that its first body is at a pose, at rest.

        Called from a plugin's hook it acts after the step.

        Raises:
            WorldError: There is no such model, or the pose is not finite.
        """
        self._perform(lambda: self._move(name, pose), f'move of model "{name}"')

    def delete_model(self, name: str) -> None:
        """Takes a model out of the world: plugins first, then joints and bodies.

        Called from a plugin's hook it acts after the step.

        Raises:
            WorldError: There is no such model.
        """
        self._perform(lambda: self._delete(name), f'deletion of model "{name}"')

    def _spawn(self, path: str, name: str, namespace: str, pose: Sequence[float]) -> Model:
        self._check_open()
        checked_pose = self._check_spawn(path, name, namespace, pose)
        path = self.resolve_path(path)
        reader = YamlReader.from_file(path, self.params)
        model = Model(self, name, namespace, path)
        loader = ModelLoader(self._physics, self.collision_filter, model, reader)
        try:
            loader.load_bodies_and_joints(checked_pose)
            self._bodies.update((body.physics.id, body) for body in model.bodies)
            self._update_contact_recording()
            for entry in loader.plugin_entries():
                self._start_model_plugin(model, entry)
        except BaseException:
            self._remove_model(model)
            raise
        self._models[name] = model
        for observer in self._observers:
            observer.model_added(model)
        return model

    def _check_spawn(self, path: str, name: str, namespace: str, pose: Sequence[float]) -> Pose:
        if not name:
            raise WorldError("failed to spawn model, its name must not be empty")
        if name in self._models:
            raise YamlError(f'Model with name "{name}" already exists')
        if not path:
            raise WorldError(f'failed to spawn model "{name}", the path must not be empty')
        if not is_legal_namespace(namespace):
            raise WorldError(
                f'failed to spawn model "{name}", namespace "{namespace}" is not a legal ROS '
                'name: it must start with a letter and hold only letters, digits, "_" and "/"'
            )
        try:
            return finite_pose(pose)
        except ValueError as error:
            raise WorldError(f'failed to spawn model "{name}", {error}') from None

    def _move(self, name: str, pose: Sequence[float]) -> None:
        self._check_open()
        model = self._find_model(name, "move")
        try:
            model.set_pose(*finite_pose(pose))
        except ValueError as error:
            raise WorldError(f'failed to move model "{name}", {error}') from None
        self._jams.forget(model)
        for observer in self._observers:
            observer.model_moved(model)

    def _delete(self, name: str) -> None:
        self._check_open()
        model = self._find_model(name, "delete")
        del self._models[name]
        self._remove_model(model)
        for observer in self._observers:
            observer.model_removed(model)

    def _find_model(self, name: str, verb: str) -> Model:
        try:
            return self._models[name]
        except KeyError:
            raise WorldError(
                f'failed to {verb} model, model with name "{name}" does not exist'
            ) from None

    def _remove_model(self, model: Model) -> None:
        """Ends a model, whole or half made, and tells the other plugins of contacts that end."""
        self._host.shut_down(model.plugins)
        self._jams.forget(model)
        for joint in reversed(model.joints):
            joint.physics.destroy()
        for body in reversed(model.bodies):
            body.physics.destroy()
        if self._records_contacts:
            self._dispatch_contacts()
        for body in model.bodies:
            self._bodies.pop(body.physics.id, None)
        self._update_contact_recording()

    # -- plugins ---------------------------------------------------------------------------

    @property
    def plugins(self) -> list[WorldPlugin]:
        """The world plugins in the order of the file."""
        return list(self._host.world_plugins)

    def _start_model_plugin(self, model: Model, entry: YamlReader) -> None:
        name, type_name = entry.get("name", "string"), entry.get("type", "string")
        what = f'Model Plugin "{name}" type "{type_name}" model "{model.name}"'
        plugin = self._make_plugin(type_name, ModelPlugin, what, entry)
        plugin.model = model
        place = (f'model "{model.name}"', f'plugin "{name}"')
        self._start(plugin, name, type_name, model.namespace, entry, place)
        model.plugins.append(plugin)

    def start_world_plugin(self, entry: YamlReader, world_config: YamlReader) -> None:
        """Starts a world plugin; for the loader.

        Raises:
            YamlError: There is one of that name and type.
            PluginError: It cannot be found, made or initialised.
        """
        name, type_name = entry.get("name", "string"), entry.get("type", "string")
        for other in self._host.world_plugins:
            if (other.name, other.type) == (name, type_name):
                raise entry.error(
                    f'Invalid "world plugins" with name "{name}", type "{type_name}" already exists'
                )
        what = f'World Plugin "{name}" type "{type_name}"'
        plugin = self._make_plugin(type_name, WorldPlugin, what, entry)
        plugin.world_config = world_config
        self._start(plugin, name, type_name, "", entry, ("", f'world_plugin "{name}"'))

    def _make_plugin(self, type_name: str, base: type[Any], what: str, entry: YamlReader) -> Any:
        try:
            return self._registry.make(type_name, base)
        except PluginError as error:
            raise PluginError(entry.error(f"{what}: {error.message}").message) from error

    def _start(
        self,
        plugin: FlatlandPlugin,
        name: str,
        type_name: str,
        namespace: str,
        entry: YamlReader,
        place: tuple[str, str],
    ) -> None:
        """Initialises a plugin and calls its hooks from now on; leaves nothing when it fails."""
        owner = plugin.model.name if isinstance(plugin, ModelPlugin) else ""
        words = [zlib.crc32(text.encode()) for text in (owner, name, type_name)]
        rng = np.random.default_rng(np.random.SeedSequence([self.seed, *words]))
        plugin._attach(self, name, type_name, namespace, rng)
        config = entry.without("name", "type", "enabled").with_location(*place)
        try:
            for observer in self._observers:
                plugin.ros = plugin.ros or observer.plugin_ros(plugin)
            initialize(plugin, config, self._plugin_timeout)
        except PLUGIN_FAULTS as error:
            self._host.release(plugin)
            text = error.message if isinstance(error, PluginError) else str(error)
            if isinstance(error, SystemExit) or not (isinstance(error, FlatlandError) or text):
                text = f"{type(error).__name__} {text}".strip()
            text = f"{describe(plugin)}: {text}"
            if not isinstance(error, YamlError):  # which names a place of its own
                text = entry.error(text).message
            raise PluginError(text) from error
        self._host.add(plugin)
        self._update_contact_recording()

    # -- ports, transforms, observers ------------------------------------------------------

    def output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic, such as `/r1/scan`, and makes it wanted.

        Raises:
            WorldError: There is none.
        """
        output = self.ports.find_output(topic)
        output.want(self)
        return output

    def command(self, topic: str) -> CommandTopic[Any]:
        """Returns the commands of a resolved topic, such as `/r1/cmd_vel`.

        Raises:
            WorldError: There is none.
        """
        return self.ports.find_command(topic)

    def add_observer(self, observer: WorldObserver) -> None:
        """Tells an observer of all that happens from now on."""
        self._observers.append(observer)
        # Called in every step, so only those that have more than the empty hook.
        kind = type(observer)
        if kind.time_advanced is not WorldObserver.time_advanced:
            self._time_observers.append(observer)
        if kind.transforms_sent is not WorldObserver.transforms_sent:
            self._transform_observers.append(observer)
        self.ports.output_opened.append(observer.output_opened)
        self.ports.output_closed.append(observer.output_closed)
        self.ports.command_opened.append(observer.command_opened)
        self.ports.command_closed.append(observer.command_closed)

    @property
    def transforms(self) -> dict[FramePair, Transform]:
        """The latest transform of each (parent, child)."""
        return {
            frames: Transform(fields[0], *frames, *fields[1:])
            for frames, fields in self._transforms.items()
        }

    def post_transform(self, frames: FramePair, fields: TransformFields) -> None:
        """Takes a transform that goes out with the others of this step; for plugins.

        Args:
            frames: (parent, child).
            fields: (stamp, x, y, yaw, roll), as in `Transform`.
        """
        self._pending_transforms[frames] = fields

    def forget_transforms(self, keys: Iterable[FramePair]) -> None:
        """Drops transforms whose sender is gone."""
        for key in keys:
            self._transforms.pop(key, None)
            self._pending_transforms.pop(key, None)

    def _flush_transforms(self) -> None:
        pending = self._pending_transforms
        self._transforms.update(pending)
        batch: list[Transform] | None = None
        for observer in self._transform_observers:
            if observer.wants_transforms:
                if batch is None:
                    batch = [
                        Transform(fields[0], *frames, *fields[1:])
                        for frames, fields in pending.items()
                    ]
                observer.transforms_sent(batch)
        pending.clear()

    # -- contacts --------------------------------------------------------------------------

    @property
    def contacts(self) -> list[Contact]:
        """All pairs of fixtures that touch now."""
        found = (Contact.between(self._bodies, info) for info in self._physics.contacts())
        return [contact for contact in found if contact is not None]

    def _dispatch_contacts(self) -> None:
        self._host.dispatch_contacts(self._physics.take_contact_events(), self._bodies)

    def _update_contact_recording(self) -> None:
        self._records_contacts = self._host.wants_contacts
        self._physics.record_contacts = self._records_contacts
        if self._host.wants_pre_solve:
            self._physics.pre_solve = self._pre_solve
            self._physics.pre_solve_bodies = set(self._bodies)
        else:
            self._physics.pre_solve = None

    def _pre_solve(self, contact: Any, old_manifold: Any) -> None:
        self._host.pre_solve(contact, old_manifold, self._bodies)

    # -- pictures --------------------------------------------------------------------------

    def draw(self, **options: Any) -> npt.NDArray[np.uint8]:
        """Draws the world as it is now; the same as `flatland.draw`, where the options are.

        Returns:
            Red, green and blue of each pixel, the top row first, shape (height, width, 3).

        Raises:
            FlatlandError: The world is closed, a layer is unknown, or matplotlib is missing.
            ValueError: An option is out of its range.
        """
        # The simulation itself needs no drawing.
        from flatland.drawing import draw

        return draw(self, **options)

    # -- physics for plugins ---------------------------------------------------------------

    @property
    def physics(self) -> PhysicsWorld:
        """The physics world: ray casts, and what Box2D knows beyond models and layers."""
        return self._physics

    def add_layer(self, layer: Layer) -> None:
        """Adds a layer whose names are registered; for the loader."""
        self.layers.append(layer)
        self._bodies[layer.body.physics.id] = layer.body
        self.layer_changed(layer)

    def layer_changed(self, layer: Layer) -> None:
        """Tells the observers that the edges of a layer changed."""
        for observer in self._observers:
            observer.layer_changed(layer.name)

    # -- end -------------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def _check_open(self) -> None:
        if self._closed:
            raise WorldError("the world is closed")

    def close(self) -> None:
        """Ends all plugins and releases everything; a second call does nothing.

        Raises:
            WorldError: Called from a plugin's hook.
        """
        if self._stepping_thread == threading.get_ident():
            raise WorldError("close must not be called from a plugin's hook")
        with self._lock:
            if self._closed:
                return
            self._host.shut_down(list(self._host.world_plugins))
            for model in reversed(self.models):
                self._delete(model.name)
            self._closed = True
            self._bodies.clear()
            self._physics.close()
            # Someone may wait for what was asked for meanwhile: it fails, as the world is closed.
            self.process_requests()


def _log_failure(what: str, done: Future[Any]) -> None:
    error = done.exception()
    if error is not None:
        _LOG.error("%s: %s", what, error)


def load_world(path: str | os.PathLike[str], **options: Any) -> World:
    """Loads a world file; the same as `World.from_yaml`."""
    return World.from_yaml(path, **options)
