"""Agents: a model of a world with its laser and its velocity command."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland import physics
from flatland.entities.body import Body
from flatland.entities.model import Model
from flatland.errors import WorldError
from flatland.physics import Touches
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.plugin import describe
from flatland.plugin_api.ports import Command
from flatland.plugins.ackermann_drive import AckermannDrive
from flatland.plugins.diff_drive import DiffDrive
from flatland.plugins.laser import Laser
from flatland.plugins.omni_drive import OmniDrive
from flatland.plugins.pedestrians import Pedestrians
from flatland.plugins.tricycle_drive import TricycleDrive
from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.world import World


# Subclasses of these, of Laser and of Pedestrians may do something else with a command or in their
# first update.
_DRIVES = (AckermannDrive, DiffDrive, OmniDrive, TricycleDrive)
_STEERED = (AckermannDrive, TricycleDrive)
_IDLE_UNLESS_WANTED = (Laser, Pedestrians, *_DRIVES)


@dataclass(frozen=True, slots=True, eq=False)
class Agent:
    """The objects that an environment controls and reads for one robot.

    Attributes:
        world: World of the model.
        model: The model.
        body: Its first body, which defines the pose of the agent.
        laser: The laser that is observed.
        command: The velocity command that actions set.
        controller: The controller to which the drive passes commands, and does nothing else with
            them; None for other drives.
        touches: Whether the model touches anything.
        radius: Radius of the smallest disc around the origin of the first body that contains all
            solid footprints of the model [m].
        bits: Category bits of the solid footprints.
        drive: The plugin that takes the command.
        max_speed: Limit of the forward speed of the drive [m/s], 0 for no limit.
        max_yaw_rate: Limit of the yaw rate of the drive [rad/s], 0 for no limit.
    """

    world: World
    model: Model
    body: Body
    laser: Laser
    command: Command[Twist]
    controller: physics.Controller | None
    touches: Touches
    radius: float
    bits: int
    drive: object
    max_speed: float
    max_yaw_rate: float


def omit_first_calls(agents: Iterable[Agent]) -> None:
    """Makes the core perform the first updates, too, if nothing wants them.

    This concerns the lasers and drives of the agents, and people.

    The results are the same; an episode begins without calls of Python.

    Args:
        agents: Agents, the worlds of which have not been stepped.
    """
    for agent in agents:
        plugins = (*agent.model.plugins, *agent.world.plugins)
        known = [plugin for plugin in plugins if type(plugin) in _IDLE_UNLESS_WANTED]
        agent.world.plugin_host.jobs.omit_first_calls(known)


def find_agent(world: World, name: str, laser: str | None, command: str | None) -> Agent:
    """Returns the agent of a model.

    Args:
        world: The world.
        name: Name of the model.
        laser: Name of its laser; None for its first laser.
        command: Topic of its velocity command, with a leading `/`; None for the first command of
            the type `Twist`.

    Raises:
        WorldError: The model, the laser or the command does not exist, or the model has no solid
            footprint.
    """
    model = world.model(name)
    velocity, source = _find_command(model, command)
    radius, bits = _footprint(model)
    return Agent(
        world,
        model,
        model.bodies[0],
        _find_laser(model, laser),
        velocity,
        source.controller if type(source) in _DRIVES else None,
        model.watch_contacts(),
        radius,
        bits,
        source,
        _velocity_limit(source, "linear_dynamics"),
        # The angular limits of a drive that steers are those of the steering.
        0.0 if isinstance(source, _STEERED) else _velocity_limit(source, "angular_dynamics"),
    )


def _find_laser(model: Model, name: str | None) -> Laser:
    lasers = [plugin for plugin in model.plugins if isinstance(plugin, Laser)]
    for laser in lasers:
        if name is None or laser.name == name:
            return laser
    if name is None:
        raise WorldError(f'model "{model.name}" has no plugin of type Laser, which agents require')
    known = ", ".join(laser.name for laser in lasers) or "none"
    raise WorldError(f'model "{model.name}" has no Laser "{name}"; its lasers: {known}')


def _find_command(model: Model, topic: str | None) -> tuple[Command[Twist], Any]:
    """Returns the command and the plugin that opened it."""
    known = []
    for plugin in model.plugins:
        for command in model.world.ports.commands_of(describe(plugin)):
            if command.value_type is not Twist:
                continue
            if topic is None or command.topic == topic:
                return command, plugin
            known.append(command.topic)
    if topic is None:
        raise WorldError(
            f'model "{model.name}" has no velocity command, such as that of a DiffDrive, which '
            "agents require"
        )
    raise WorldError(
        f'model "{model.name}" has no velocity command {topic}; its commands: '
        f"{', '.join(known) or 'none'}"
    )


def _footprint(model: Model) -> tuple[float, int]:
    """Returns the radius about the origin of the first body, and the category bits."""
    radius, bits = 0.0, 0
    x0, y0, _ = model.bodies[0].pose
    for body in model.bodies:
        x, y, theta = body.pose
        c, s = math.cos(theta), math.sin(theta)
        for fixture in body.fixtures:
            if fixture.is_sensor or not fixture.category_bits:
                continue
            bits |= fixture.category_bits
            points = [fixture.center] if fixture.shape == "circle" else fixture.vertices.tolist()
            for px, py in points:
                distance = math.hypot(x + c * px - s * py - x0, y + s * px + c * py - y0)
                radius = max(radius, distance + fixture.radius)
    if not bits:
        raise WorldError(f'model "{model.name}" has no solid footprint, which agents require')
    return radius, bits


def _velocity_limit(plugin: object, name: str) -> float:
    limits = getattr(plugin, name, None)
    return limits.velocity_limit if isinstance(limits, DynamicsLimits) else 0.0


def check_alike(agents: Iterable[Agent]) -> None:
    """Checks that all agents have the same number of beams and the same laser range.

    Raises:
        WorldError: The lasers differ.
    """
    lasers = [agent.laser for agent in agents]
    kinds = {(laser.angles.count, float(np.float32(laser.range))) for laser in lasers}
    if len(kinds) > 1:
        found = "; ".join(f"{count} beams of {length:g} m" for count, length in sorted(kinds))
        raise WorldError(f"the lasers of the agents must be alike, got {found}")
