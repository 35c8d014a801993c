"""The parameter `mode: force`: a drive pushes its body with bounded forces on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from flatland.plugin_api.parameters import at_key, read_choice, read_not_negative

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.physics import DriveController

GRAVITY: Final = 9.80665  # m/s², standard gravity

_MODES: Final = ("velocity", "force")
_KEYS: Final = ("max_force", "max_torque", "friction", "grip_radius")


@dataclass(frozen=True, slots=True)
class Traction:
    """The limits of the forces of a drive.

    Attributes:
        max_force: Force of the motors [N]: forwards and backwards, or in all directions if the
            drive is holonomic.
        max_torque: Torque of the motors [N m].
        friction: Friction coefficient of the wheels on the ground; infinite without slip.
        grip_radius: Radius at which the friction of the wheels withstands a torque [m], 0 for the
            radius of gyration.
        holonomic: Whether the motors push in all directions.
        at_center: Whether the forces act at the centre of mass, as for a car, whose axles share the
            load, or at the origin of the body.
    """

    max_force: float
    max_torque: float
    friction: float
    grip_radius: float
    holonomic: bool = False
    at_center: bool = False

    def apply(self, body: Body, controller: DriveController) -> None:
        """Sets the limits of the controller of a driven body.

        Raises:
            ValueError: A limit is negative or NaN, or the body is not dynamic.
        """
        controller.set_traction(
            connected_bodies(body),
            holonomic=self.holonomic,
            at_center=self.at_center,
            max_force=self.max_force,
            max_torque=self.max_torque,
            grip=self.friction * GRAVITY,
            radius=self.grip_radius,
        )


def read_traction(
    config: YamlReader,
    body: Body,
    *,
    holonomic: bool = False,
    needs_torque: bool = False,
    at_center: bool = False,
) -> Traction | None:
    """Reads `mode` and the limits of forces.

    Args:
        config: Parameters of the drive.
        body: The driven body.
        holonomic: See `Traction`.
        needs_torque: Whether `max_torque` is required.
        at_center: See `Traction`.

    Returns:
        The limits; None in mode `velocity`.

    Raises:
        YamlError: A parameter is invalid, or the body cannot be moved by forces.
    """
    mode = read_choice(config, "mode", _MODES, "velocity")
    if mode == "velocity":
        for key in _KEYS:
            if key in config:
                raise at_key(config, key).error(f'"{key}" requires "mode: force"')
        return None
    if body.type != "dynamic" or body.inertia <= 0.0:
        raise at_key(config, "mode").error(
            f'"mode: force" requires a dynamic body with a mass, but body "{body.name}" '
            + ("has none" if body.type == "dynamic" else f"is {body.type}")
        )
    return Traction(
        max_force=config.get("max_force", "float", minimum=0),
        max_torque=(
            config.get("max_torque", "float", minimum=0)
            if needs_torque
            else read_not_negative(config, "max_torque", math.inf)
        ),
        friction=read_not_negative(config, "friction", 1.0),
        grip_radius=config.get("grip_radius", "float", 0.0, minimum=0, finite=True),
        holonomic=holonomic,
        at_center=at_center,
    )


def connected_bodies(body: Body) -> list[Body]:
    """Returns a body of a model and all bodies that joints connect to it, directly or not.

    Args:
        body: The body; first in the result.
    """
    found = [body]
    model: Model = body.entity  # type: ignore[assignment]
    for each in found:
        for joint in model.joints:
            if each in joint.bodies:
                found += [other for other in joint.bodies if other not in found]
    return found
