"""Models, the movable entities of a world."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING

from flatland.entities.body import Body, Entity
from flatland.entities.joint import Joint
from flatland.errors import FlatlandError, WorldError
from flatland.geometry import IDENTITY, MAX_MAGNITUDE, Pose, Vector2, compose, finite_pose, invert
from flatland.graph_names import clean_name
from flatland.suggestions import did_you_mean
from flatland.uncopied import uncopied

if TYPE_CHECKING:
    from flatland.physics import Touches
    from flatland.plugin_api.plugin import ModelPlugin
    from flatland.plugin_api.plugin_world import PluginWorld


@uncopied("World.clone() copies a world with its models, World.spawn_model() adds another model")
class Model(Entity):
    """A set of bodies with the joints and plugins attached to them.

    Attributes:
        world: World that contains the model.
        name: Name of the model, unique in the world.
        namespace: Namespace of the topics and frames of the model, normalized, may be empty.
        path: Path of the model file.
        bodies: Bodies in the order of the file; the first one defines the pose of the model.
        joints: Joints in the order of the file.
        plugins: Plugins in the order of the file.
        class_name: Class of objects that the model belongs to, for labels of sensors: the entry
            `class` of the model file, by default the name of the file without extensions, or the
            name of the model if it was spawned from a text.
        offset: Pose of the first body in the frame of the model file [m, rad].
        followers: Plugins of other models whose `model_moved` is also called for this model, such
            as a hitch that is connected to it.
        displacement: Offset (dx, dy) of the actual pose from the requested pose after the last
            spawn or move [m]; (0, 0) unless `if_blocked` was `nearest`.
    """

    def __init__(self, world: PluginWorld, name: str, namespace: str, path: str) -> None:
        """Creates a model without bodies; `ModelLoader` adds them."""
        self.world = world
        self.name = name
        self.namespace = clean_name(namespace)
        self.path = path
        self.class_name = _class_of(path) or name
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self.plugins: list[ModelPlugin] = []
        self.offset: Pose = IDENTITY
        self.followers: list[ModelPlugin] = []
        self.displacement: Vector2 = (0.0, 0.0)

    def __repr__(self) -> str:
        """Returns the name, the pose and the number of bodies and plugins."""
        contents = f"bodies: {len(self.bodies)}, plugins: {len(self.plugins)}"
        try:
            x, y, theta = self.pose
        except (FlatlandError, IndexError):  # The model was deleted, or is incomplete.
            return f"<Model {self.name!r}, {contents}>"
        return f"<Model {self.name!r} at ({x:.3f}, {y:.3f}, {theta:.3f}), {contents}>"

    def find_body(self, name: str) -> Body | None:
        """Returns the body with a name, None if it does not exist."""
        return next((body for body in self.bodies if body.name == name), None)

    def find_joint(self, name: str) -> Joint | None:
        """Returns the joint with a name, None if it does not exist."""
        return next((joint for joint in self.joints if joint.name == name), None)

    def body(self, name: str) -> Body:
        """Returns the body with a name.

        Raises:
            WorldError: The body does not exist. Plugins use the same error message.
        """
        body = self.find_body(name)
        if body is None:
            raise _missing("Body", name, (each.name for each in self.bodies), "bodies of the model")
        return body

    def joint(self, name: str) -> Joint:
        """Returns the joint with a name.

        Raises:
            WorldError: The joint does not exist.
        """
        joint = self.find_joint(name)
        if joint is None:
            names = (each.name for each in self.joints)
            raise _missing("Joint", name, names, "joints of the model")
        return joint

    def plugin(self, name: str) -> ModelPlugin:
        """Returns the plugin with a name.

        Raises:
            WorldError: The plugin does not exist.
        """
        for plugin in self.plugins:
            if plugin.name == name:
                return plugin
        names = (each.name for each in self.plugins)
        raise _missing("Plugin", name, names, "plugins of the model")

    @property
    def pose(self) -> Pose:
        """Pose (x, y, theta) of the first body in the world frame [m, rad]."""
        return self.bodies[0].pose

    @property
    def origin(self) -> Pose:
        """Pose in the world frame [m, rad] at which a spawn puts the first body where it is.

        It differs from `pose` if the model file gives the first body a pose.
        """
        return self.pose if self.offset == IDENTITY else compose(self.pose, invert(self.offset))

    def frame(self, frame_id: str) -> str:
        """Returns the TF frame id of a frame of the model.

        A leading slash is removed. A frame without a leading slash is prefixed with the namespace
        and an underscore if the model has a namespace.
        """
        if frame_id.startswith("/"):
            return frame_id[1:]
        namespace = self.namespace.strip("/")
        return f"{namespace}_{frame_id}" if namespace else frame_id

    def watch_contacts(self, *, sensors: bool = False) -> Touches:
        """Watches whether the model touches anything else, at low cost.

        Args:
            sensors: Whether to count contacts with sensors, which have no effect on bodies.

        Returns:
            `touched` is true if a body of the model touches a wall or another model, or did so
            since the last call of `clear`; `remove` ends it.

        Raises:
            StaleHandleError: The model was deleted.
            WorldLockedError: The world is stepping.
        """
        physics = self.bodies[0].world
        return physics.collect_touches(self.bodies, sensors=sensors, own=False)

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Moves the model rigidly so that its first body is at a pose, and stops all bodies.

        Raises:
            ValueError: A number is NaN or infinite, or the new pose of a body is out of range. No
                body is moved in that case.
        """
        # Unlike the reference: relative angles are preserved and all velocities are reset.
        target = finite_pose((x, y, theta))
        to_first = invert(self.bodies[0].pose)
        poses = [target]
        poses += [compose(target, compose(to_first, body.pose)) for body in self.bodies[1:]]
        for body, pose in zip(self.bodies, poses, strict=True):
            if not all(abs(number) <= MAX_MAGNITUDE for number in pose):
                what = "pose" if pose is target else f'pose of body "{body.name}"'
                raise ValueError(
                    f"{what} must be finite and within +-{MAX_MAGNITUDE:g}, got {pose}"
                )
        for body, pose in zip(self.bodies, poses, strict=True):
            body.set_pose(*pose)
            body.set_velocity(0.0, 0.0, 0.0)


def _class_of(path: str) -> str:
    """Returns the name of a YAML file without extensions, empty for other paths."""
    name = PurePath(path).name
    return name.partition(".")[0] if name.endswith((".yaml", ".yml")) else ""


def _missing(what: str, name: str, names: Iterable[str], kind: str) -> WorldError:
    """Returns the error for a part of a model that does not exist.

    Args:
        what: What was looked up, such as `Body`.
        name: Its name.
        names: Names of all parts of this kind.
        kind: See `did_you_mean`.
    """
    return WorldError(
        f'{what} with name "{name}" does not exist', hint=did_you_mean(name, names, kind)
    )
