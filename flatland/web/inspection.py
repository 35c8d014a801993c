"""Details of the model that a client inspects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from flatland.entities.layer import Layer
from flatland.errors import WorldError
from flatland.plugin_api.plugin import describe
from flatland.plugin_api.ports import Output
from flatland.timekeeper import NANOSECONDS
from flatland.web.model_tracker import Json, TrackedModel
from flatland.web.numbers import as_json
from flatland.world import World

_MAX_CONTACTS: Final = 50


@dataclass(frozen=True, slots=True, eq=False)
class Details:
    """A copy of the details of a model, from which `details_message` makes a message.

    Attributes:
        model: Id of the model.
        path: File of the model.
        physics: Fields of the message that need no conversion.
        plugins: Name and type of each plugin.
        topics: For each topic: name, type, latest value, and `output` or `command`.
    """

    model: int
    path: str
    physics: Json
    plugins: list[tuple[str, str]]
    topics: list[tuple[str, str, object, str]]


def outputs_of(world: World, tracked: TrackedModel) -> list[Output[Any]]:
    """Returns the outputs of a model; must be called between two steps."""
    owners = {describe(plugin) for plugin in tracked.model.plugins}
    return [o for o in world.ports.outputs.values() if not owners.isdisjoint(o.owners)]


def copy_details(world: World, tracked: TrackedModel) -> Details:
    """Copies the details of a model; must be called between two steps."""
    model = tracked.model
    first = model.bodies[0]
    bodies = [
        {
            "name": body.name,
            "type": body.type,
            "pose": list(body.pose),
            "velocity": list(body.velocity),
            "mass": body.mass,
        }
        for body in model.bodies
    ]
    topics = [
        (output.topic, output.value_type.__name__, output.latest, "output")
        for output in outputs_of(world, tracked)
    ]
    topics += [
        (command.topic, command.value_type.__name__, command.value, "command")
        for plugin in model.plugins
        for command in world.ports.commands_of(describe(plugin))
    ]
    return Details(
        model=tracked.id,
        path=model.path,
        physics={
            "pose": list(first.pose),
            "velocity": list(first.velocity),
            "mass": sum(body["mass"] for body in bodies),
            "inertia": first.inertia,
            "contacts": _contacts(world, tracked),
            "bodies": bodies,
        },
        plugins=[(plugin.name, plugin.type) for plugin in model.plugins],
        topics=topics,
    )


def _contacts(world: World, tracked: TrackedModel) -> list[str]:
    """Returns the names of the models and layers that a model touches."""
    own = {body.id for body in tracked.model.bodies}
    found: dict[str, None] = {}
    for contact in world.physics.contacts():
        others = [number for number in (contact.body_a, contact.body_b) if number not in own]
        if len(others) != 1:
            continue
        try:
            entity = world.body_of_id(others[0]).entity
        except WorldError:  # A plugin created the body in the physics world.
            continue
        found[f"layer {entity.name}" if isinstance(entity, Layer) else entity.name] = None
    return list(found)[:_MAX_CONTACTS]


def details_message(world: int, details: Details, parameters: Json) -> Json:
    """Returns the message `details`.

    Args:
        world: Index of the world.
        details: Details of the model.
        parameters: Parameters of the plugins by the name of the plugin.
    """
    return {
        "type": "details",
        "world": world,
        "model": details.model,
        **details.physics,
        "plugins": [
            {"name": name, "type": kind, "parameters": as_json(parameters.get(name, {}))}
            for name, kind in details.plugins
        ],
        "topics": [
            {
                "topic": topic,
                "type": kind,
                "time": _stamp(value),
                "value": as_json(value),
                "kind": port,
            }
            for topic, kind, value, port in details.topics
        ],
    }


def _stamp(value: object) -> float | None:
    stamp = getattr(value, "stamp", None)
    return stamp / NANOSECONDS if isinstance(stamp, int) else None
