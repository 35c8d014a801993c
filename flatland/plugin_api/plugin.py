"""Base classes of model and world plugins.

A plugin declares its ports and hooks and does not depend on ROS. See `docs/write_a_plugin.md`.
"""

from __future__ import annotations

import builtins
import math
import zlib
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from flatland.entities.contact import Contact, ContactImpulse, ModelContact, MutableContact
from flatland.errors import Place, PluginError
from flatland.graph_names import resolve_topic
from flatland.plugin_api.noise import NoiseStream
from flatland.plugin_api.ports import Command, Output
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugin_api.updates import (
    STEP_HOOKS,
    Phase,
    SkippedHandler,
    Update,
    UpdateFunction,
    is_called_when_due,
)
from flatland.uncopied import uncopied

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.geometry import Pose
    from flatland.physics import Controller, Crowd, OldManifold, Touches
    from flatland.plugin_api.plugin_world import PluginWorld
    from flatland.timekeeper import Timekeeper

T = TypeVar("T")
C = TypeVar("C", bound="Controller | Crowd")


@uncopied("World.clone() copies a world with its plugins")
class FlatlandPlugin:
    """The common base class of model and world plugins: a name, ports, random numbers and hooks.

    A subclass overrides the hooks that it needs; hooks that are not overridden cost nothing. It
    needs no `__init__`: all attributes below are set before `on_initialize` is called.

    Attributes:
        name: Name in the YAML file.
        type: Type in the YAML file.
        world: World of the plugin.
        namespace: Namespace of relative topics and frames, may be empty.
        rng: Generator seeded from the seed of the world and the names of model, plugin and type.
            For the noise of an output, use `noise_stream`.
        ros: Access to ROS topics, services and parameters, None without ROS.
        recorded_methods: Names of the methods that may be called by `World.call_plugin`, so that
            recordings repeat the calls.
    """

    base_class_type: ClassVar[str] = ""
    recorded_methods: ClassVar[frozenset[str]] = frozenset()
    outside_state: ClassVar[dict[str, Callable[[], object]]] = {
        "_endings": list,
        "ros": lambda: None,
    }

    name: str
    type: str
    world: PluginWorld
    namespace: str
    rng: np.random.Generator
    ros: Any

    _entropy: tuple[int, ...]
    _outputs: list[Output[Any]]
    _commands: list[Command[Any]]
    _noise_streams: list[NoiseStream]
    _place = Place("")  # of the entry in the file
    _sent: set[tuple[str, str]]
    _declared: set[tuple[str, str]]
    _jobs: list[Update | Controller | Crowd]
    _touch_collectors: list[Touches]
    _endings: list[Callable[[], None]]
    _is_initialized: bool
    _detached: bool
    _label: str

    def _attach(
        self, world: PluginWorld, owner: str, name: str, type_name: str, namespace: str
    ) -> None:
        """Attaches the plugin to a world; called once, before `on_initialize`.

        Args:
            world: The world.
            owner: Name of the model, empty for a world plugin.
            name: Name of the plugin.
            type_name: The `type:` of the YAML file.
            namespace: Namespace of the model, may be empty.
        """
        self.world = world
        self.name = name
        self.type = type_name
        self.namespace = namespace
        self._entropy = (world.seed, *(zlib.crc32(t.encode()) for t in (owner, name, type_name)))
        self.rng = np.random.default_rng(np.random.SeedSequence(self._entropy))
        self.ros = None
        self._outputs = []
        self._commands = []
        self._noise_streams = []
        self._sent = set()
        self._declared = set()
        self._jobs = []
        self._is_initialized = False
        self._touch_collectors = []
        self._endings = []
        self._detached = False
        self._label = describe(self)

    def _detach(self) -> None:
        """Closes all ports and removes all transforms that the plugin has not closed or removed."""
        self._detached = True
        for end in self._endings:
            end()
        self._endings.clear()
        for output in self._outputs:
            self.world.ports.close_output(output, self._label)
        for command in self._commands:
            self.world.ports.close_command(command)
        self._outputs.clear()
        self._commands.clear()
        for touches in self._touch_collectors:
            if touches.alive:
                touches.remove()
        self.world.transform_buffer.forget(self, self._sent | self._declared)
        self._sent.clear()
        self._declared.clear()

    def _call_at_end(self, function: Callable[[], None]) -> None:
        """Calls a function after `on_shutdown`, or after a failed start."""
        self._endings.append(function)

    def output(self, topic: str, value_type: builtins.type[T]) -> Output[T]:
        """Declares a stream of values.

        Args:
            topic: Topic under the namespace of the model, global with a leading `/`.
            value_type: Type of the values.

        Raises:
            PluginError: The topic is not a legal name, or the plugin has ended.
            FlatlandError: The topic already carries values of another type.
        """
        output = self.world.ports.open_output(self._resolve(topic), value_type, self._label)
        self._outputs.append(output)
        return output

    def command(
        self,
        topic: str,
        value_type: builtins.type[T],
        default: T | None = None,
        accept: Callable[[T], bool] | None = None,
    ) -> Command[T]:
        """Declares a value that is set from outside.

        Args:
            topic: Topic under the namespace of the model, global with a leading `/`.
            value_type: Type of the values.
            default: Value before the first one is received, by default `value_type()`.
            accept: Returns whether a value is valid; an invalid one is ignored.

        Raises:
            PluginError: The topic is not a legal name, or the plugin has ended.
            FlatlandError: The topic already carries values of another type.
        """
        initial = value_type() if default is None else default
        command = self.world.ports.open_command(
            self._resolve(topic), value_type, initial, accept, self._label
        )
        self._commands.append(command)
        return command

    def read_yaml(self, path: str) -> YamlReader:
        """Reads a YAML file as one of the files of the world.

        Recordings list the file, so that a replay finds out whether it has changed. If it is read
        while the world is loaded, `World.reset` uses the same content. The file may contain
        `$include` and `$eval`; `param()` returns the parameters of the world.

        Args:
            path: Absolute path, such as the result of `YamlReader.resolve_path`; or one relative to
                the folder of the world file.

        Raises:
            YamlError: The file cannot be read, is not valid YAML, cannot be preprocessed, or is
                outside the folders of `World.model_path`.
        """
        source = self.world.source
        return source.read(source.resolve(path))

    def noise_stream(self, output: str) -> NoiseStream:
        """Returns a stream of random numbers for the noise of one output.

        The numbers derive from the seed of the world, the names of model, plugin and type, the
        name of the output, and the number of updates due. They do not depend on other outputs.

        Args:
            output: Name of the output or quantity, unique within the plugin.
        """
        stream = self._uncounted_stream(output)
        self._noise_streams.append(stream)
        return stream

    def reseed(self, rng: np.random.Generator) -> None:
        """Continues `rng` and all noise streams from states that are drawn from a generator.

        Args:
            rng: Equal states of it give equal random numbers.
        """
        streams = list(self._noise_streams)
        streams += [
            value
            for value in vars(self).values()
            if isinstance(value, NoiseStream) and value not in streams
        ]
        words = rng.bit_generator.random_raw(2 + len(streams)).tolist()
        generator = self.rng.bit_generator
        state: Any = generator.state
        state["state"]["state"] = words[0] << 64 | words[1]
        state["has_uint32"] = 0
        generator.state = state
        for stream, word in zip(streams, words[2:], strict=True):
            stream.updates = word >> 2
            stream.begin_update()

    def randomize(self, rng: np.random.Generator) -> None:
        """Draws what is random at the start of an episode, after a snapshot was restored.

        A plugin that draws more than random numbers, such as a place, overrides this method. The
        plugins of models are called before those of the world.

        Args:
            rng: Equal states of it, in equal states of the world, give equal results.

        Raises:
            WorldError: There is no free place.
        """
        self.reseed(rng)

    def on_update(
        self,
        function: UpdateFunction,
        rate: float | UpdateTimer = math.inf,
        *,
        phase: Phase = "after",
        outputs: Iterable[Output[Any]] | None = None,
        transforms: bool = False,
        bodies: Iterable[Body] = (),
        skipped: SkippedHandler | None = None,
        touches: Touches | None = None,
        at_touches: bool = False,
        prepare: Callable[[Sequence[Any]], object] | None = None,
    ) -> Update:
        """Declares a function that is called when an update is due; for `on_initialize`.

        The core performs all other steps, many at a time, without Python code. The jobs of a
        plugin, its updates and controllers, are performed in the order in which they were declared.
        The function is always called for the first update due, and for others only if one of its
        outputs is wanted.

        Args:
            function: Called as `function(timekeeper)`.
            rate: Update rate [Hz]; infinity means every step, 0 only time 0. Or a timer of this
                rate.
            phase: `before` the physics step, at time t, or `after` it, at time t + dt.
            outputs: The outputs to which the function emits; it is not called while none of them is
                wanted. None to call it in any case.
            transforms: Whether to call it also while an observer wants transforms.
            bodies: Bodies whose poses `skipped` needs.
            skipped: Accounts for updates that were due without a call of the function. It is called
                as `skipped(count, stamp, poses)` with the number of updates, the simulated time of
                the last one [ns], and the poses of `bodies` at that time, world frame [m, rad],
                before the next call of the function and before the state of the plugin or
                the transforms are read, and must not emit anything.
            touches: Contacts whose `clear` is called at updates without a call of the function.
            at_touches: Whether to call the function also in steps in which there are contacts in
                `touches`; for the phase `after`.
            prepare: Called as `prepare(plugins)` before the functions of several plugins with the
                same `prepare`, if nothing else happens between them. `prepare` must not move
                bodies. If `prepare` raises, each function is called without the preparation.

        Returns:
            The declaration, whose `outputs` may be changed later.

        Raises:
            ValueError: The phase is unknown, or the rate is negative or NaN.
            TypeError: One of the outputs is no `Output`.
            PluginError: `on_initialize` has returned.
        """
        self._check_initializing("on_update")
        timer = rate if isinstance(rate, UpdateTimer) else UpdateTimer(rate)
        update = Update(
            function,
            timer,
            phase,
            outputs=outputs,
            transforms=transforms,
            bodies=bodies,
            skipped=skipped,
            touches=touches,
            at_touches=at_touches,
            prepare=prepare,
        )
        self._jobs.append(update)
        return update

    def call_when_due(
        self,
        hook: str,
        timer: UpdateTimer,
        *,
        outputs: Iterable[Output[Any]] | None = None,
        transforms: bool = False,
        bodies: Iterable[Body] = (),
        skipped: SkippedHandler | None = None,
    ) -> None:
        """Restricts the calls of a hook to steps in which an update is due; for `on_initialize`.

        The hook must be marked by `flatland.when_due`, and may check the timer itself. Otherwise,
        it is called in every step.

        Args:
            hook: `before_physics_step` or `after_physics_step`.
            timer: Timer of the updates.
            outputs: As for `on_update`.
            transforms: As for `on_update`.
            bodies: As for `on_update`.
            skipped: As for `on_update`.

        Raises:
            ValueError: The hook is unknown.
        """
        phases = {name: phase for phase, name in STEP_HOOKS.items()}
        if hook not in phases:
            raise ValueError(f"hook must be before_physics_step or after_physics_step, got {hook}")
        function = getattr(self, hook)
        if is_called_when_due(function):
            self._jobs = [job for job in self._jobs if getattr(job, "function", None) != function]
            self.on_update(
                function,
                timer,
                phase=phases[hook],
                outputs=outputs,
                transforms=transforms,
                bodies=bodies,
                skipped=skipped,
            )

    @property
    def updates(self) -> list[Update]:
        """What the plugin has declared by `on_update`, and its hooks of steps, in order."""
        return [job for job in self._jobs if isinstance(job, Update)]

    def _declare_hooks(self) -> None:
        """Declares the hooks of steps that are overridden as updates in every step."""
        declared = [update.function for update in self.updates]
        for phase, hook in STEP_HOOKS.items():
            function = getattr(self, hook)
            if overrides(self, hook) and function not in declared:
                self.on_update(function, phase=phase)
        self._is_initialized = True

    def control(self, controller: C) -> C:
        """Assigns a controller or a crowd to the plugin and returns it; for `on_initialize`.

        The core carries it out in each step at the place of the plugin in the order of hooks, in
        the order in which the plugin declares its jobs. It is removed with the plugin.

        Raises:
            PluginError: `on_initialize` has returned.
        """
        self._check_initializing("control")
        self._jobs.append(controller)
        return controller

    def _check_initializing(self, method: str) -> None:
        if self._is_initialized:
            raise PluginError(f"{self._label}: {method} must be called in on_initialize")

    def collect_touches(
        self,
        bodies: Iterable[Body],
        *,
        exclude: Iterable[Body] = (),
        sensors: bool = True,
    ) -> Touches:
        """Collects the contacts of bodies without a call at each contact; ends with the plugin.

        Args:
            bodies: The bodies.
            exclude: Bodies whose contacts are ignored.
            sensors: Whether to collect contacts with sensors, which have no effect on bodies.
        """
        touches = self.world.physics.collect_touches(bodies, exclude=exclude, sensors=sensors)
        self._touch_collectors.append(touches)
        return touches

    def set_before_step(self, function: Callable[[], None]) -> None:
        """Calls a function before the next step; safe from any thread.

        For `Command.on_change`, to pass the value to a controller.
        """
        self.world.plugin_host.jobs.set_later(self, function)

    def _uncounted_stream(self, output: str) -> NoiseStream:
        """Returns a noise stream whose number of updates is left to `state`."""
        return NoiseStream([*self._entropy, zlib.crc32(output.encode())])

    def _random_state(self) -> tuple[Any, list[int]]:
        """Returns the states of `rng` and of the noise streams, for `World.state_hash`."""
        updates = [stream.updates for stream in self._noise_streams]
        return self.rng.bit_generator.state, updates

    def _command_state(self) -> list[tuple[str, int, Any]]:
        """Returns the values of the commands, for `World.state_hash`."""
        states = [(command.topic, *command.state) for command in self._commands]
        return [(topic, received, value) for topic, value, received in states]

    def _resolve(self, topic: str) -> str:
        if self._detached:
            raise PluginError(f'plugin "{self.name}" has ended and cannot open "{topic}"')
        try:
            return resolve_topic(topic, self.namespace)
        except ValueError as error:
            raise PluginError(str(error)) from None

    def declare_transform(
        self, parent: str, child: str, *, pose: Pose | None = None, switch: str = ""
    ) -> None:
        """Declares a transform that the plugin is going to send; for `on_initialize`.

        A warning about a frame with two parents is then logged when the model is loaded, not in
        the step in which the frame is sent first, and `flatland check` prints it.

        Args:
            parent: Frame id of the parent.
            child: Frame id of the child.
            pose: Pose of the child in the parent [m, rad] if it is constant; otherwise None.
            switch: Entry of the plugin that disables the transform, such as `broadcast_tf: false`,
                for the warning.
        """
        if (parent, child) not in self._declared:
            self._declared.add((parent, child))
            self.world.transform_buffer.declare(self, (parent, child), pose, switch)

    def send_transform(
        self, parent: str, child: str, x: float, y: float, yaw: float, roll: float = 0.0
    ) -> None:
        """Sends the pose of frame `child` in frame `parent`, stamped with the current time.

        All transforms of a step are sent in one batch. Frame ids are used as given; use
        `Model.frame` for the frames of a model.

        Args:
            parent: Frame id of the parent.
            child: Frame id of the child.
            x: Position of the child along x [m].
            y: Position of the child along y [m].
            yaw: Rotation of the child about z [rad].
            roll: Rotation of the child about x [rad].
        """
        if self._detached:
            return
        frames = (parent, child)
        world = self.world
        if frames not in self._sent:
            self._sent.add(frames)
            world.transform_buffer.register(self, frames)
        world.transform_buffer.send(frames, (world.timekeeper.sim_time_ns, x, y, yaw, roll))

    def send_past_transform(
        self, stamp: int, parent: str, child: str, x: float, y: float, yaw: float, roll: float = 0.0
    ) -> None:
        """Adds a transform of an earlier step that was not wanted, for `World.transforms`.

        For the function `skipped` of `on_update`. Transforms that were never sent are ignored.

        Args:
            stamp: Simulated time of the transform [ns].
            parent: As for `send_transform`.
            child: As for `send_transform`.
            x: As for `send_transform`.
            y: As for `send_transform`.
            yaw: As for `send_transform`.
            roll: As for `send_transform`.
        """
        if (parent, child) in self._sent:
            self.world.transform_buffer.add_past((parent, child), (stamp, x, y, yaw, roll))

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and initializes the plugin; called once.

        Args:
            config: Entry of the plugin without `name`, `type` and `enabled`. Keys that are not
                read before this returns are an error.

        Raises:
            Exception: Any exception makes loading of the model or world fail.
        """

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Called before each physics step, at time t."""

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Called after each physics step, at time t + dt."""

    def begin_contact(self, contact: Contact) -> None:
        """Called after the physics step in which two fixtures began to touch."""

    def end_contact(self, contact: Contact) -> None:
        """Called when two fixtures cease to touch, or when one of them is removed."""

    def pre_solve(self, contact: MutableContact, old_manifold: OldManifold) -> None:
        """Called within the physics step; may change the contact but not bodies or joints."""

    def post_solve(self, contact: Contact, impulse: ContactImpulse) -> None:
        """Called after the physics step with the impulses that the solver applied to a contact."""

    def state(self) -> Any:
        """Returns everything that changes at run time and affects the future of the simulation.

        `World.state_hash` includes the returned value. Commands, `rng` and noise streams are
        included in any case, and need not be part of it. Values that depend on subscribers, such
        as the last scan of a laser that scans only on demand, must not be part of it.

        Returns:
            None, or any combination of bools, numbers, strings, bytes, arrays of numbers and
            dataclasses in tuples, lists, sets and dictionaries.
        """
        return None

    def on_shutdown(self) -> None:
        """Releases resources; called once, when the model is removed or the world is closed."""


class ModelPlugin(FlatlandPlugin):
    """A plugin of one model.

    Attributes:
        model: The model.
        all_contacts: Whether the contact hooks receive the contacts of all models instead of only
            the contacts of this model.
        world_frame_id: Name of the world frame in what the plugin emits, empty if there is none.
    """

    base_class_type = "flatland::ModelPlugin"
    all_contacts: ClassVar[bool] = False

    model: Model
    world_frame_id: str = ""

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Called after `World.move_model` has moved the model.

        Args:
            previous: Pose of each body before the move by name of the body, world frame [m, rad].
            keep_odometry: Whether estimates of the pose are to continue from before the move.
        """

    def filter_contact(self, contact: Contact | MutableContact) -> ModelContact | None:
        """Returns a contact from the point of view of this model.

        Returns:
            The contact with this model as the first party, None if this model is not involved.
        """
        if contact.body_a.entity is self.model:
            return ModelContact(
                contact.body_b.entity,
                contact.body_a,
                contact.body_b,
                contact.fixture_a,
                contact.fixture_b,
                True,
            )
        if contact.body_b.entity is self.model:
            return ModelContact(
                contact.body_a.entity,
                contact.body_b,
                contact.body_a,
                contact.fixture_b,
                contact.fixture_a,
                False,
            )
        return None


class WorldPlugin(FlatlandPlugin):
    """A plugin of the world.

    Attributes:
        world_config: Reader of the whole world file.
    """

    base_class_type = "flatland::WorldPlugin"

    world_config: YamlReader


def describe(plugin: FlatlandPlugin) -> str:
    """Returns the name, type and model of a plugin as they occur in error messages."""
    if isinstance(plugin, ModelPlugin):
        return f'Model Plugin "{plugin.name}" type "{plugin.type}" model "{plugin.model.name}"'
    return f'World Plugin "{plugin.name}" type "{plugin.type}"'


def overrides(plugin: FlatlandPlugin, hook: str) -> bool:
    """Returns whether a plugin's class, or the plugin itself, overrides a hook."""
    if hook in vars(plugin):
        return True
    return getattr(type(plugin), hook) is not getattr(FlatlandPlugin, hook)
