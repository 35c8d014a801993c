"""Calls the hooks of all plugins of a world, in order, and contains their faults."""

from __future__ import annotations

import ctypes
import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from flatland.entities.contact import Contact, ContactImpulse, MutableContact
from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, WorldPlugin, describe

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.physics import ContactEvent, OldManifold, PreSolveContact
    from flatland.runtime.plugin_costs import PluginCosts
    from flatland.timekeeper import Timekeeper

_LOG = logging.getLogger("flatland")

MAX_FAULTS = 3
_FAULT_LOG_PERIOD = 1.0  # s of wall time between two tracebacks of one plugin
_EVENT_HOOKS = {"begin": "begin_contact", "end": "end_contact", "post_solve": "post_solve"}
_HOOKS = ("before_physics_step", "after_physics_step", "pre_solve", *_EVENT_HOOKS.values())

Hook = Callable[..., None]
HookList = list[tuple[FlatlandPlugin, Hook]]


def overrides(plugin: FlatlandPlugin, hook: str) -> bool:
    """Tells whether a plugin's class, or the plugin itself, has its own version of a hook."""
    return hook in vars(plugin) or getattr(type(plugin), hook) is not getattr(FlatlandPlugin, hook)


def initialize(plugin: FlatlandPlugin, config: YamlReader, timeout: float | None) -> None:
    """Runs a plugin's `on_initialize` and checks that it read every parameter.

    With a timeout it runs in a thread of its own, since nothing else can be left behind when it
    blocks for ever.

    Args:
        plugin: The plugin, attached to its world.
        config: Its parameters.
        timeout: Wall time [s] that it may take, None for as long as it likes.

    Raises:
        PluginError: It took longer.
        Exception: What it raised itself.
    """
    if timeout is None:
        plugin.on_initialize(config)
        config.ensure_accessed_all()
        return
    raised: list[BaseException] = []

    def run() -> None:
        try:
            plugin.on_initialize(config)
        except BaseException as error:
            raised.append(error)

    worker = threading.Thread(target=run, name=f"on_initialize of {plugin.name}", daemon=True)
    worker.start()
    with plugin.world.initialized_by(worker):
        # Python refuses to wait longer than some centuries.
        worker.join(min(timeout, threading.TIMEOUT_MAX))
    if worker.is_alive():
        # Ends a loop in Python; what blocks in C stays behind as a daemon thread.
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(worker.ident or 0), ctypes.py_object(SystemExit)
        )
        raise PluginError(f"on_initialize did not return within {timeout:g} s")
    if raised:
        raise raised[0]
    config.ensure_accessed_all()


class PluginHost:
    """The plugins of a world in order of loading: those of models first, then those of the world.

    An exception out of a hook never goes further: it is logged, and a plugin whose hook raises
    `MAX_FAULTS` times in a row is called no more.
    """

    def __init__(self) -> None:
        """Starts without plugins."""
        self.model_plugins: list[ModelPlugin] = []
        self.world_plugins: list[WorldPlugin] = []
        self._disabled: set[FlatlandPlugin] = set()
        self._faults: dict[tuple[FlatlandPlugin, str], int] = {}
        self._last_log: dict[FlatlandPlugin, float] = {}
        self._hooks: dict[str, HookList] = {}
        self._costs: PluginCosts | None = None
        self._schedule()

    @property
    def wants_contacts(self) -> bool:
        """Whether any plugin listens to contacts."""
        return any(self._hooks[hook] for hook in _EVENT_HOOKS.values())

    @property
    def wants_pre_solve(self) -> bool:
        """Whether any plugin changes contacts."""
        return bool(self._hooks["pre_solve"])

    def is_disabled(self, plugin: FlatlandPlugin) -> bool:
        """Tells whether a plugin is called no more because of its faults."""
        return plugin in self._disabled

    def add(self, plugin: FlatlandPlugin) -> None:
        """Calls a plugin's hooks from now on."""
        if isinstance(plugin, ModelPlugin):
            self.model_plugins.append(plugin)
        elif isinstance(plugin, WorldPlugin):
            self.world_plugins.append(plugin)
        self._schedule()

    def remove(self, plugins: Sequence[FlatlandPlugin]) -> None:
        """Calls the hooks of some plugins no more."""
        gone = set(plugins)
        self.model_plugins = [plugin for plugin in self.model_plugins if plugin not in gone]
        self.world_plugins = [plugin for plugin in self.world_plugins if plugin not in gone]
        self._disabled -= gone
        self._faults = {key: n for key, n in self._faults.items() if key[0] not in gone}
        self._last_log = {key: t for key, t in self._last_log.items() if key not in gone}
        self._schedule()

    def measure(self, costs: PluginCosts | None) -> None:
        """Starts to add the time of all hooks to some costs; None ends that."""
        self._costs = costs
        self._schedule()

    def _schedule(self) -> None:
        plugins = [*self.model_plugins, *self.world_plugins]
        timed = _untimed if self._costs is None else self._costs.timed
        for hook in _HOOKS:
            # New lists, so that a loop that runs over the old ones is not disturbed.
            self._hooks[hook] = [
                (plugin, timed(plugin, getattr(plugin, hook)))
                for plugin in plugins
                if overrides(plugin, hook) and plugin not in self._disabled
            ]

    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Runs `before_physics_step` of all plugins."""
        self._run("before_physics_step", timekeeper)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Runs `after_physics_step` of all plugins."""
        self._run("after_physics_step", timekeeper)

    def dispatch_contacts(self, events: Sequence[ContactEvent], bodies: dict[int, Body]) -> None:
        """Hands recorded contact events to the plugins that listen, in order.

        Args:
            events: What happened, in order.
            bodies: All bodies by the id of their physics body.
        """
        for event in events:
            hook = _EVENT_HOOKS[event.kind]
            if not self._hooks[hook]:
                continue
            contact = Contact.between(bodies, event)
            if contact is None:
                continue
            if hook == "post_solve":
                impulse = ContactImpulse(event.normal_impulses, event.tangent_impulses)
                self._run(hook, contact, impulse)
            else:
                self._run(hook, contact)

    def pre_solve(
        self, raw: PreSolveContact, old_manifold: OldManifold, bodies: dict[int, Body]
    ) -> None:
        """Lets the plugins that ask for it change a contact; runs inside the physics step."""
        body_a, body_b = bodies.get(raw.body_a), bodies.get(raw.body_b)
        if body_a is None or body_b is None:
            return
        contact = MutableContact(
            raw,
            body_a,
            body_b,
            body_a.physics.fixture(raw.fixture_a),
            body_b.physics.fixture(raw.fixture_b),
        )
        self._run("pre_solve", contact, old_manifold)

    def shut_down(self, plugins: Sequence[FlatlandPlugin]) -> None:
        """Takes plugins out, last first: no more hooks, `on_shutdown`, then their ports end."""
        self.remove(plugins)
        for plugin in reversed(plugins):
            try:
                plugin.on_shutdown()
            except PLUGIN_FAULTS:
                _LOG.exception("%s: on_shutdown raised", describe(plugin))
            self.release(plugin)

    def release(self, plugin: FlatlandPlugin) -> None:
        """Closes the ports and connections of a plugin, also where it forgot to do so."""
        try:
            if plugin.ros is not None:
                plugin.ros.close()
        except PLUGIN_FAULTS:
            _LOG.exception("%s: its ROS connections could not be closed", describe(plugin))
        plugin._detach()

    def _run(self, hook: str, *arguments: Any) -> None:
        faults = self._faults
        for plugin, method in self._hooks[hook]:
            try:
                method(*arguments)
                if faults:
                    faults.pop((plugin, hook), None)
            except PLUGIN_FAULTS:
                self._fault(plugin, hook)

    def _fault(self, plugin: FlatlandPlugin, hook: str) -> None:
        """Counts and logs the exception that is being handled."""
        count = self._faults.get((plugin, hook), 0) + 1
        self._faults[plugin, hook] = count
        now = time.monotonic()
        if now - self._last_log.get(plugin, -_FAULT_LOG_PERIOD) >= _FAULT_LOG_PERIOD:
            self._last_log[plugin] = now
            _LOG.exception("%s: %s raised", describe(plugin), hook)
        if count >= MAX_FAULTS and plugin not in self._disabled:
            self._disabled.add(plugin)
            self._schedule()
            _LOG.error(
                "%s: %s raised %d times in a row, the plugin is disabled",
                describe(plugin),
                hook,
                count,
            )


def _untimed(_plugin: FlatlandPlugin, hook: Hook) -> Hook:
    return hook
