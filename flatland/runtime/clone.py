"""Independent copies of a world."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from flatland.copying.copier import Copier
from flatland.copying.kind import UncopyableError
from flatland.runtime.observer import Observers
from flatland.runtime.requests import Requests
from flatland.runtime.uncopyable import located

if TYPE_CHECKING:
    from flatland.copying.kind import Kind
    from flatland.world import World


def clone_world(world: World, state: Collection[str], kinds: dict[type[Any], Kind]) -> World:
    """Returns an independent copy of a world; see `World.clone`.

    Args:
        world: The world.
        state: Names of the attributes that belong to its state; all others are shared.
        kinds: The kinds of classes found so far; it is extended.

    Raises:
        WorldError: A plugin has an attribute that cannot be copied.
    """
    copier = Copier(kinds)
    clone: World = copier.add(world, object.__new__(type(world)))
    copier.add(world.physics._core, world.physics._core.copy())
    try:
        faults = copier.copy(world._faults)
        own = {
            "requests": copier.add(world.requests, Requests()),
            "_observers": copier.add(world._observers, Observers(faults)),
            "_former_layers": {},
            "_paused": False,
            "_view": None,
        }
        costs = world.plugin_host.costs
        if costs is not None:
            copier.add(costs, costs)
        for name, value in vars(world).items():
            vars(clone)[name] = own.get(name, value) if name not in state else copier.copy(value)
        copier.finish()
        _copy_subscriptions(world, copier)
        copier.finish()
    except UncopyableError as error:
        raise located(world, kinds, error) from None
    clone.requests.on_post = clone.physics.plan.interrupt
    clone.plugin_host.schedule.change()
    if costs is not None:
        clone.plugin_host.measure(None)
    clone.add_observer(clone._body_monitor)
    return clone


def _copy_subscriptions(world: World, copier: Copier) -> None:
    """Copies the subscriptions of plugins, and which outputs they want."""
    for output in world.ports.outputs.values():
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
