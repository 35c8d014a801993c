"""What to use instead of the plugins of public forks of the reference.

The plugins of forks are written in C++ and cannot be loaded, but public model files name them.
"""

from __future__ import annotations

import re
from typing import Final

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
_BY_NAME: Final = {name.lower(): text for name, text in ALTERNATIVES.items()}


def alternative_to(type_name: str) -> str:
    """Returns what to use instead of a plugin of a fork.

    Args:
        type_name: Value of `type:` in a YAML file; its package and case are ignored.

    Returns:
        A text for an error message, empty if the name is not known.
    """
    return _BY_NAME.get(re.split(r"::|[/.]", type_name)[-1].lower(), "")
