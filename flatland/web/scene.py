"""Descriptions of the layers and models of a world, as clients of the viewer receive them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from flatland.entities.body import Body
from flatland.entities.model import Model
from flatland.geometry import FloatArray, Pose
from flatland.physics import PhysicsFixture
from flatland.plugin_api.plugin import describe
from flatland.plugin_api.ports import Output
from flatland.values import Twist
from flatland.web.ranging import RangingSensor, find_sensor
from flatland.world import World

_TIME_LIMIT: Final = 1e-3  # s between two steps for descriptions; the rest follows later
_CHECK_PERIOD: Final = 0.5  # s between two searches for changed shapes and colours

Description = dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class LayerContents:
    """A copy of a layer.

    Attributes:
        name: First name of the layer.
        color: (r, g, b, a), each in [0, 1].
        pose: Pose of the layer in the world frame.
        edges: (x1, y1, x2, y2) in the frame of the layer [m], shape (n, 4).
    """

    name: str
    color: tuple[float, ...]
    pose: Pose
    edges: FloatArray


@dataclass(slots=True, eq=False)
class TrackedModel:
    """A model that clients know.

    Attributes:
        id: Its id.
        model: The model.
        bodies: Its bodies, when it was described.
        body_ids: Ids of the bodies.
        lasers: Its lasers and similar sensors by id.
        key: Changes when the description is outdated, except for layers of footprints.
        layer_bits: Layers of all footprints, when it was described.
    """

    id: int
    model: Model
    bodies: list[Body]
    body_ids: list[int]
    lasers: dict[int, RangingSensor]
    key: object
    layer_bits: list[int]


@dataclass(slots=True, eq=False)
class SceneChange:
    """What has changed since the last call of `Scene.update`.

    Attributes:
        described: Descriptions of new and changed models by id.
        removed: Ids of removed models.
        layout: Whether the bodies are not those of the last call.
        body_ids: Ids of all bodies, shape (n,), if `layout` is true.
    """

    described: dict[int, Description] = field(default_factory=dict)
    removed: list[int] = field(default_factory=list)
    layout: bool = False
    body_ids: list[int] = field(default_factory=list)


class Scene:
    """The models of a world that clients know; to be used between two steps only.

    Attributes:
        models: The models by id, in the order in which they were described.
        bodies: All bodies of these models.
        lasers: All lasers and similar sensors of these models by id.
    """

    def __init__(
        self, world: World, ids: Iterator[int], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        """Creates an empty scene.

        Args:
            world: The world.
            ids: Returns ids that have not been used.
            clock: Returns the wall time [s].
        """
        self._world = world
        self._ids = ids
        self._clock = clock
        self._known: dict[Model, TrackedModel] = {}
        self._order: list[Model] = []
        self._check_due = 0.0
        self._checked_change = -1  # of `World.change_count`, at the last search
        self.models: dict[int, TrackedModel] = {}
        self.bodies: list[Body] = []
        self.lasers: dict[int, RangingSensor] = {}

    def update(self) -> SceneChange:
        """Describes new and changed models, for a limited time; the next call continues."""
        change, now = SceneChange(), self._clock()
        models = self._world.models
        if models != self._order:
            self._remove_missing(models, change)
            pending = [model for model in models if model not in self._known]
            outputs = self._outputs_by_owner() if pending else {}
            for model in pending:
                self._add(model, next(self._ids), outputs, change)
                if self._clock() - now > _TIME_LIMIT:
                    break
            if len(self._known) == len(models):
                self._order = models
        elif now >= self._check_due:
            self._check_due = now + _CHECK_PERIOD
            self._renew_changed(change)
        if change.described or change.removed:
            self.bodies = [body for known in self.models.values() for body in known.bodies]
            self.lasers = {}
            for known in self.models.values():
                self.lasers.update(known.lasers)
            change.layout = True
            change.body_ids = [n for known in self.models.values() for n in known.body_ids]
        return change

    def _remove_missing(self, models: Iterable[Model], change: SceneChange) -> None:
        present = set(models)
        for model in [model for model in self._known if model not in present]:
            known = self._known.pop(model)
            del self.models[known.id]
            change.removed.append(known.id)

    def _renew_changed(self, change: SceneChange) -> None:
        # Only requests change layers, and their search takes longer.
        may_have_changed = self._world.change_count != self._checked_change
        self._checked_change = self._world.change_count
        changed = [
            known
            for known in self.models.values()
            if _key(known.model) != known.key
            or (may_have_changed and _layer_bits(known.model) != known.layer_bits)
        ]
        outputs = self._outputs_by_owner() if changed else {}
        for known in changed:
            self._add(known.model, known.id, outputs, change)

    def _add(
        self,
        model: Model,
        number: int,
        outputs: dict[str, list[Output[Any]]],
        change: SceneChange,
    ) -> None:
        """Describes a model that is new or has changed."""
        former = self.models.get(number)
        body_ids = dict(zip(former.bodies, former.body_ids, strict=True)) if former else {}
        bodies = list(model.bodies)
        known = TrackedModel(number, model, bodies, [], {}, _key(model), _layer_bits(model))
        for body in bodies:
            known.body_ids.append(body_ids.get(body) or next(self._ids))
        former_lasers = {s.plugin: n for n, s in former.lasers.items()} if former else {}
        topics: list[Output[Any]] = []
        for plugin in model.plugins:
            own = outputs.get(describe(plugin), [])
            topics += own
            sensor = find_sensor(plugin, own)
            if sensor is not None and sensor.body in known.bodies:
                known.lasers[former_lasers.get(plugin) or next(self._ids)] = sensor
        self._known[model] = self.models[number] = known
        change.described[number] = self._describe(known, topics)

    def _outputs_by_owner(self) -> dict[str, list[Output[Any]]]:
        found: dict[str, list[Output[Any]]] = {}
        for output in self._world.ports.outputs.values():
            for owner in output.owners:
                found.setdefault(owner, []).append(output)
        return found

    def _describe(self, known: TrackedModel, outputs: list[Output[Any]]) -> Description:
        model, ports = known.model, self._world.ports
        commands = [c for plugin in model.plugins for c in ports.commands_of(describe(plugin))]
        ids = dict(zip(known.bodies, known.body_ids, strict=True))
        return {
            "id": known.id,
            "name": model.name,
            "namespace": model.namespace,
            "file": model.path,
            "bodies": [self._describe_body(body, ids[body]) for body in known.bodies],
            "lasers": [
                _describe_sensor(sensor, number, ids[sensor.body])
                for number, sensor in known.lasers.items()
            ],
            "joints": [
                {
                    "name": joint.name,
                    "color": list(joint.color),
                    "bodies": [ids[body] for body in joint.bodies],
                    "anchors": joint.anchors.tolist(),
                }
                for joint in model.joints
                if all(body.visible for body in joint.bodies)
            ],
            "commands": [c.topic for c in commands if c.value_type is Twist],
            "outputs": [output.topic for output in outputs],
        }

    def _describe_body(self, body: Body, number: int) -> Description:
        return {
            "id": number,
            "name": body.name,
            "color": list(body.color),
            "type": body.type,
            "shapes": [
                describe_shape(f, self._layer_names(f)) for f in body.fixtures if body.visible
            ],
        }

    def _layer_names(self, fixture: PhysicsFixture) -> list[str]:
        bits, collision_filter = fixture.category_bits, self._world.collision_filter
        return [n for n in collision_filter.names if bits >> collision_filter.layer_id(n) & 1]


def describe_shape(fixture: PhysicsFixture, layers: list[str]) -> Description:
    """Describes a fixture in the frame of its body.

    Args:
        fixture: The fixture.
        layers: Names of its layers.
    """
    common: Description = {"layers": layers, "sensor": fixture.is_sensor}
    if fixture.shape == "circle":
        center, radius = list(fixture.center), fixture.radius
        return {"kind": "circle", "center": center, "radius": radius, **common}
    points = np.asarray(fixture.vertices, np.float64).tolist()
    return {
        "kind": "polygon" if fixture.shape == "polygon" else "edges",
        "points": points,
        **common,
    }


def copy_layers(world: World) -> list[LayerContents]:
    """Copies the layers of a world; to be called between two steps."""
    return [
        LayerContents(layer.name, layer.color, layer.body.pose, layer.edges)
        for layer in world.layers
    ]


def _describe_sensor(sensor: RangingSensor, number: int, body: int) -> Description:
    return {
        "id": number,
        "name": sensor.plugin.name,
        "topic": sensor.output.topic,
        "body": body,
        "origin": list(sensor.origin),
        "angle_min": sensor.angle_min,
        "angle_increment": sensor.angle_increment,
        "count": sensor.count,
        "range_max": sensor.range_max,
    }


def _key(model: Model) -> object:
    """Returns what changes with the description of a model."""
    return (
        model.name,
        [(body.id, body.color, body.visible, body.fixture_ids) for body in model.bodies],
    )


def _layer_bits(model: Model) -> list[int]:
    return [fixture.category_bits for body in model.bodies for fixture in body.fixtures]
