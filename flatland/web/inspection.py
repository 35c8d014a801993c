"""Details of the model that a client inspects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from flatland.entities.layer import Layer
from flatland.errors import WorldError
from flatland.geometry import Pose
from flatland.plugin_api.plugin import describe
from flatland.plugin_api.ports import Output
from flatland.timekeeper import NANOSECONDS
from flatland.web.numbers import as_json
from flatland.web.scene import Description, TrackedModel
from flatland.world import World

_MAX_CONTACTS: Final = 50


@dataclass(frozen=True, slots=True)
class Part:
    """The state of a body.

    Attributes:
        name: Its name.
        type: Its type.
        pose: Pose in the world frame [m, rad].
        velocity: Velocity of its origin in the world frame [m/s, rad/s].
        mass: Mass [kg].
        inertia: Moment of inertia about its origin [kg m²].
    """

    name: str
    type: str
    pose: Pose
    velocity: Pose
    mass: float
    inertia: float


@dataclass(frozen=True, slots=True, eq=False)
class Details:
    """A copy of the state of a model; values of topics are not converted yet.

    Attributes:
        model: Id of the model.
        path: Its file.
        parts: Its bodies.
        contacts: Names of what it touches.
        plugins: Name and type of each plugin.
        topics: Topic, type, latest value, and whether it is an output or a command.
    """

    model: int
    path: str
    parts: list[Part]
    contacts: list[str]
    plugins: list[tuple[str, str]]
    topics: list[tuple[str, str, object, str]]


def outputs_of(world: World, known: TrackedModel) -> list[Output[Any]]:
    """Returns the outputs of a model; to be called between two steps."""
    owners = {describe(plugin) for plugin in known.model.plugins}
    return [o for o in world.ports.outputs.values() if not owners.isdisjoint(o.owners)]


def copy_details(world: World, known: TrackedModel) -> Details:
    """Copies the state of a model; to be called between two steps."""
    model = known.model
    topics = [
        (output.topic, output.value_type.__name__, output.latest, "output")
        for output in outputs_of(world, known)
    ]
    topics += [
        (command.topic, command.value_type.__name__, command.value, "command")
        for plugin in model.plugins
        for command in world.ports.commands_of(describe(plugin))
    ]
    return Details(
        model=known.id,
        path=model.path,
        parts=[
            Part(body.name, body.type, body.pose, body.velocity, body.mass, body.inertia)
            for body in model.bodies
        ],
        contacts=_contacts(world, known),
        plugins=[(plugin.name, plugin.type) for plugin in model.plugins],
        topics=topics,
    )


def _contacts(world: World, known: TrackedModel) -> list[str]:
    own = {body.id for body in known.model.bodies}
    found: dict[str, None] = {}
    for contact in world.physics.contacts():
        bodies = (contact.body_a, contact.body_b)
        others = [number for number in bodies if number not in own]
        if len(others) != 1:
            continue
        try:
            entity = world.body_of_id(others[0]).entity
        except WorldError:  # A plugin created the body in the physics world.
            continue
        found[f"layer {entity.name}" if isinstance(entity, Layer) else entity.name] = None
    return list(found)[:_MAX_CONTACTS]


def details_message(world: int, details: Details, parameters: Description) -> Description:
    """Returns the message of the details of a model.

    Args:
        world: Index of the world.
        details: The details.
        parameters: Parameters of the plugins by name.
    """
    first = details.parts[0]
    return {
        "type": "details",
        "world": world,
        "model": details.model,
        "pose": list(first.pose),
        "velocity": list(first.velocity),
        "mass": sum(part.mass for part in details.parts),
        "inertia": first.inertia,
        "contacts": details.contacts,
        "bodies": [
            {
                "name": part.name,
                "type": part.type,
                "pose": list(part.pose),
                "velocity": list(part.velocity),
                "mass": part.mass,
            }
            for part in details.parts
        ],
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
