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
    "use Tween for a periodic motion; for a random one, write a Python plugin that calls "
    "body.set_velocity with numbers of self.rng"
)
_HOLONOMIC: Final = (
    "no included drive moves sideways; write a Python plugin that calls "
    "body.set_velocity(vx, vy, omega)"
)
_STEERED: Final = "use TricycleDrive, whose command has the steering angle of a single front wheel"
_DIFFERENTIAL: Final = "use DiffDrive"
_RADIATION: Final = "flatland has no model of radiation; write a Python plugin"

_ALTERNATIVES: Final = {
    "PedsimMovement": _PEDESTRIANS,
    "VehicleMovement": _PEDESTRIANS,
    "PosePub": "use ModelTfPublisher with publish_tf_world: true, which sends the pose to /tf; "
    "a drive publishes it on its topic ground_truth_pub",
    "RandomMove": _RANDOM_MOTION,
    "RandomWandering": _RANDOM_MOTION,
    "Tween2": "use Tween, which moves to a single pose; for several waypoints, write a Python "
    "plugin",
    "DiffDrive2": _DIFFERENTIAL,
    "Diff_drive": _DIFFERENTIAL,
    "AckermannDrive": _STEERED,
    "SingleTrackDrive": _STEERED,
    "DackermannDrive": "TricycleDrive steers only the front wheel; for four steered wheels, write "
    "a Python plugin",
    "Holo": _HOLONOMIC,
    "HoloSecondOrder": _HOLONOMIC,
    "OmniDrive": _HOLONOMIC,
    "RandomGates": "use RandomWall, which adds walls at random places",
    "MockLidar3D": "use Laser for scans in one plane",
    "TrajectoryRecorder": "record the ground truth odometry of a drive with rosbag",
    "DynamicMap": "use the services spawn_model, move_model and delete_model for obstacles that "
    "change",
    "RadiationSource": _RADIATION,
    "RadiationSourceWorld": _RADIATION,
    "RadiationSensor": _RADIATION,
}
_BY_NAME: Final = {name.lower(): text for name, text in _ALTERNATIVES.items()}


def fork_plugin_names() -> list[str]:
    """Returns the names of the plugins of forks that are known."""
    return list(_ALTERNATIVES)


def alternative_to(type_name: str) -> str:
    """Returns what to use instead of a plugin of a fork.

    Args:
        type_name: Value of `type:` in a YAML file; its package and case are ignored.

    Returns:
        A text for an error message, empty if the name is not known.
    """
    return _BY_NAME.get(re.split(r"::|[/.]", type_name)[-1].lower(), "")
