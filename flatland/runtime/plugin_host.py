"""The plugins of a world: starts them, calls their hooks in order, ends them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from flatland.entities.contact import Contact, ContactImpulse, MutableContact
from flatland.errors import PLUGIN_FAULTS, FlatlandError, PluginError, YamlError
from flatland.plugin_api.missing_plugins import missing_plugins_error, read_entries
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin, describe
from flatland.plugin_api.registry import PluginRegistry
from flatland.runtime.hooks import CONTACT_HOOKS, HookList, HookTable, StepCall
from flatland.runtime.step_schedule import StepSchedule
from flatland.runtime.time_limit import TimeLimitExceeded, time_limit

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.geometry import Pose
    from flatland.physics import ContactEvent, OldManifold, PreSolveContact
    from flatland.plugin_api.schedule import HookBatch
    from flatland.runtime.faults import Faults
    from flatland.runtime.observer import Observers
    from flatland.runtime.plugin_costs import PluginCosts
    from flatland.runtime.requests import Requests
    from flatland.timekeeper import Timekeeper
    from flatland.world import World

_LOG = logging.getLogger("flatland")

R = TypeVar("R")

_EVENT_HOOKS = {"begin": "begin_contact", "end": "end_contact", "post_solve": "post_solve"}


class PluginHost:
    """Starts the plugins of a world, calls their hooks and ends them.

    Everything that belongs to one plugin (`on_initialize`, hooks, callbacks) runs in the thread
    that loads or steps the world. An exception of a hook never interrupts a step: `Faults`
    decides what becomes of it.

    Attributes:
        registry: The plugin classes that files can name.
        world_plugins: The world plugins in order of loading.
        hooks: The hooks of all plugins.
        schedule: Which hooks are called only when an update is due.
        costs: The costs that are being measured, None if none are.
        disabled: The plugins that were disabled because a hook raised repeatedly.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {"costs": lambda: None}

    def __init__(
        self,
        world: World,
        observers: Observers,
        requests: Requests,
        faults: Faults,
        timeout: float | None,
    ) -> None:
        """Creates a host without plugins.

        Args:
            world: The world of the plugins.
            observers: Provide plugins with access to ROS.
            requests: Notified when code of a plugin runs.
            faults: Takes what hooks raise.
            timeout: Limit of wall time of `on_initialize` [s]; None for no limit.
        """
        self.registry = PluginRegistry()
        self.world_plugins: list[WorldPlugin] = []
        self._world = world
        self._observers = observers
        self._requests = requests
        self._faults = faults
        self._timeout = timeout
        self._plan = world.physics.plan
        self.schedule = StepSchedule(self._plan, world.timekeeper, self._add_fault)
        self.hooks = HookTable(self.schedule)
        self.costs: PluginCosts | None = None
        self.disabled: set[FlatlandPlugin] = set()

    # -- start and end ---------------------------------------------------------------------

    def require_plugins(self, entries: Iterable[YamlReader], model: str | None) -> list[YamlReader]:
        """Checks that a plugin class exists for each enabled entry of a `plugins` list.

        Args:
            entries: Entries of the list.
            model: Name of the model, None for world plugins.

        Returns:
            The entries; if errors are collected, those whose class exists.

        Raises:
            MissingPluginsError: Classes do not exist; the text names all of them.
            YamlError: An entry has no name or type.
        """
        entries = list(entries)
        named = read_entries(entries, model)
        error = missing_plugins_error(self.registry, named)
        if error is None:
            return entries
        entries[0].report(error)
        missing = set(self.registry.find_missing(entry.type_name for entry in named))
        return [entry for entry in entries if entry.get("type", "string") not in missing]

    def start_model_plugin(self, model: Model, entry: YamlReader) -> None:
        """Starts a plugin of a model and appends it to the model's plugins.

        Args:
            model: The model.
            entry: Entry of the plugin in the model file.

        Raises:
            PluginError: It cannot be found, created or initialized.
        """
        entry.attempt(lambda reader: self._start_model_plugin(model, reader))

    def _start_model_plugin(self, model: Model, entry: YamlReader) -> None:
        name, type_name = entry.get("name", "string"), entry.get("type", "string")
        what = f'Model Plugin "{name}" type "{type_name}" model "{model.name}"'
        plugin = self._create(type_name, ModelPlugin, what, entry)
        plugin.model = model
        plugin._attach(self._world, model.name, name, type_name, model.namespace)
        self._start(plugin, entry, (f'model "{model.name}"', f'plugin "{name}"'))
        model.plugins.append(plugin)

    def start_world_plugin(self, entry: YamlReader, world_config: YamlReader) -> None:
        """Starts a world plugin.

        Args:
            entry: Entry of the plugin in the world file.
            world_config: Reader of the whole world file.

        Raises:
            YamlError: A world plugin of that name and type exists.
            PluginError: It cannot be found, created or initialized.
        """
        name, type_name = entry.get("name", "string"), entry.get("type", "string")
        for other in self.world_plugins:
            if (other.name, other.type) == (name, type_name):
                raise entry.error(
                    f'Invalid "world plugins" with name "{name}", type "{type_name}" already exists'
                )
        entry.attempt(lambda reader: self._start_world_plugin(reader, world_config))

    def _start_world_plugin(self, entry: YamlReader, world_config: YamlReader) -> None:
        name, type_name = entry.get("name", "string"), entry.get("type", "string")
        what = f'World Plugin "{name}" type "{type_name}"'
        plugin = self._create(type_name, WorldPlugin, what, entry)
        plugin.world_config = world_config
        plugin._attach(self._world, "", name, type_name, "")
        self._start(plugin, entry, ("", f'world_plugin "{name}"'))
        self.world_plugins.append(plugin)

    def _create(self, type_name: str, base: type[Any], what: str, entry: YamlReader) -> Any:
        try:
            return self.registry.create(type_name, base)
        except PluginError as error:
            located = entry.error(f"{what}: {error.message}")
            raise PluginError(located.message, place=located.place) from error

    def _start(self, plugin: FlatlandPlugin, entry: YamlReader, place: tuple[str, str]) -> None:
        """Initializes a plugin and adds its hooks; a failure leaves nothing behind."""
        config = entry.without("name", "type", "enabled").with_location(*place)
        try:
            plugin.ros = self._observers.plugin_ros(plugin)
            self._initialize(plugin, config)
            config.ensure_accessed_all()
        except PLUGIN_FAULTS as error:
            self._release(plugin)
            text = error.message if isinstance(error, PluginError) else str(error)
            if isinstance(error, SystemExit) or not (isinstance(error, FlatlandError) or text):
                text = f"{type(error).__name__} {text}".strip()
            text = f"{describe(plugin)}: {text}"
            if isinstance(error, YamlError):  # which names a place of its own
                position = error.place or entry.place
                raise PluginError(text, place=position, hint=error.hint) from error
            raise PluginError(text + entry.place.suffix, place=entry.place) from error
        except BaseException:
            self._release(plugin)
            raise
        self.hooks.add(plugin)

    def _initialize(self, plugin: FlatlandPlugin, config: YamlReader) -> None:
        try:
            with self._requests.plugin_code(), time_limit(self._timeout):
                plugin.on_initialize(config)
        except TimeLimitExceeded:
            raise PluginError(f"on_initialize did not return within {self._timeout:g} s") from None

    def shut_down(self, plugins: Sequence[FlatlandPlugin]) -> None:
        """Ends plugins, the last one first: no more hooks, `on_shutdown`, then their ports."""
        for plugin in plugins:
            self.hooks.remove(plugin)
        for plugin in reversed(plugins):
            if isinstance(plugin, WorldPlugin) and plugin in self.world_plugins:
                self.world_plugins.remove(plugin)
            try:
                with self._requests.hooks():
                    plugin.on_shutdown()
            except PLUGIN_FAULTS as error:
                name = f"{describe(plugin)}: on_shutdown"
                self._faults.add((plugin, "on_shutdown"), name, error)
            self._release(plugin)
        self._faults.forget(set(plugins))
        self.disabled.difference_update(plugins)

    def _release(self, plugin: FlatlandPlugin) -> None:
        """Closes the ports and connections that a plugin left open."""
        try:
            if plugin.ros is not None:
                plugin.ros.close()
        except PLUGIN_FAULTS:
            _LOG.exception("%s: closing its ROS connections failed", describe(plugin))
        plugin._detach()

    # -- hooks -----------------------------------------------------------------------------

    def measure(self, costs: PluginCosts | None) -> None:
        """Adds the wall time of all hooks to some costs from now on; None ends the measurement."""
        self.costs = costs
        self.hooks.wrap(None if costs is None else costs.timed)

    @property
    def wants_contacts(self) -> bool:
        """Whether any plugin overrides a hook for recorded contacts."""
        return self.hooks.has_any(*CONTACT_HOOKS)

    @property
    def wants_pre_solve(self) -> bool:
        """Whether any plugin overrides `pre_solve`."""
        return self.hooks.has_any("pre_solve")

    def contact_kinds(self, bodies: Iterable[Body]) -> tuple[dict[int, int], int]:
        """Returns the contact events that concern hooks.

        Args:
            bodies: The bodies of all models and layers.

        Returns:
            The kinds of events by the id of the body, and those of all bodies, as in
            `PhysicsWorld.record_contacts_of`.
        """
        kinds: dict[int, int] = {}
        kinds_of_all = 0
        for number, hook in enumerate(CONTACT_HOOKS):
            if self.hooks.concern_all(hook):
                kinds_of_all |= 1 << number
            elif self.hooks.has_any(hook):
                for body in self.hooks.bodies_concerned(hook, bodies):
                    kinds[body.id] = kinds.get(body.id, 0) | 1 << number
        return kinds, kinds_of_all

    def pre_solve_bodies(self, bodies: Mapping[int, Body]) -> set[int]:
        """Returns the physics ids of the bodies whose contacts concern a `pre_solve` hook."""
        concerned = self.hooks.bodies_concerned("pre_solve", bodies.values())
        return {body.id for body in concerned}

    def call_step_hooks(self, hook: str, due: int, timekeeper: Timekeeper) -> None:
        """Calls a hook of the plugins that need it in this step.

        Args:
            hook: `before_physics_step` or `after_physics_step`.
            due: The clocks of updates that are due, as bits.
            timekeeper: The simulated time.
        """
        is_after = hook == "after_physics_step"
        for call in self.hooks.calls(hook, due):
            if call.members and call.batch is not None:
                self._call_batch(hook, call.members, call.batch, timekeeper)
            else:
                self._carry_out_before(call, is_after, timekeeper)
                self._call_one(hook, call.plugin, call.hook, timekeeper)

    def _carry_out_before(self, call: StepCall, is_after: bool, timekeeper: Timekeeper) -> None:
        if call.until:
            self._plan.carry_out(is_after, call.until, timekeeper.step_size)

    def _call_one(
        self,
        hook: str,
        plugin: FlatlandPlugin,
        function: Callable[[Timekeeper], R],
        timekeeper: Timekeeper,
    ) -> R | None:
        """Calls a hook, or a part of it, and takes what it raises.

        Returns:
            What it returned, None if it raised.
        """
        result = None
        try:
            result = function(timekeeper)
            # A part that returns true is followed by others.
            if self._faults.counts and not result:
                self._faults.succeeded(plugin, hook)
        except PLUGIN_FAULTS as error:
            self._add_fault(plugin, hook, error)
        if self.schedule.targets:
            self.schedule.push_targets()
        return result

    def _call_batch(
        self, hook: str, members: Sequence[StepCall], batch: HookBatch, timekeeper: Timekeeper
    ) -> None:
        """Calls the hooks of several plugins part by part."""
        is_after = hook == "after_physics_step"
        # What the core does in between sets velocities only, see `HookTable.calls`.
        begun = [
            call
            for call in members
            if self._call_one(hook, call.plugin, getattr(call.plugin, batch.begin), timekeeper)
        ]
        performed = {call.plugin for call in begun}
        try:
            if begun:
                batch.perform([call.plugin for call in begun])
        except PLUGIN_FAULTS:
            # One by one, to find out which of them raises.
            for call in begun:
                try:
                    batch.perform([call.plugin])
                except PLUGIN_FAULTS as error:
                    performed.discard(call.plugin)
                    self._add_fault(call.plugin, hook, error)
        for call in members:
            self._carry_out_before(call, is_after, timekeeper)
            if call.plugin in performed:
                self._call_one(hook, call.plugin, getattr(call.plugin, batch.finish), timekeeper)

    def call_failed(self, timekeeper: Timekeeper) -> None:
        """Calls the hooks of the plugins whose controllers failed, which raise the same error."""
        failed = set(self._plan.take_failed())
        for plugin, method in self.hooks.of_step("before_physics_step"):
            if any(controller.id in failed for controller in plugin._controllers):
                self._call("before_physics_step", [(plugin, method)], timekeeper)

    def model_moved(self, model: Model, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Calls `model_moved` of the plugins of a model; see `ModelPlugin.model_moved`."""
        self.schedule.settle()
        with self._requests.hooks():
            self._call("model_moved", self.hooks.of_move(model), previous, keep_odometry)

    def dispatch_contacts(self, events: Sequence[ContactEvent], bodies: Mapping[int, Body]) -> None:
        """Passes recorded contact events to the plugins that they concern, in order.

        Args:
            events: The events in order.
            bodies: All bodies by the id of their physics body.
        """
        for event in events:
            body_a, body_b = bodies.get(event.body_a), bodies.get(event.body_b)
            if body_a is None or body_b is None:
                continue  # A plugin created one of them in the physics world itself.
            hook = _EVENT_HOOKS[event.kind]
            hooks = self.hooks.of_contact(hook, body_a, body_b)
            if not hooks:
                continue
            contact = Contact.between(bodies, event)
            if hook == "post_solve":
                impulse = ContactImpulse(event.normal_impulses, event.tangent_impulses)
                self._call(hook, hooks, contact, impulse)
            else:
                self._call(hook, hooks, contact)

    def pre_solve(
        self, raw: PreSolveContact, old_manifold: OldManifold, bodies: Mapping[int, Body]
    ) -> None:
        """Calls `pre_solve` of the plugins that a contact concerns, within the physics step."""
        body_a, body_b = bodies.get(raw.body_a), bodies.get(raw.body_b)
        if body_a is None or body_b is None:
            return
        contact = MutableContact(
            raw,
            body_a,
            body_b,
            body_a.fixture(raw.fixture_a),
            body_b.fixture(raw.fixture_b),
        )
        hooks = self.hooks.of_contact("pre_solve", body_a, body_b)
        self._call("pre_solve", hooks, contact, old_manifold)

    def _call(self, hook: str, hooks: HookList, *arguments: Any) -> None:
        counts = self._faults.counts
        for plugin, method in hooks:
            try:
                method(*arguments)
                if counts:
                    self._faults.succeeded(plugin, hook)
            except PLUGIN_FAULTS as error:
                self._add_fault(plugin, hook, error)

    def _add_fault(self, plugin: FlatlandPlugin, hook: str, error: BaseException) -> None:
        if self._faults.add_in_hook(plugin, hook, describe(plugin), error):
            self.hooks.remove(plugin)
            self.disabled.add(plugin)
