"""Creation of the bodies, footprints and joints of a model from its file."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from flatland.config.collecting_reader import FollowUpError
from flatland.config.hints import choice, did_you_mean
from flatland.config.reader import YamlReader
from flatland.entities.body import Body
from flatland.entities.collision_filter import CollisionFilter
from flatland.entities.joint import Joint
from flatland.entities.model import Model
from flatland.errors import PhysicsError
from flatland.geometry import IDENTITY, Pose, compose
from flatland.loading.footprints import hull_problem
from flatland.loading.materials import read_class, read_color, read_material
from flatland.physics import PhysicsJoint, PhysicsWorld

_LOG = logging.getLogger("flatland")

BODY_TYPES = ("static", "kinematic", "dynamic")
FOOTPRINT_TYPES = ("circle", "polygon")
JOINT_TYPES = ("revolute", "weld")
BODY_COLOR = (1.0, 1.0, 1.0, 0.5)
MAX_FOOTPRINTS = 10_000
"""Largest number of footprints of a model."""
MAX_MOVING_FOOTPRINTS = 1_000
"""Largest number of footprints of the bodies of a model that are not static.

Each of them may touch each other one, which is half a million contacts."""
_MAX_LAYER_NAMES = 100  # of a footprint, which may be repeated

T = TypeVar("T")


class ModelLoader:
    """Adds the bodies and joints of a model file to a model.

    If a method raises an error, the caller removes the bodies created so far from the physics
    world.
    """

    def __init__(
        self, physics: PhysicsWorld, layers: CollisionFilter, model: Model, reader: YamlReader
    ) -> None:
        """Initializes a loader.

        Args:
            physics: World to create bodies and joints in.
            layers: Layer names of the world.
            model: The model, without bodies and joints.
            reader: Reader of the root of the model file.
        """
        self._physics = physics
        self._layers = layers
        self._model = model
        self._place = f'model "{model.name}"'
        self._reader = reader.with_location(self._place)
        # Number of footprints, and of those of bodies that are not static.
        self._counts = [0, 0]

    def load_bodies_and_joints(self, pose: Pose) -> None:
        """Creates all bodies and joints.

        Args:
            pose: Pose of the model in the world frame [m, m, rad].

        Raises:
            YamlError: The file is invalid.
        """
        self._model.class_name = read_class(self._reader, self._model.class_name)
        bodies = self._reader.subnode("bodies", "list")
        invalid = len(bodies)
        for entry in bodies.items():
            with entry.collect_errors():
                self._load_body(entry, pose)
                invalid -= 1
        if not self._model.bodies:
            text = (
                f'Invalid "bodies" in "{self._model.name}" model, must be a list of bodies of at '
                "least size 1"
            )
            raise FollowUpError(text) if invalid else bodies.error(text)
        for entry in self._reader.optional_subnode("joints", "list").items():
            with entry.collect_errors():
                self._load_joint(entry)

    def plugin_entries(self) -> list[YamlReader]:
        """Returns the entries of the enabled plugins.

        Raises:
            YamlError: Two plugins have the same name, or the file has unknown keys.
        """
        entries = []
        names = set()
        for entry in self._reader.optional_subnode("plugins", "list").items():
            name = entry.get("name", "string")
            if not _is_enabled(entry, f'{self._place} plugin "{name}"'):
                continue
            self._check_new(entry, "plugins", "plugin", name, name if name in names else None)
            names.add(name)
            entries.append(entry)
        self._reader.ensure_accessed_all()
        return entries

    def _check_new(
        self, reader: YamlReader, key: str, kind: str, name: str, existing: object
    ) -> None:
        """Reports an error if there is an existing object of a name; None for no such object."""
        if existing is not None:
            reader.report(
                reader.error(
                    f'Invalid "{key}" in "{self._model.name}" model, {kind} with name "{name}" '
                    "already exists"
                )
            )

    def _load_body(self, entry: YamlReader, model_pose: Pose) -> None:
        name = entry.get("name", "string")
        reader = entry.with_location(self._place, f'body "{name}"')
        if not _is_enabled(reader, f'{self._place} body "{name}"'):
            return
        self._check_new(reader, "bodies", "body", name, self._model.find_body(name))
        pose = reader.get("pose", "pose", IDENTITY, finite=True)
        body_type = reader.get("type", "string", "dynamic")
        problem = f'Invalid "type" in {self._place} body "{name}", must be one of'
        if not _check_choice(reader, body_type, BODY_TYPES, problem):
            body_type = "dynamic"
        color = read_color(reader, BODY_COLOR)
        linear_damping = reader.get("linear_damping", "float", 0.0, finite=True, minimum=0)
        angular_damping = reader.get("angular_damping", "float", 0.0, finite=True, minimum=0)
        class_name = read_class(reader, self._model.class_name)
        footprints = reader.subnode("footprints", "list")
        reader.ensure_accessed_all()
        self._count_footprints(reader, len(footprints), body_type)
        physics_body = _create(
            reader,
            self._physics.create_body,
            body_type,
            compose(model_pose, pose),
            linear_damping=linear_damping,
            angular_damping=angular_damping,
        )
        body = Body(physics_body, self._model, name, color, class_name)
        if not self._model.bodies:
            self._model.offset = pose
        self._model.bodies.append(body)
        for footprint in footprints.items():
            with footprint.collect_errors():
                self._load_footprint(body, footprint)

    def _count_footprints(self, reader: YamlReader, count: int, body_type: str) -> None:
        """Checks the number of footprints before those of a body are created.

        A short file can have many, because each alias of a list repeats all of its items.

        Raises:
            YamlError: The model has too many footprints with those of the body.
        """
        names = ("footprints", "footprints of bodies that are not static")
        limits = (MAX_FOOTPRINTS, MAX_MOVING_FOOTPRINTS)
        added = (count, 0 if body_type == "static" else count)
        for i, (name, limit) in enumerate(zip(names, limits, strict=True)):
            before, self._counts[i] = self._counts[i], self._counts[i] + added[i]
            if self._counts[i] > limit:
                text = (
                    f'Invalid "footprints" in {reader.location} {reader.name}, the model must have '
                    f"at most {limit} {name}, got {self._counts[i]} with those of this body"
                )
                hint = "each alias of a list repeats its items; several models may have more"
                raise FollowUpError(text) if before > limit else reader.error(text, hint)

    def _load_footprint(self, body: Body, reader: YamlReader) -> None:
        place = f"{reader.location} {reader.name}"
        kind = reader.get("type", "string")
        problem = f'Invalid footprint "type" in {place}, support footprints are'
        is_known = _check_choice(reader, kind, FOOTPRINT_TYPES, problem)
        layers = reader.get_list("layers", "string", ["all"], max_size=_MAX_LAYER_NAMES)
        unknown = self._layers.unknown(layers)
        if unknown:
            reader.report(
                reader.error(
                    f'Invalid footprint "layers" in {place}, {{{",".join(unknown)}}} layer(s) does '
                    "not exist",
                    did_you_mean(unknown[0], self._layers.names, "layers of the world"),
                )
            )
            layers = [name for name in layers if name not in unknown]
        category_bits = self._layers.category_bits(layers)
        properties: dict[str, Any] = {
            "density": reader.get("density", "float", finite=True, minimum=0),
            "friction": reader.get("friction", "float", 0.0, finite=True, minimum=0),
            "restitution": reader.get("restitution", "float", 0.0, finite=True, minimum=0),
            "is_sensor": reader.get("sensor", "bool", False),
            "category_bits": category_bits,
            "mask_bits": category_bits if reader.get("collision", "bool", True) else 0,
        }
        material = read_material(reader)
        if not is_known:
            return
        if kind == "circle":
            radius = reader.get("radius", "float", finite=True, minimum=0)
            if radius == 0:
                reader.warn("radius", "0, so that the circle is a point")
            center = reader.get("center", "vector", (0.0, 0.0), finite=True)
            reader.ensure_accessed_all()
            fixture = _create(reader, body.create_circle, center, radius, **properties)
        else:
            points = reader.get_list("points", "vector", min_size=3, max_size=8, finite=True)
            reader.ensure_accessed_all()
            fixture = _create(reader, body.create_polygon, points, **properties)
            reader.warn("points", lambda: hull_problem(body.name, points, fixture.vertices))
        if material is not None:
            fixture.material = material

    def _load_joint(self, entry: YamlReader) -> None:
        name = entry.get("name", "string")
        reader = entry.with_location(self._place, f'joint "{name}"')
        place = f'{self._place} joint "{name}"'
        if not _is_enabled(reader, place):
            return
        self._check_new(reader, "joints", "joint", name, self._model.find_joint(name))
        kind = reader.get("type", "string")
        problem = f'Invalid joint "type" in {place}, supported joints are'
        is_known = _check_choice(reader, kind, JOINT_TYPES, problem)
        color = read_color(reader, BODY_COLOR)
        collide_connected = reader.get("collide_connected", "bool", False)
        ends = reader.subnode("bodies", "list")
        if len(ends) != 2:
            ends.report(
                ends.error(f'Invalid "bodies" in {place}, must be a sequence of exactly two items')
            )
        bodies, anchors = [], []
        for end in ends.items():
            body_name = end.get("name", "string")
            body = self._model.find_body(body_name)
            if body is None:
                end.report(
                    end.error(
                        f'Cannot find body with name "{body_name}" in {end.location} {end.name}',
                        did_you_mean(
                            body_name,
                            (other.name for other in self._model.bodies),
                            "bodies of the model",
                        ),
                    )
                )
            else:
                bodies.append(body)
            anchors.append(end.get_list("anchor", "float", size=2, finite=True))
        options: dict[str, Any] = {"collide_connected": collide_connected}
        create: Callable[..., PhysicsJoint]
        if kind == "revolute":
            create = self._physics.create_revolute_joint
            options["limits"] = _read_limits(reader)
        else:
            create = self._physics.create_weld_joint
            options["reference_angle"] = reader.get("angle", "angle", 0.0, finite=True)
            options["frequency"] = reader.get("frequency", "float", 0.0, finite=True, minimum=0)
            options["damping"] = reader.get("damping", "float", 0.0, finite=True, minimum=0)
        if not is_known:
            return
        reader.ensure_accessed_all()
        if len(bodies) != 2:
            return  # reported above
        joint = _create(reader, create, bodies[0], bodies[1], anchors[0], anchors[1], **options)
        self._model.joints.append(Joint(joint, name, (bodies[0], bodies[1]), color))


def _check_choice(reader: YamlReader, value: str, choices: Sequence[str], problem: str) -> bool:
    """Returns whether a value is one of several; if it is not, reports an error."""
    if value in choices:
        return True
    reader.report(reader.error(f"{problem}: {', '.join(choices)}", choice(value, choices)))
    return False


def _read_limits(reader: YamlReader) -> tuple[float, float] | None:
    limits = reader.get_list("limits", "angle", None, size=2, finite=True)
    if limits is None:
        return None
    lower, upper = limits
    if lower > upper:
        reader.report(
            reader.invalid(
                "limits", f"the lower limit {lower} must not be above the upper limit {upper}"
            )
        )
        return None
    return (lower, upper)


def _is_enabled(reader: YamlReader, place: str) -> bool:
    enabled = reader.get("enabled", "bool", True)
    if not enabled:
        _LOG.info("%s is disabled", place)
    return enabled


def _create(reader: YamlReader, create: Callable[..., T], *arguments: Any, **options: Any) -> T:
    """Creates a physics object.

    Raises:
        YamlError: The physics engine rejects an argument.
    """
    try:
        return create(*arguments, **options)
    except (ValueError, PhysicsError) as error:
        raise reader.error(f"Invalid entry in {reader.location} {reader.name}, {error}") from error
