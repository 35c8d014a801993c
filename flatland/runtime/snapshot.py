"""Snapshots and clones of a world."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from flatland.copying.kind import UncopyableError
from flatland.copying.record import Recorder
from flatland.entities.collision_filter import CollisionFilter
from flatland.errors import WorldError
from flatland.loading.world_loader import reload_world
from flatland.runtime.appearance import appearance_of
from flatland.runtime.clone import clone_world
from flatland.runtime.uncopyable import check_revivable, located, parts_outside
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
        "_view",
    ]
)
"""Attributes of a world that are not part of its state."""


class WorldSnapshot:
    """The state of a world at one time, returned by `World.snapshot`.

    Attributes:
        time_ns: Simulated time [ns].
        number: Number of the snapshot, from 0 on, in the order in which those of a world were
            taken.
    """

    __slots__ = ("_models", "_owner", "_physics", "_ports", "_record", "number", "time_ns")

    def __init__(self, owner: WorldStates, physics: PhysicsWorld, record: StateRecord) -> None:
        """Creates a snapshot.

        Args:
            owner: Takes the snapshots of the world.
            physics: A copy of the physics world, which nothing else uses.
            record: The contents of all objects of the world.
        """
        world = owner.world
        self.time_ns = world.timekeeper.sim_time_ns
        self.number = owner.taken
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
        taken: Number of snapshots that were taken.
    """

    def __init__(self, world: World, attributes: Iterable[str]) -> None:
        """Prepares snapshots of a world.

        Args:
            world: The world.
            attributes: Names of the attributes that flatland defines; others were added by users.
        """
        self.world = world
        self._attributes = tuple(name for name in attributes if name not in OUTSIDE)
        self.taken = 0
        self._kinds: dict[type[Any], Kind] = {}

    # -- snapshots -------------------------------------------------------------------------

    def take(self) -> WorldSnapshot:
        """Takes a snapshot; see `World.snapshot`."""
        world = self.world
        recorder = Recorder(self._kinds, parts_outside(world))
        attributes = {name: getattr(world, name) for name in self._attributes}
        recorder.add(_set_attributes, world, attributes)
        try:
            record = recorder.record(attributes.values())
        except UncopyableError as error:
            raise located(world, self._kinds, error) from None
        snapshot = WorldSnapshot(self, world.physics.copy(), record)
        self.taken += 1
        return snapshot

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Restores a snapshot; see `World.restore`."""
        world = self.world
        if snapshot._owner is not self:
            raise WorldError("the snapshot is one of another world")
        models, saved = world.models, snapshot._models
        kept = set(models) & set(saved.values())
        revived = [model for model in saved.values() if model not in kept]
        for model in revived:
            for plugin in model.plugins:
                check_revivable(world, self._kinds, plugin)
        for model in reversed(models):
            if model not in kept:
                world._models.delete(model.name)
        watched = kept if world._observers.watch_appearance else ()
        appearances = [(model, appearance_of(model)) for model in models if model in watched]
        ports, time_ns = _Ports(world), world.timekeeper.sim_time_ns
        world.physics.become_copy_of(snapshot._physics)
        error = snapshot._record.write_back()
        world.plugin_host.schedule.change()  # Other outputs may be wanted than at that time.
        if world.timekeeper.sim_time_ns != time_ns:
            world._observers.time_advanced(world.timekeeper.sim_time_ns)
        self._notify(ports, snapshot, revived)
        for model, appearance in appearances:
            if appearance_of(model) != appearance:
                world._observers.model_changed(model)
        if error is not None:
            raise error

    def _notify(self, before: _Ports, snapshot: WorldSnapshot, revived: list[Model]) -> None:
        """Notifies the observers of ports and models that were restored or removed."""
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
        clone = clone_world(self.world, self._attributes, self._kinds)
        clone._states = WorldStates(clone, self._attributes)
        return clone


def _set_attributes(world: World, attributes: dict[str, Any]) -> None:
    for name, value in attributes.items():
        if vars(world).get(name) is not value:
            setattr(world, name, value)


def _without(ports: list[Any], others: list[Any]) -> list[Any]:
    known = set(map(id, others))
    return [port for port in ports if id(port) not in known]
