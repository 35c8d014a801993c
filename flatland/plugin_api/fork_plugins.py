"""What to use instead of the plugins of public forks of the reference.

The plugins of forks are written in C++ and cannot be loaded, but public model files name them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from flatland.config.plugin_parameters import REQUIRED, foreign_keys

_PEDESTRIANS: Final = (
    "use the world plugin Pedestrians, which does not need pedsim_ros; with pedsim_ros, a Python "
    "plugin can receive its agents with "
    "self.ros.subscribe and move the body with body.set_velocity"
)
_RANDOM_MOTION: Final = (
    "use PathFollower with mode: random, which moves to waypoints in random order"
)
_HOLONOMIC: Final = "use OmniDrive, which moves in all directions"
_STEERED: Final = "use AckermannDrive"
_DIFFERENTIAL: Final = "use DiffDrive"
_RADIATION: Final = "flatland has no model of radiation; write a Python plugin"

ALTERNATIVES: Final = {
    "PedsimMovement": _PEDESTRIANS,
    "VehicleMovement": _PEDESTRIANS,
    "PosePub": "use PosePublisher, which publishes the true pose of a body",
    "RandomMove": _RANDOM_MOTION,
    "RandomWandering": _RANDOM_MOTION,
    "Tween2": "use Tween for a motion to a single pose, or PathFollower for several waypoints",
    "DiffDrive2": _DIFFERENTIAL,
    "Diff_drive": _DIFFERENTIAL,
    "SingleTrackDrive": _STEERED,
    "DackermannDrive": "AckermannDrive steers only the front wheels; for four steered wheels, "
    "write a Python plugin",
    "Holo": _HOLONOMIC,
    "HoloSecondOrder": _HOLONOMIC,
    "RandomGates": "use RandomWall, which adds walls at random places",
    "MockLidar3D": "use Laser for scans in one plane",
    "TrajectoryRecorder": "record the ground truth odometry of a drive with rosbag",
    "DynamicMap": "use the services spawn_model, move_model and delete_model for obstacles that "
    "change",
    "RadiationSource": _RADIATION,
    "RadiationSourceWorld": _RADIATION,
    "RadiationSensor": _RADIATION,
}
_SUBSTITUTES: Final = {
    "PosePub": ("PosePublisher",),
    "RandomMove": ("PathFollower",),
    "RandomWandering": ("PathFollower",),
    "Tween2": ("Tween", "PathFollower"),
    "DiffDrive2": ("DiffDrive",),
    "Diff_drive": ("DiffDrive",),
    "SingleTrackDrive": ("AckermannDrive", "TricycleDrive"),
    "Holo": ("OmniDrive",),
    "HoloSecondOrder": ("OmniDrive",),
}
"""Included plugins that can replace a plugin of a fork if they have its parameters."""
_SUBSTITUTES_BY_NAME: Final = {name.lower(): names for name, names in _SUBSTITUTES.items()}
_BY_NAME: Final = {name.lower(): text for name, text in ALTERNATIVES.items()}


def alternative_to(type_name: str, keys: Iterable[str] = ()) -> str:
    """Returns what to use instead of a plugin of a fork.

    A plugin is offered only if it has all parameters that are given.

    Args:
        type_name: Value of `type:` in a YAML file; its package and case are ignored.
        keys: Keys of the entry of the plugin.

    Returns:
        A text for an error message, empty if the name is not known.
    """
    name = re.split(r"::|[/.]", type_name)[-1].lower()
    text, keys = _BY_NAME.get(name, ""), set(keys)
    substitutes = _SUBSTITUTES_BY_NAME.get(name, ())
    foreign = [foreign_keys(substitute, keys) for substitute in substitutes]
    fitting = [each for each, rest in zip(substitutes, foreign, strict=True) if not rest]
    if not substitutes:
        return text
    if not fitting:
        names = ", ".join(f'"{key}"' for key in min(foreign, key=len))
        return f"no included plugin for its purpose has the parameters {names}"
    # The plugin that misses the fewest parameters, in the order of the table.
    best = min(fitting, key=lambda each: bool(keys) * len(REQUIRED[each] - keys))
    text = text if best in text else f"use {best}"
    missing = sorted(REQUIRED[best] - keys) if keys else []
    return f"{text}; it also requires {' and '.join(missing)}" if missing else text
