"""Snapshots and clones of a world."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from flatland.copying.copier import Copier
from flatland.copying.kind import UncopyableError
from flatland.copying.record import Recorder
from flatland.entities.collision_filter import CollisionFilter
from flatland.errors import WorldError
from flatland.loading.world_loader import reload_world
from flatland.plugin_api.plugin import FlatlandPlugin, describe
from flatland.runtime.observer import Observers
from flatland.runtime.requests import Requests
from flatland.timekeeper import NANOSECONDS

if TYPE_CHECKING:
    from flatland.copying.kind import Kind
    from flatland.copying.record import StateRecord
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.world import World

_LOG = logging.getLogger("flatland")

OUTSIDE: Final = frozenset(
    [
        "requests",
        "params",
        "read_yaml",
        "path",
        "model_path",
        "plugin_errors",
        "on_invalid_body",
        "_observers",
        "_change_log",
        "_paused",
        "_closed",
        "_states",
    ]
)
"""Attributes of a world that are not part of its state."""


class WorldSnapshot:
    """The state of a world at one time, made by `World.snapshot`.

    Attributes:
        time_ns: Simulated time [ns].
    """

    __slots__ = ("_models", "_owner", "_physics", "_ports", "_record", "time_ns")

    def __init__(self, owner: WorldStates, physics: PhysicsWorld, record: StateRecord) -> None:
        """Creates a snapshot.

        Args:
            owner: Of the world.
            physics: A copy of the physics world, which nothing else uses.
            record: What all objects of the world contain.
        """
        world = owner.world
        self.time_ns = world.timekeeper.sim_time_ns
        self._owner = owner
        self._physics = physics
        self._record = record
        self._models = world._models.by_name.copy()
        self._ports = _Ports(world)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.time_ns / NANOSECONDS

    def __repr__(self) -> str:
        return f"<WorldSnapshot at {self.time:.3f} s, models: {len(self._models)}>"


class _Ports:
    """The open ports of a world."""

    def __init__(self, world: World) -> None:
        outputs, commands = world.ports.kept
        self.outputs = [*world.ports.outputs.values(), *outputs]
        self.commands = [c for same in world.ports.commands.values() for c in same] + commands


class WorldStates:
    """Takes and restores snapshots of one world, and clones it.

    Attributes:
        world: The world.
    """

    def __init__(self, world: World, attributes: Iterable[str]) -> None:
        """Prepares snapshots of a world.

        Args:
            world: The world.
            attributes: Names of the attributes that it has had from the start; others were added by
                users.
        """
        self.world = world
        self._attributes = tuple(name for name in attributes if name not in OUTSIDE)
        self._kinds: dict[type[Any], Kind] = {}

    # -- snapshots -------------------------------------------------------------------------

    def take(self) -> WorldSnapshot:
        """Takes a snapshot; see `World.snapshot`."""
        world = self.world
        recorder = Recorder(self._kinds, self._excluded())
        attributes = {name: getattr(world, name) for name in self._attributes}
        recorder.add(_set_attributes, world, attributes)
        try:
            record = recorder.record(attributes.values())
        except UncopyableError as error:
            raise self._located(error) from None
        return WorldSnapshot(self, world.physics.copy(), record)

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Restores a snapshot; see `World.restore`."""
        world = self.world
        if snapshot._owner is not self:
            raise WorldError("the snapshot is one of another world")
        models = list(world._models.by_name.values())
        kept = {model for model in snapshot._models.values() if model in models}
        revived = [model for model in snapshot._models.values() if model not in kept]
        for model in revived:
            for plugin in model.plugins:
                self._check_revivable(plugin)
        for model in reversed(models):
            if model not in kept:
                world._models.delete(model.name)
        ports, time_ns = _Ports(world), world.timekeeper.sim_time_ns
        world.physics.become_copy_of(snapshot._physics)
        snapshot._record.write_back()
        if world.timekeeper.sim_time_ns != time_ns:
            world._observers.time_advanced(world.timekeeper.sim_time_ns)
        self._notify(ports, snapshot, revived)

    def _notify(self, before: _Ports, snapshot: WorldSnapshot, revived: list[Model]) -> None:
        """Notifies the observers of what is there again, and of what is gone."""
        observers, now = self.world._observers, snapshot._ports
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
        for model in revived:
            for plugin in model.plugins:
                plugin.ros = observers.plugin_ros(plugin)
            observers.model_added(model)

    # -- reset -----------------------------------------------------------------------------

    def reset(self, seed: int | None, keep_time: bool) -> None:
        """Loads the world again; see `World.reset`."""
        world = self.world
        if not world.path:
            raise WorldError("only a world that was loaded from a file can be reset")
        try:
            before = self.take()
        except WorldError:
            before = None  # A plugin cannot be copied.
        with world.ports.keeping():
            self._empty()
            if not keep_time:
                world.timekeeper.sim_time_ns = 0
                world._observers.time_advanced(0)
            try:
                reload_world(world, world.seed if seed is None else seed)
                world.physics.find_new_contacts()
            except BaseException:
                self._empty()
                self._roll_back(before)
                raise
            finally:
                world._former_layers.clear()

    def _roll_back(self, before: WorldSnapshot | None) -> None:
        """Restores the state before a reset that failed, if it can be restored."""
        try:
            if before is not None:
                self.restore(before)
                return
        except WorldError as error:
            _LOG.error("%s", error)
        _LOG.error("the reset failed, and the world is empty: a plugin cannot be restored")

    def _empty(self) -> None:
        """Removes all contents of the world."""
        world = self.world
        world.plugin_host.shut_down(list(world.plugin_host.world_plugins))
        for model in reversed(world.models):
            world._models.delete(model.name)
        world._former_layers.update({layer.name: layer for layer in world.layers})
        world.layers.clear()
        world.collision_filter = CollisionFilter()
        world._contacts.clear()
        world._placement.forget_random_state()
        world.physics.clear()

    # -- clones ----------------------------------------------------------------------------

    def clone(self) -> World:
        """Returns an independent copy; see `World.clone`."""
        world = self.world
        copier = Copier(self._kinds)
        clone: World = copier.add(world, object.__new__(type(world)))
        copier.add(world.physics._core, world.physics._core.copy())
        clone.requests = copier.add(world.requests, Requests())
        copier.add(world.plugin_host.registry, world.plugin_host.registry)
        clone._observers = copier.add(world._observers, Observers(copier.copy(world._faults)))
        costs = world.plugin_host.costs
        if costs is not None:
            copier.add(costs, costs)
        try:
            for name, value in vars(world).items():
                if name in self._attributes:
                    setattr(clone, name, copier.copy(value))
                elif not hasattr(clone, name) or name not in vars(clone):
                    setattr(clone, name, value)
            copier.finish()
            self._copy_subscriptions(copier)
            copier.finish()
        except UncopyableError as error:
            raise self._located(error) from None
        clone.stepping.change_log = None
        clone.requests.on_post = clone.physics.plan.interrupt
        clone._paused = clone._closed = False
        clone._states = WorldStates(clone, self._attributes)
        if costs is not None:
            clone.plugin_host.measure(None)
        clone.add_observer(clone._body_monitor)
        return clone

    def _copy_subscriptions(self, copier: Copier) -> None:
        """Copies the subscriptions that plugins have made, and what they want."""
        for output in self.world.ports.outputs.values():
            copy = copier.find(output)
            subscribers = []
            wanters = {copier.find(who) for who in output._wanters} - {None}
            for token, callback in output._subscribers:
                owner = getattr(callback, "__self__", None)
                if owner is not None and copier.find(owner) is not None:
                    subscribers.append((token, copier.copy(callback)))
                    if token in output._wanters:
                        wanters.add(token)
            copy._subscribers, copy._wanters = tuple(subscribers), frozenset(wanters)

    # -- errors ----------------------------------------------------------------------------

    def _excluded(self) -> list[object]:
        world = self.world
        host = world.plugin_host
        costs = host.costs
        return [
            self,
            world,
            world.requests,
            world._observers,
            host.registry,
            *(() if costs is None else (costs, *vars(costs).values())),
        ]

    def _plugins(self) -> list[FlatlandPlugin]:
        world = self.world
        return [
            *(plugin for model in world.models for plugin in model.plugins),
            *world.plugin_host.world_plugins,
        ]

    def _located(self, error: UncopyableError) -> WorldError:
        """Returns the error for an object that cannot be copied, with the plugin that has it."""
        advice = (
            "which cannot be copied; the class can define __getstate__ and __setstate__, see "
            '"Snapshots" in docs/write_a_plugin.md'
        )
        for plugin in self._plugins():
            name = self._find_outside(plugin)
            if name:
                return WorldError(f'{describe(plugin)}: attribute "{name}" holds {error}, {advice}')
        return WorldError(f"the world holds {error}, {advice}")

    def _find_outside(self, plugin: FlatlandPlugin) -> str:
        """Returns the attribute of a plugin that cannot be copied, empty for none."""
        attributes = plugin.__getstate__()
        if not isinstance(attributes, dict):
            return ""
        others = [*self._excluded(), *self.world.models, *self._plugins(), plugin]
        name: str
        for name, value in attributes.items():
            recorder = Recorder(self._kinds, others)
            try:
                recorder.record([value])
            except UncopyableError:
                return name
            if name not in type(plugin).outside_state and recorder.outside:
                return name
        return ""

    def _check_revivable(self, plugin: FlatlandPlugin) -> None:
        """Raises if a deleted plugin was connected to something outside the world."""
        if type(plugin).__getstate__ is not object.__getstate__:
            return
        name = self._find_outside(plugin)
        if name:
            raise WorldError(
                f'{describe(plugin)}: attribute "{name}" holds a connection that ended when the '
                "model was deleted; the class can define __getstate__ and __setstate__, see "
                '"Snapshots" in docs/write_a_plugin.md'
            )


def _set_attributes(world: World, attributes: dict[str, Any]) -> None:
    for name, value in attributes.items():
        if vars(world).get(name) is not value:
            setattr(world, name, value)


def _without(ports: list[Any], others: list[Any]) -> list[Any]:
    known = set(map(id, others))
    return [port for port in ports if id(port) not in known]
