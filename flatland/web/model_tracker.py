"""Detects new, changed and removed models, and describes them for clients of the viewer."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from flatland.entities.body import Body
from flatland.entities.collision_filter import CollisionFilter
from flatland.entities.model import Model
from flatland.plugin_api.plugin import describe
from flatland.plugin_api.ports import Output
from flatland.scene.description import (
    BodyDescription,
    ModelDescription,
    ShapeDescription,
    appearance_key,
    describe_model,
)
from flatland.scene.scans import RangingSensor, find_sensor
from flatland.values import Twist
from flatland.world import World

_TIME_LIMIT: Final = 1e-3  # s between two steps for descriptions; the next capture continues
_CHECK_PERIOD: Final = 0.5  # s between two searches for changed shapes and colours

Json = dict[str, Any]


@dataclass(slots=True, eq=False)
class TrackedModel:
    """A model that clients can see.

    Attributes:
        id: Id of the model.
        model: The model.
        bodies: Bodies of the model when it was described.
        body_ids: Ids of the bodies.
        sensors: Lasers and similar sensors of the model by id.
        key: `appearance_key` of the model when it was described.
        layer_bits: Layers of all fixtures when the model was described.
    """

    id: int
    model: Model
    bodies: list[Body]
    body_ids: list[int]
    sensors: dict[int, RangingSensor]
    key: object
    layer_bits: list[int]


@dataclass(slots=True, eq=False)
class ModelChanges:
    """What has changed since the previous call of `ModelTracker.update`.

    Attributes:
        described: Descriptions of new and changed models by id, as in the message `models`.
        removed: Ids of removed models.
        layout: Whether the list of bodies has changed.
        body_ids: Ids of all bodies if `layout` is true.
    """

    described: dict[int, Json] = field(default_factory=dict)
    removed: list[int] = field(default_factory=list)
    layout: bool = False
    body_ids: list[int] = field(default_factory=list)


class ModelTracker:
    """Assigns ids to the models of a world; must be used between two steps.

    Attributes:
        models: The models by id, in the order in which they were described.
        bodies: All bodies of these models.
        sensors: All lasers and similar sensors of these models by id.
    """

    def __init__(
        self, world: World, ids: Iterator[int], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        """Creates a tracker without models.

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
        self._checked_change = -1  # value of `World.change_count` at the last search
        self.models: dict[int, TrackedModel] = {}
        self.bodies: list[Body] = []
        self.sensors: dict[int, RangingSensor] = {}

    def update(self) -> ModelChanges:
        """Describes new and changed models for a limited time; the next call continues."""
        changes, now = ModelChanges(), self._clock()
        models = self._world.models
        if models != self._order:
            self._remove_missing(models, changes)
            pending = [model for model in models if model not in self._known]
            outputs = self._outputs_by_owner() if pending else {}
            for model in pending:
                self._add(model, next(self._ids), outputs, changes)
                if self._clock() - now > _TIME_LIMIT:
                    break
            if len(self._known) == len(models):
                self._order = models
        elif now >= self._check_due:
            self._check_due = now + _CHECK_PERIOD
            self._describe_changed(changes)
        if changes.described or changes.removed:
            tracked = self.models.values()
            self.bodies = [body for each in tracked for body in each.bodies]
            self.sensors = {n: sensor for each in tracked for n, sensor in each.sensors.items()}
            changes.layout = True
            changes.body_ids = [number for each in tracked for number in each.body_ids]
        return changes

    def _remove_missing(self, models: Iterable[Model], changes: ModelChanges) -> None:
        present = set(models)
        for model in [model for model in self._known if model not in present]:
            tracked = self._known.pop(model)
            del self.models[tracked.id]
            changes.removed.append(tracked.id)

    def _describe_changed(self, changes: ModelChanges) -> None:
        # Only requests change layers, and comparing the layers takes longer than the other search.
        may_have_changed = self._world.change_count != self._checked_change
        self._checked_change = self._world.change_count
        changed = [
            tracked
            for tracked in self.models.values()
            if appearance_key(tracked.model) != tracked.key
            or (may_have_changed and _layer_bits(tracked.model) != tracked.layer_bits)
        ]
        outputs = self._outputs_by_owner() if changed else {}
        for tracked in changed:
            self._add(tracked.model, tracked.id, outputs, changes)

    def _add(
        self,
        model: Model,
        number: int,
        outputs: dict[str, list[Output[Any]]],
        changes: ModelChanges,
    ) -> None:
        """Describes a new model, or a changed one, whose bodies and sensors keep their ids."""
        former = self.models.get(number)
        former_ids = dict(zip(former.bodies, former.body_ids, strict=True)) if former else {}
        former_sensors = {s.plugin: n for n, s in former.sensors.items()} if former else {}
        bodies = list(model.bodies)
        body_ids = [former_ids.get(body) or next(self._ids) for body in bodies]
        topics: list[Output[Any]] = []
        sensors = {}
        for plugin in model.plugins:
            own = outputs.get(describe(plugin), [])
            topics += own
            sensor = find_sensor(plugin, own)
            if sensor is not None and sensor.body in bodies:
                sensors[former_sensors.get(plugin) or next(self._ids)] = sensor
        key, description = appearance_key(model), describe_model(model)
        bits = [shape.category_bits for body in description.bodies for shape in body.shapes]
        tracked = TrackedModel(number, model, bodies, body_ids, sensors, key, bits)
        self._known[model] = self.models[number] = tracked
        changes.described[number] = self._model_json(tracked, description, topics)

    def _outputs_by_owner(self) -> dict[str, list[Output[Any]]]:
        found: dict[str, list[Output[Any]]] = {}
        for output in self._world.ports.outputs.values():
            for owner in output.owners:
                found.setdefault(owner, []).append(output)
        return found

    def _model_json(
        self, tracked: TrackedModel, description: ModelDescription, outputs: list[Output[Any]]
    ) -> Json:
        model, ids = tracked.model, tracked.body_ids
        layers, ports = self._world.collision_filter, self._world.ports
        commands = [c for plugin in model.plugins for c in ports.commands_of(describe(plugin))]
        return {
            "id": tracked.id,
            "name": model.name,
            "namespace": model.namespace,
            "file": model.path,
            "bodies": [
                _body_json(body, number, layers)
                for body, number in zip(description.bodies, ids, strict=True)
            ],
            "lasers": [
                _sensor_json(sensor, number, ids[tracked.bodies.index(sensor.body)])
                for number, sensor in tracked.sensors.items()
            ],
            "joints": [
                {
                    "name": joint.name,
                    "color": list(joint.color),
                    "bodies": [ids[index] for index in joint.bodies],
                    "anchors": [list(anchor) for anchor in joint.anchors],
                }
                for joint in description.joints
            ],
            "commands": [c.topic for c in commands if c.value_type is Twist],
            "outputs": [output.topic for output in outputs],
        }


def shape_json(shape: ShapeDescription, layers: list[str]) -> Json:
    """Returns a shape as in the message `models`.

    Args:
        shape: The shape.
        layers: Names of the layers of the shape.
    """
    common: Json = {"layers": layers, "sensor": shape.is_sensor}
    points = shape.points.tolist()
    if shape.kind == "circle":
        return {"kind": "circle", "center": points[0], "radius": shape.radius, **common}
    kind = "polygon" if shape.kind == "polygon" else "edges"
    return {"kind": kind, "points": points, **common}


def _body_json(body: BodyDescription, number: int, layers: CollisionFilter) -> Json:
    return {
        "id": number,
        "name": body.name,
        "color": list(body.color),
        "type": body.type,
        "shapes": [
            shape_json(shape, layers.names_of(shape.category_bits)) for shape in body.visible_shapes
        ],
    }


def _sensor_json(sensor: RangingSensor, number: int, body: int) -> Json:
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


def _layer_bits(model: Model) -> list[int]:
    return [fixture.category_bits for body in model.bodies for fixture in body.fixtures]
