"""Models: the moving things of a world."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.entities.body import Body, Entity
from flatland.entities.joint import Joint
from flatland.errors import WorldError
from flatland.geometry import MAX_MAGNITUDE, Pose, Vector2, compose, finite_pose, invert
from flatland.graph_names import clean_name

if TYPE_CHECKING:
    from flatland.plugin_api.plugin import ModelPlugin
    from flatland.world import World


class Model(Entity):
    """Bodies, the joints between them and the plugins that drive them.

    Attributes:
        world: The world that it is in.
        name: Unique in the world.
        namespace: Under which its topics and frames live, cleaned, may be empty.
        path: File that it was read from.
        bodies: In the order of the file; the first one stands for the model's pose.
        joints: In the order of the file.
        plugins: In the order of the file.
        displacement: (dx, dy) from the pose asked for to the pose that the last spawn or move gave
            it [m]; (0, 0) unless `if_blocked` was `nearest`.
    """

    def __init__(self, world: World, name: str, namespace: str, path: str) -> None:
        """Makes a model without bodies; `model_loader` fills it."""
        self.world = world
        self.name = name
        self.namespace = clean_name(namespace)
        self.path = path
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self.plugins: list[ModelPlugin] = []
        self.displacement: Vector2 = (0.0, 0.0)

    def __repr__(self) -> str:
        """Names the model."""
        return f"<Model {self.name!r}>"

    def find_body(self, name: str) -> Body | None:
        """Returns the body of a name, None when there is none."""
        return next((body for body in self.bodies if body.name == name), None)

    def find_joint(self, name: str) -> Joint | None:
        """Returns the joint of a name, None when there is none."""
        return next((joint for joint in self.joints if joint.name == name), None)

    def body(self, name: str) -> Body:
        """Returns the body of a name.

        Raises:
            WorldError: There is none; the text is the one that plugins give, too.
        """
        body = self.find_body(name)
        if body is None:
            raise WorldError(f'Body with name "{name}" does not exist')
        return body

    def joint(self, name: str) -> Joint:
        """Returns the joint of a name.

        Raises:
            WorldError: There is none.
        """
        joint = self.find_joint(name)
        if joint is None:
            raise WorldError(f'Joint with name "{name}" does not exist')
        return joint

    def plugin(self, name: str) -> ModelPlugin:
        """Returns the plugin of a name.

        Raises:
            WorldError: There is none.
        """
        for plugin in self.plugins:
            if plugin.name == name:
                return plugin
        raise WorldError(f'Plugin with name "{name}" does not exist')

    @property
    def pose(self) -> Pose:
        """(x, y, theta) of the first body in the world frame [m, rad]."""
        return self.bodies[0].pose

    def frame(self, frame_id: str) -> str:
        """Turns a frame of this model into the TF frame id.

        A frame that starts with `/` loses the slash and takes no prefix; any other is prefixed
        with the namespace and an underscore, if the model has a namespace.
        """
        if frame_id.startswith("/"):
            return frame_id[1:]
        namespace = self.namespace.strip("/")
        return f"{namespace}_{frame_id}" if namespace else frame_id

    def set_pose(self, x: float, y: float, theta: float) -> None:
        """Moves the model rigidly so that its first body is at a pose; all velocities become 0.

        Raises:
            ValueError: A number is NaN or infinite, or a body would be beyond the range of the
                physics; no body has moved.
        """
        # Unlike the reference: the bodies keep their angles to each other, and nothing flies on.
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
