"""Reads a model file and makes its bodies, footprints and joints."""

from __future__ import annotations

import logging
import math
from typing import Any

from flatland.config.reader import YamlReader
from flatland.entities.body import Body
from flatland.entities.collision_filter import CollisionFilter
from flatland.entities.joint import Joint
from flatland.entities.model import Model
from flatland.errors import PhysicsError
from flatland.geometry import Pose, compose
from flatland.physics import PhysicsWorld

_LOG = logging.getLogger("flatland")

BODY_TYPES = ("static", "kinematic", "dynamic")
BODY_COLOR = (1.0, 1.0, 1.0, 0.5)


class ModelLoader:
    """Fills one model from its file.

    Whoever calls it takes the model's bodies out of the physics world again when it raises.
    """

    def __init__(
        self, physics: PhysicsWorld, layers: CollisionFilter, model: Model, reader: YamlReader
    ) -> None:
        """Prepares to fill a model.

        Args:
            physics: World to make bodies and joints in.
            layers: Names of the world's layers.
            model: The model, still empty.
            reader: Over the whole model file.
        """
        self._physics = physics
        self._layers = layers
        self._model = model
        self._place = f'model "{model.name}"'
        self._reader = reader.with_location(self._place)

    def load_bodies_and_joints(self, pose: Pose) -> None:
        """Makes all bodies and joints.

        Args:
            pose: Of the model in the world frame.

        Raises:
            YamlError: Anything in the file is wrong.
        """
        bodies = self._reader.subnode("bodies", "list")
        for entry in bodies.items():
            self._load_body(entry, pose)
        if not self._model.bodies:
            raise bodies.error(
                f'Invalid "bodies" in "{self._model.name}" model, must be a list of bodies of at '
                "least size 1"
            )
        for entry in self._reader.optional_subnode("joints", "list").items():
            self._load_joint(entry)

    def plugin_entries(self) -> list[YamlReader]:
        """Returns the entries of the enabled plugins, checked for names used twice.

        Raises:
            YamlError: Two plugins have one name, or the file has unknown keys.
        """
        entries = []
        names = set()
        for entry in self._reader.optional_subnode("plugins", "list").items():
            name = entry.get("name", "string")
            if not _is_enabled(entry, f'{self._place} plugin "{name}"'):
                continue
            if name in names:
                raise entry.error(
                    f'Invalid "plugins" in "{self._model.name}" model, plugin with name "{name}" '
                    "already exists"
                )
            names.add(name)
            entries.append(entry)
        self._reader.ensure_accessed_all()
        return entries

    def _load_body(self, entry: YamlReader, model_pose: Pose) -> None:
        name = entry.get("name", "string")
        reader = entry.with_location(self._place, f'body "{name}"')
        if not _is_enabled(reader, f'{self._place} body "{name}"'):
            return
        if self._model.find_body(name) is not None:
            raise reader.error(
                f'Invalid "bodies" in "{self._model.name}" model, body with name "{name}" '
                "already exists"
            )
        pose = _finite(reader, "pose", reader.get("pose", "pose", (0.0, 0.0, 0.0)))
        body_type = reader.get("type", "string", "dynamic")
        if body_type not in BODY_TYPES:
            raise reader.error(
                f'Invalid "type" in {self._place} body "{name}", must be one of: '
                f"{', '.join(BODY_TYPES)}"
            )
        color = _finite(reader, "color", reader.get("color", "color", BODY_COLOR))
        linear_damping = _not_negative(reader, "linear_damping", 0.0)
        angular_damping = _not_negative(reader, "angular_damping", 0.0)
        footprints = reader.subnode("footprints", "list")
        reader.ensure_accessed_all()
        physics_body = _made(
            reader,
            self._physics.create_body,
            body_type,
            compose(model_pose, pose),
            linear_damping=linear_damping,
            angular_damping=angular_damping,
        )
        body = Body(physics_body, self._model, name, color)
        self._model.bodies.append(body)
        for footprint in footprints.items():
            self._load_footprint(body, footprint)

    def _load_footprint(self, body: Body, reader: YamlReader) -> None:
        place = f"{reader.location} {reader.name}"
        kind = reader.get("type", "string")
        if kind not in ("circle", "polygon"):
            raise reader.error(
                f'Invalid footprint "type" in {place}, support footprints are: circle, polygon'
            )
        layers = reader.get_list("layers", "string", ["all"])
        unknown = self._layers.unknown(layers)
        if unknown:
            raise reader.error(
                f'Invalid footprint "layers" in {place}, {{{",".join(unknown)}}} layer(s) does '
                "not exist"
            )
        category_bits = self._layers.category_bits(layers)
        properties: dict[str, Any] = {
            "density": _not_negative(reader, "density"),
            "friction": _not_negative(reader, "friction", 0.0),
            "restitution": _not_negative(reader, "restitution", 0.0),
            "is_sensor": reader.get("sensor", "bool", False),
            "category_bits": category_bits,
            "mask_bits": category_bits if reader.get("collision", "bool", True) else 0,
        }
        if kind == "circle":
            radius = _not_negative(reader, "radius")
            center = _finite(reader, "center", reader.get("center", "vector", (0.0, 0.0)))
            reader.ensure_accessed_all()
            _made(reader, body.create_circle, center, radius, **properties)
        else:
            points = reader.get_list("points", "vector", min_size=3, max_size=8)
            for point in points:
                _finite(reader, "points", point)
            reader.ensure_accessed_all()
            _made(reader, body.create_polygon, points, **properties)

    def _load_joint(self, entry: YamlReader) -> None:
        name = entry.get("name", "string")
        reader = entry.with_location(self._place, f'joint "{name}"')
        place = f'{self._place} joint "{name}"'
        if not _is_enabled(reader, place):
            return
        if self._model.find_joint(name) is not None:
            raise reader.error(
                f'Invalid "joints" in "{self._model.name}" model, joint with name "{name}" '
                "already exists"
            )
        kind = reader.get("type", "string")
        if kind not in ("revolute", "weld"):
            raise reader.error(
                f'Invalid joint "type" in {place}, supported joints are: revolute, weld'
            )
        color = _finite(reader, "color", reader.get("color", "color", BODY_COLOR))
        collide_connected = reader.get("collide_connected", "bool", False)
        ends = reader.subnode("bodies", "list")
        if len(ends) != 2:
            raise ends.error(
                f'Invalid "bodies" in {place}, must be a sequence of exactly two items'
            )
        bodies, anchors = [], []
        for end in ends.items():
            body_name = end.get("name", "string")
            body = self._model.find_body(body_name)
            if body is None:
                raise end.error(
                    f'Cannot find body with name "{body_name}" in {end.location} {end.name}'
                )
            bodies.append(body)
            anchor = end.get_list("anchor", "float", size=2)
            anchors.append(_finite(end, "anchor", anchor))
        options: dict[str, Any] = {"collide_connected": collide_connected}
        make: Any
        if kind == "revolute":
            make = self._physics.create_revolute_joint
            options["limits"] = _read_limits(reader)
        else:
            make = self._physics.create_weld_joint
            angle = reader.get("angle", "float", 0.0)
            options["reference_angle"] = _finite(reader, "angle", (angle,))[0]
            options["frequency"] = _not_negative(reader, "frequency", 0.0)
            options["damping"] = _not_negative(reader, "damping", 0.0)
        reader.ensure_accessed_all()
        joint = _made(reader, make, bodies[0], bodies[1], anchors[0], anchors[1], **options)
        self._model.joints.append(Joint(joint, name, (bodies[0], bodies[1]), color))


def _read_limits(reader: YamlReader) -> tuple[float, float] | None:
    limits = reader.get_list("limits", "float", [], size=2) if "limits" in reader else []
    if not limits:
        return None
    lower, upper = _finite(reader, "limits", limits)
    if lower > upper:
        raise reader.error(
            f'Invalid "limits" in {reader.location} {reader.name}, the lower limit {lower} must '
            f"not be above the upper limit {upper}"
        )
    return (lower, upper)


def _is_enabled(reader: YamlReader, place: str) -> bool:
    enabled: bool = reader.get("enabled", "bool", True)
    if not enabled:
        _LOG.info("%s is disabled", place)
    return enabled


def _finite(reader: YamlReader, key: str, numbers: Any) -> Any:
    """Returns the numbers if all are finite.

    Raises:
        YamlError: One is NaN or infinite.
    """
    if not all(math.isfinite(number) for number in numbers):
        raise reader.error(
            f'Invalid "{key}" in {reader.location} {reader.name}, must be finite, '
            f"got {', '.join(map(str, numbers))}"
        )
    return numbers


def _not_negative(reader: YamlReader, key: str, default: float | None = None) -> float:
    """Reads a finite number of at least 0.

    Raises:
        YamlError: It is missing and has no default, is no number, negative, NaN or infinite.
    """
    value: float = (
        reader.get(key, "float") if default is None else reader.get(key, "float", default)
    )
    if not (math.isfinite(value) and value >= 0):
        raise reader.error(
            f'Invalid "{key}" in {reader.location} {reader.name}, must be finite and not '
            f"negative, got {value}"
        )
    return value


def _made(reader: YamlReader, make: Any, *arguments: Any, **options: Any) -> Any:
    """Makes a physics object; what the physics engine refuses becomes an error of the file.

    Raises:
        YamlError: The physics engine refused.
    """
    try:
        return make(*arguments, **options)
    except (ValueError, PhysicsError) as error:
        raise reader.error(f"Invalid entry in {reader.location} {reader.name}, {error}") from error
