"""Snapshots, clones and resets of a world."""

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from flatland.copying.copier import Copier
from flatland.copying.kinds import UncopyableError
from flatland.copying.record import SavedObjects
from flatland.errors import WorldError
from flatland.plugin_api.plugin import FlatlandPlugin, ModelPlugin, describe
from flatland.plugin_api.ports import callback_name
from flatland.runtime.appearance import appearance_of
from flatland.timekeeper import NANOSECONDS
from flatland.uncopied import uncopied

if TYPE_CHECKING:
    from collections.abc import Collection

    from flatland.copying.kinds import Kind
    from flatland.entities.body import Body
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.plugin_api.plugin import WorldPlugin
    from flatland.plugin_api.port_registry import PortRegistry
    from flatland.plugin_api.ports import Output, OwnedSubscription, PortUser
    from flatland.runtime.layer_set import LayerSet
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.observer import Observers
    from flatland.runtime.plugin_host import PluginHost
    from flatland.timekeeper import Timekeeper

T = TypeVar("T")

_LOG = logging.getLogger("flatland")
# Memory of a copy, measured with worlds of 3000 shared or other map edges, and 100 robots [bytes].
_BYTES_PER_WORLD: Final = 160_000
_BYTES_PER_FIXTURE: Final = 330
_BYTES_PER_SHARED_FIXTURE: Final = 16
_BYTES_PER_OBJECT: Final = 520
_ADVICE: Final = (
    'the class can define __getstate__ and __setstate__, see "Snapshots" in docs/write_a_plugin.md'
)


@uncopied("World.restore() accepts a snapshot any number of times, World.clone() copies a world")
class WorldSnapshot:
    """The state of a world at one time, returned by `World.snapshot`.

    Attributes:
        time_ns: Simulated time [ns].
        number: Number of the snapshot in its world, from 0 on, in the order in which snapshots were
            taken.
        size: Estimated memory of the snapshot [bytes].
    """

    __slots__ = (
        "_models",
        "_objects",
        "_owner",
        "_physics",
        "_ports",
        "_world_plugins",
        "number",
        "size",
        "time_ns",
    )

    def __init__(
        self,
        owner: Snapshots,
        number: int,
        time_ns: int,
        physics: PhysicsWorld,
        objects: SavedObjects,
        models: list[Model],
        world_plugins: list[WorldPlugin],
        ports: _Ports,
    ) -> None:
        """Creates a snapshot.

        Args:
            owner: Takes the snapshots of the world.
            number: Number of the snapshot.
            time_ns: Simulated time [ns].
            physics: A copy of the physics world, which nothing else uses.
            objects: The contents of all objects of the world.
            models: The models.
            world_plugins: The world plugins.
            ports: The open ports.
        """
        self.number = number
        self.time_ns = time_ns
        self._owner = owner
        self._physics = physics
        self._objects = objects
        self._models = models
        self._world_plugins = world_plugins
        self._ports = ports
        self.size = size_of(physics) + _BYTES_PER_OBJECT * len(objects)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.time_ns / NANOSECONDS

    def __repr__(self) -> str:
        return f"<WorldSnapshot at {self.time:.3f} s, models: {len(self._models)}>"


def size_of(physics: PhysicsWorld) -> int:
    """Returns the estimated memory of a copy of a physics world [bytes]."""
    shared = physics.shared_fixtures
    own = physics.object_counts().fixtures - shared
    return _BYTES_PER_WORLD + _BYTES_PER_FIXTURE * own + _BYTES_PER_SHARED_FIXTURE * shared


class _Ports:
    """The open ports of a world, and what plugins have connected to their world."""

    def __init__(self, ports: PortRegistry, observers: Observers) -> None:
        outputs, commands = ports.kept
        self.outputs = [*ports.outputs.values(), *outputs]
        self.commands = [*itertools.chain.from_iterable(ports.commands.values()), *commands]
        self.subscriptions: list[OwnedSubscription] = []
        for output in self.outputs:
            if output._subscribers:
                self.subscriptions += output.of_plugins
        self.observers = observers.of_plugins

    def resume(self, plugins: Collection[PortUser], observers: Observers) -> None:
        """Connects plugins that have ended since, and are restored, to their world again."""
        for output, token, callback, wants in self.subscriptions:
            if token.owner in plugins:
                output.resume(token, callback, wants=wants)
                output.sort([other for of, other, *_ in self.subscriptions if of is output])
        for observer, owner in self.observers:
            if owner in plugins:
                observers.add_of_plugin(observer, owner)


class Snapshots:
    """Takes and restores snapshots of one world, and copies its state to another one.

    A snapshot consists of a copy of the physics world and of the contents of the other parts, with
    all objects that they refer to. A part that defines `__getstate__` and `__setstate__` saves and
    restores itself; others are saved attribute by attribute.

    Attributes:
        taken: Number of snapshots that were taken.
    """

    def __init__(
        self,
        saved: tuple[object, ...],
        others: tuple[object, ...],
        physics: PhysicsWorld,
        timekeeper: Timekeeper,
        layers: LayerSet,
        models: ModelSet,
        host: PluginHost,
        ports: PortRegistry,
        observers: Observers,
    ) -> None:
        """Stores the parts of the world.

        Args:
            saved: The parts of the world that have a state.
            others: The world and its other parts, which the former refer to.
            physics: The physics world.
            timekeeper: The simulated time.
            layers: The layers.
            models: The models.
            host: The plugins.
            ports: The ports.
            observers: Notified of what a restore changes.
        """
        self.taken = 0
        self._saved = saved
        self._others = (*others, self)
        self._physics = physics
        self._timekeeper = timekeeper
        self._layers = layers
        self._models = models
        self._host = host
        self._ports = ports
        self._observers = observers
        self._kinds: dict[type[Any], Kind] = {}

    # -- snapshots -------------------------------------------------------------------------

    def take(self, original: WorldSnapshot | None = None) -> WorldSnapshot:
        """Takes a snapshot; see `World.snapshot`."""
        self._settle()
        if original is None:
            physics = self._physics.copy()
        else:
            physics = original._physics
            if not np.array_equal(physics.body_states(), self._physics.body_states()):
                raise ValueError("the world is not an unchanged clone: its bodies differ")
        try:
            objects = SavedObjects(self._saved, self._kinds, self._not_saved)
        except UncopyableError as error:
            raise self._located(error) from None
        snapshot = WorldSnapshot(
            self,
            self.taken,
            self._timekeeper.sim_time_ns,
            physics,
            objects,
            list(self._models.by_name.values()),
            list(self._host.world_plugins),
            _Ports(self._ports, self._observers),
        )
        self.taken += 1
        return snapshot

    @property
    def _not_saved(self) -> list[object]:
        """The parts that have no state which a snapshot saves."""
        costs = self._host.costs
        measured = [] if costs is None else [costs, *vars(costs).values()]
        return [*self._others, self._host.registry, *measured]

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Restores a snapshot; see `World.restore`."""
        if snapshot._owner is not self:
            raise WorldError("the snapshot is one of another world")
        revived = self._revived_plugins(snapshot)
        for plugin in revived:
            if plugin.ros is not None and plugin.ros.used and not _defines_state(plugin):
                raise _ended(plugin, "ros")
        self._restore(snapshot, revived)

    def _revived_plugins(self, snapshot: WorldSnapshot) -> list[FlatlandPlugin]:
        """Returns the plugins that have ended, and that a restore of a snapshot brings back."""
        present = set(self._plugins)
        before = [plugin for model in snapshot._models for plugin in model.plugins]
        return [each for each in (*before, *snapshot._world_plugins) if each not in present]

    def _settle(self) -> None:
        """Ends the values that a source passes to commands, which are no part of a snapshot."""
        for commands in self._ports.commands.values():
            for command in commands:
                command.settle()

    def _restore(self, snapshot: WorldSnapshot, revived_plugins: list[FlatlandPlugin]) -> None:
        self._settle()
        models, observers = list(self._models.by_name.values()), self._observers
        kept = set(models) & set(snapshot._models)
        revived = [model for model in snapshot._models if model not in kept]
        for plugin in revived_plugins:
            self._check_revivable(plugin)
        newer = [p for p in self._host.world_plugins if p not in snapshot._world_plugins]
        if newer:
            self._host.shut_down(newer)
        for model in reversed(models):
            if model not in kept:
                self._models.delete(model.name)
        watched = kept if observers.watch_appearance else ()
        appearances = [(model, appearance_of(model)) for model in models if model in watched]
        walls = self._walls()
        ports, time_ns = _Ports(self._ports, self._observers), self._timekeeper.sim_time_ns
        self._physics.become_copy_of(snapshot._physics)
        error = snapshot._objects.write_back()
        self._host.jobs.change()  # Other outputs may be wanted than at that time.
        if self._timekeeper.sim_time_ns != time_ns:
            observers.time_advanced(self._timekeeper.sim_time_ns)
        for layer, content in self._walls().items():
            if walls.get(layer) != content:
                observers.layer_changed(layer.name)
        self._notify(ports, snapshot._ports, revived, revived_plugins)
        for model, appearance in appearances:
            if appearance_of(model) != appearance:
                observers.model_changed(model)
        if error is not None:
            raise error

    def _walls(self) -> dict[Layer, tuple[Body, int]]:
        """Returns the body of each layer and its number of edges, which change with its walls."""
        return {layer: (layer.body, layer.added_edges) for layer in self._layers.all}

    def _notify(
        self,
        before: _Ports,
        now: _Ports,
        revived: list[Model],
        revived_plugins: list[FlatlandPlugin],
    ) -> None:
        """Notifies the observers of ports and models that were restored or removed."""
        observers = self._observers
        if before.outputs != now.outputs or before.commands != now.commands:
            for output in _without(before.outputs, now.outputs):
                output.closed = True
                observers.output_closed(output)
            for command in _without(before.commands, now.commands):
                command.closed = True
                observers.command_closed(command)
            for output in _without(now.outputs, before.outputs):
                observers.output_opened(output)
            for command in _without(now.commands, before.commands):
                observers.command_opened(command)
        for plugin in revived_plugins:
            plugin.ros = observers.plugin_ros(plugin)
        if revived_plugins:
            now.resume(revived_plugins, observers)
        for model in revived:
            observers.model_added(model)

    def restore_or_log(self, before: WorldSnapshot | None) -> None:
        """Restores the state before a reset that failed, if it can be restored.

        Args:
            before: A snapshot, None if it could not be taken.
        """
        try:
            if before is not None:
                self._restore(before, self._revived_plugins(before))
                return
        except WorldError as error:
            _LOG.error("%s", error)
        _LOG.error("the reset failed, and the world is empty: a plugin cannot be restored")

    # -- clones ----------------------------------------------------------------------------

    def copy_to(self, clone: Snapshots) -> None:
        """Copies the state of this world to an empty one.

        Args:
            clone: The snapshots of the other world, which has the same parts.

        Raises:
            WorldError: A plugin has an attribute that cannot be copied.
        """
        self._settle()
        copier = Copier(self._kinds)
        physics, copy = self._physics, clone._physics
        copy.become_copy_of(physics)
        parts = (physics, *self._saved)
        for part, other in zip(parts, (copy, *clone._saved), strict=True):
            copier.fill(part, copier.add(part, other))
        for part, other in zip(self._others, clone._others, strict=True):
            copier.add(part, other)
        try:
            copier.finish()
        except UncopyableError as error:
            raise self._located(error) from None
        for output in self._ports.outputs.values():
            _copy_subscriptions(output, copier)
        for pair in self._observers.of_plugins:
            made = _copied(pair, copier, f"the observer {type(pair[0]).__name__}")
            clone._observers.add_of_plugin(*made)
        clone._host.jobs.change()

    # -- errors ----------------------------------------------------------------------------

    def _located(self, error: UncopyableError) -> WorldError:
        """Returns the error for an object that cannot be copied, with the plugin that has it."""
        for plugin in self._plugins:
            name = self._find_outside(plugin)
            if name:
                what = f'{describe(plugin)}: attribute "{name}"'
                return WorldError(f"{what} holds {error}, which cannot be copied; {_ADVICE}")
        return WorldError(f"the world holds {error}, which cannot be copied; {_ADVICE}")

    def _check_revivable(self, plugin: FlatlandPlugin) -> None:
        """Checks that a deleted plugin was not connected to anything outside the world.

        Raises:
            WorldError: The plugin was connected, and does not define how it is copied.
        """
        if _defines_state(plugin):
            return
        name = self._find_outside(plugin)
        if name:
            raise _ended(plugin, name)

    @property
    def _plugins(self) -> list[FlatlandPlugin]:
        of_models = [p for model in self._models.by_name.values() for p in model.plugins]
        return [*of_models, *self._host.world_plugins]

    def _find_outside(self, plugin: FlatlandPlugin) -> str:
        """Returns the attribute of a plugin that cannot be copied, empty for none."""
        attributes = plugin.__getstate__()
        if not isinstance(attributes, dict):
            return ""
        models = self._models.by_name.values()
        others = [*self._saved, *self._not_saved, *models, *self._plugins, plugin]
        # As in `flatland.copying.kinds`, a class adds to what its base classes name.
        known = {n for base in type(plugin).__mro__ for n in vars(base).get("outside_state", ())}
        name: str
        for name, value in attributes.items():
            try:
                saved = SavedObjects([value], self._kinds, others)
            except UncopyableError:
                return name
            if saved.outside and name not in known:
                return name
        return ""


def _defines_state(plugin: FlatlandPlugin) -> bool:
    """Returns whether the class of a plugin defines how the plugin is copied."""
    return type(plugin).__getstate__ is not vars(object)["__getstate__"]


def _ended(plugin: FlatlandPlugin, attribute: str) -> WorldError:
    """Returns the error for a plugin whose connection ended with the plugin."""
    event = "model was deleted" if isinstance(plugin, ModelPlugin) else "world was reset"
    return WorldError(
        f'{describe(plugin)}: attribute "{attribute}" holds a connection that ended when the '
        f"{event}; {_ADVICE}"
    )


def _copy_subscriptions(output: Output[Any], copier: Copier) -> None:
    """Copies the subscriptions of plugins, and which outputs they want.

    Raises:
        WorldError: A subscription cannot be copied.
    """
    copy = copier.find(output)
    copy._wanters = frozenset({copier.find(who) for who in output._wanters} - {None})
    if output._inner_wanters:
        what = f'what wants the output "{output.topic}"'
        copy._inner_wanters = frozenset(_copied(tuple(output._inner_wanters), copier, what))
        copy._wanters |= copy._inner_wanters
    for token, callback in output._subscribers:
        if token.owner is None and copier.find(getattr(callback, "__self__", None)) is None:
            continue
        what = f'the subscription {callback_name(callback)} of output "{output.topic}"'
        if isinstance(token.owner, FlatlandPlugin):
            what = f"{describe(token.owner)}: {what}"
        copied, function = _copied((token, callback), copier, what)
        copy.resume(copied, function, wants=token in output._wanters)


def _copied(original: T, copier: Copier, what: str) -> T:
    """Returns the complete copy of what a plugin has connected to its world.

    Raises:
        WorldError: It cannot be copied; the text begins with its description.
    """
    try:
        made: T = copier(original)
        copier.finish()
    except UncopyableError as error:
        raise WorldError(f"{what} holds {error}, which cannot be copied; {_ADVICE}") from None
    return made


def _without(ports: list[Any], others: list[Any]) -> list[Any]:
    known = set(map(id, others))
    return [port for port in ports if id(port) not in known]
