"""Joints between a body and its wheels, which parameters of drives name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from flatland.config.hints import did_you_mean
from flatland.plugin_api.parameters import at_key

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.joint import Joint
    from flatland.entities.model import Model
    from flatland.geometry import Vector2

TOLERANCE: Final = 1e-5  # m between an anchor and its required position


class WheelJoint:
    """A joint named by a parameter, and the place of that parameter for errors.

    Attributes:
        joint: The joint.
    """

    def __init__(self, config: YamlReader, key: str, model: Model) -> None:
        """Reads the name of the joint.

        Args:
            config: Parameters of the plugin.
            key: The parameter.
            model: Model of the joint.

        Raises:
            YamlError: The joint does not exist.
        """
        name = config.get(key, "string")
        self._place = at_key(config, key)
        joint = model.find_joint(name)
        if joint is None:
            names = (other.name for other in model.joints)
            hint = did_you_mean(name, names, "joints of the model")
            raise self._place.error(f'Joint with name "{name}" does not exist', hint)
        self.joint: Joint = joint

    def error(self, text: str) -> Exception:
        """Returns an error at the place of the parameter."""
        return self._place.error(text)

    def check_type(self, kind: str, text: str) -> None:
        """Raises an error with a text if the joint has another type."""
        if self.joint.type != kind:
            raise self.error(text)

    def body_anchor(self, body: Body) -> Vector2:
        """Returns the anchor on the body; raises if the anchor on the wheel is not the origin."""
        (ax, ay), (bx, by) = self.joint.anchors.tolist()
        if self.joint.bodies[0] is body:
            anchor, wheel_anchor = (ax, ay), (bx, by)
        elif self.joint.bodies[1] is body:
            anchor, wheel_anchor = (bx, by), (ax, ay)
        else:
            raise self.error(f'Joint "{self.joint.name}" does not anchor on body "{body.name}"')
        if is_off(wheel_anchor, (0.0, 0.0)):
            raise self.error(f'Joint "{self.joint.name}" must be anchored at (0, 0) on the wheel')
        return anchor

    def steering_sign(self, body: Body) -> float:
        """Returns the sign of the angle of the joint if the wheel turns counter-clockwise."""
        # The angle of a joint is the angle of its body B relative to its body A.
        return 1.0 if self.joint.bodies[0] is body else -1.0


def is_off(point: Vector2, target: Vector2) -> bool:
    """Returns whether two points differ."""
    return abs(point[0] - target[0]) > TOLERANCE or abs(point[1] - target[1]) > TOLERANCE
