"""The plugins of a world: starts them, calls their hooks in order, ends them."""

from __future__ import annotations

import functools
import logging
import types
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from flatland.errors import PLUGIN_FAULTS, FlatlandError, PluginError, YamlError
from flatland.foreign_texts import text_of
from flatland.plugin_api.missing_plugins import read_entries
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin, describe
from flatland.plugin_api.registry import PluginRegistry
from flatland.runtime.contacts import ContactReporter
from flatland.runtime.jobs import Jobs
from flatland.runtime.time_limit import TimeLimitExceeded, call_with_limit

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.model import Model
    from flatland.geometry import Pose
    from flatland.plugin_api.plugin_world import PluginWorld
    from flatland.plugin_api.ports import PortUser
    from flatland.runtime.faults import Faults
    from flatland.runtime.observer import Observers
    from flatland.runtime.plugin_costs import PluginCosts
    from flatland.runtime.requests import Requests

_LOG = logging.getLogger("flatland")


class PluginHost:
    """Starts the plugins of a world, calls their hooks and ends them.

    Everything that belongs to one plugin (`on_initialize`, hooks, callbacks) runs in the thread
    that loads or steps the world. An exception of a hook never interrupts a step: `Faults`
    decides what becomes of it.

    Attributes:
        registry: The plugin classes that files can name.
        world_plugins: The world plugins in order of loading.
        jobs: The updates and controllers of all plugins.
        contacts: Reports contacts to plugins.
        costs: Takes the wall time of all calls; None if it is not measured. Settable.
        disabled: The plugins that were disabled because a function raised repeatedly. None of
            their functions is called again, and `sweep` removes their jobs before the next step.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {"costs": lambda: None}

    def __init__(
        self,
        world: PluginWorld,
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
        self.disabled: set[FlatlandPlugin] = set()
        self._is_swept = True  # whether no plugin of `disabled` has jobs
        self._starting: FlatlandPlugin | None = None  # whose `on_initialize` runs
        self.jobs = Jobs(
            world.physics.jobs,
            world.timekeeper,
            self.call,
            faults,
            self.disabled,
            requests.hooks,
        )
        self.contacts = ContactReporter(world.physics, self.call, self.jobs.order)
        self.costs: PluginCosts | None = None

    # -- start and end ---------------------------------------------------------------------

    def require_plugins(self, entries: Iterable[YamlReader], model: str | None) -> list[YamlReader]:
        """Checks that a plugin class exists for each enabled entry of a `plugins` list.

        Args:
            entries: Entries of the list.
            model: Name of the model, None for world plugins.

        Returns:
            The entries; if errors are collected, those that have a name and a class that exists.

        Raises:
            MissingPluginsError: Classes do not exist; the text names all of them.
            YamlError: An entry has no name or type.
        """
        listed = list(entries)
        named = read_entries(listed, model)
        entries = [entry for entry in listed if entry.is_complete]
        if len(entries) < len(listed):
            named = read_entries(entries, model)
        error = self.registry.missing_plugins_error(named)
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
        plugin._place = entry.place
        try:
            plugin.ros = self._observers.plugin_ros(plugin)
            self._initialize(plugin, config)
            config.ensure_accessed_all()
            self.jobs.add(plugin)
            self.contacts.add_plugin(plugin)
        except PLUGIN_FAULTS as error:
            self._abandon(plugin)
            text = error.message if isinstance(error, PluginError) else text_of(error)
            if isinstance(error, SystemExit) or not (isinstance(error, FlatlandError) or text):
                text = f"{type(error).__name__} {text}".strip()
            text = f"{describe(plugin)}: {text}"
            if isinstance(error, YamlError):  # which names a place of its own
                position = error.place or entry.place
                raise PluginError(text, place=position, hint=error.hint) from error
            hint = error.hint if isinstance(error, FlatlandError) else ""
            raise PluginError(text + entry.place.suffix, place=entry.place, hint=hint) from error
        except BaseException:
            self._abandon(plugin)
            raise

    def _abandon(self, plugin: FlatlandPlugin) -> None:
        """Removes all that a plugin that failed to start has declared."""
        self._stop(plugin)
        self._release(plugin)
        self._forget([plugin])

    def _initialize(self, plugin: FlatlandPlugin, config: YamlReader) -> None:
        outer, self._starting = self._starting, plugin
        try:
            with self._requests.plugin_code():
                call_with_limit(self._timeout, lambda: plugin.on_initialize(config))
        except TimeLimitExceeded:
            raise PluginError(f"on_initialize did not return within {self._timeout:g} s") from None
        finally:
            self._starting = outer

    def shut_down(self, plugins: Sequence[FlatlandPlugin]) -> None:
        """Ends plugins, the last one first: no more hooks, `on_shutdown`, then their ports."""
        interrupt: BaseException | None = None
        for plugin in plugins:
            self._stop(plugin)
        for plugin in reversed(plugins):
            if isinstance(plugin, WorldPlugin) and plugin in self.world_plugins:
                self.world_plugins.remove(plugin)
            try:
                with self._requests.hooks():
                    plugin.on_shutdown()
            except PLUGIN_FAULTS as error:
                name = f"{describe(plugin)}: on_shutdown"
                self._faults.add((plugin, "on_shutdown"), name, error)
            except BaseException as error:
                interrupt = interrupt or error  # The other plugins end, too.
            self._release(plugin)
        self._forget(plugins)
        if interrupt is not None:
            raise interrupt

    def _stop(self, plugin: FlatlandPlugin) -> None:
        """Removes the jobs and the contact hooks of a plugin."""
        self.jobs.remove(plugin)
        self.contacts.remove_plugin(plugin)

    def _forget(self, plugins: Sequence[FlatlandPlugin]) -> None:
        """Removes the records of plugins that have ended."""
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

    # -- calls -----------------------------------------------------------------------------

    def prepare_step(self, transforms_wanted: bool) -> bool:
        """Prepares the next step; see `Jobs.refresh`."""
        if not self._is_swept:
            self._sweep()
        if self.contacts.is_stale:
            self.contacts.update()
        return self.jobs.refresh(transforms_wanted)

    def is_prepared(self, transforms_wanted: bool) -> bool:
        """Returns whether `prepare_step` has nothing to do."""
        is_stale = self.contacts.is_stale or not self._is_swept
        return not is_stale and self.jobs.is_current(transforms_wanted)

    def _sweep(self) -> None:
        """Removes the jobs and contact hooks of the plugins that were disabled."""
        while not self._is_swept:
            self._is_swept = True  # What `skipped` raises may disable further plugins.
            for plugin in [plugin for plugin in self.disabled if plugin in self.jobs]:
                self._stop(plugin)

    def find_owner(self, callback: object) -> PortUser | None:
        """Returns who subscribes to an output, or adds an observer, in the current thread.

        Args:
            callback: The function that is subscribed; None without one.

        Returns:
            The plugin to which the function belongs, or which is being started; the host if other
            code of a plugin runs; None for code outside of the world.
        """
        plugin = _plugin_of(callback)
        if plugin is not None and plugin.world is self._world:
            return plugin
        is_outside = not self._requests.in_plugin or self._observers.is_notifying
        return None if is_outside else self._starting or self

    def _call_at_end(self, function: Callable[[], None]) -> None:
        """Does nothing: what unknown plugins use ends with the world."""

    def call_updates(self, callbacks: Sequence[int]) -> None:
        """Calls the functions of updates that are due; see `Jobs.call`."""
        self.jobs.call(callbacks, one_by_one=self.costs is not None)

    def call(
        self,
        plugin: FlatlandPlugin,
        hook: str,
        source: Hashable,
        function: Callable[..., object],
        *arguments: Any,
    ) -> None:
        """Calls a function of a plugin that is not disabled, and takes what it raises.

        Args:
            plugin: The plugin.
            hook: Name of the hook as part of which the function is called.
            source: What identifies the function, see `Faults.add_of_plugin`.
            function: The function.
            *arguments: Its arguments.
        """
        if self.disabled and plugin in self.disabled:
            return
        if self.costs is not None:
            function = self.costs.timed(plugin, function)
        try:
            function(*arguments)
            if self._faults.counts:
                self._faults.succeeded(plugin, source)
        except PLUGIN_FAULTS as error:
            if self._faults.add_of_plugin(plugin, hook, source, describe(plugin), error):
                self.disabled.add(plugin)
                self._is_swept = False
                self.jobs.change()

    def model_moved(self, model: Model, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Calls `model_moved` of the plugins of a model; see `ModelPlugin.model_moved`."""
        self.jobs.settle()
        hook = "model_moved"
        with self._requests.hooks():
            for plugin in (*model.plugins, *model.followers):
                # Plugins that are disabled or have ended are omitted.
                if plugin in self.jobs:
                    self.call(plugin, hook, hook, plugin.model_moved, previous, keep_odometry)


def _plugin_of(callback: object) -> FlatlandPlugin | None:
    """Returns the plugin of which a function is a method, or in whose method it was created."""
    while isinstance(callback, functools.partial):
        callback = callback.func
    owner = getattr(callback, "__self__", None)
    if isinstance(callback, types.FunctionType) and "self" in callback.__code__.co_freevars:
        cell = (callback.__closure__ or ())[callback.__code__.co_freevars.index("self")]
        owner = cell.cell_contents
    return owner if isinstance(owner, FlatlandPlugin) else None
