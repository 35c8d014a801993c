"""The parameters of included plugins that are mistaken for others, for hints.

They decide whether a plugin can replace one of another package, and whether a key that a plugin
does not have is a misspelling, or a parameter of another plugin.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

_OF_ALL: Final = frozenset(("name", "type", "enabled"))
_OF_DRIVES: Final = frozenset(
    (
        *("body", "pub_rate", "after_step", "twist_sub", "mode", "max_force", "max_torque"),
        *("friction", "grip_radius", "linear_dynamics", "angular_dynamics", "odom_frame_id"),
        *("odom_pub", "odom_drift", "odom_pose_noise", "odom_twist_noise", "enable_odom_tf_pub"),
        *("odom_pose_covariance", "odom_twist_covariance", "twist_in_local_frame"),
        *("ground_truth_pub", "ground_truth_frame_id", "command_timeout"),
    )
)
_OF_BODY_DRIVES: Final = _OF_DRIVES | {"enable_odom_pub", "enable_twist_pub", "twist_pub"}
_WHEEL_JOINTS: Final = frozenset(
    ("front_wheel_joint", "rear_left_wheel_joint", "rear_right_wheel_joint")
)
PARAMETERS: Final[dict[str, frozenset[str]]] = {
    "DiffDrive": _OF_BODY_DRIVES,
    "OmniDrive": _OF_BODY_DRIVES
    | {"layout", "max_wheel_speed", "max_wheel_acceleration", "track"}
    | {"wheelbase", "wheel_distance", "wheel_angle"},
    "AckermannDrive": _OF_BODY_DRIVES
    | {"max_steer_angle", "wheelbase", "rear_axle", "command", "ackermann_sub"},
    "TricycleDrive": _OF_DRIVES
    | _WHEEL_JOINTS
    | {"max_steer_angle", "max_angular_velocity", "max_steer_acceleration", "command"},
    "PathFollower": frozenset(
        (
            *("body", "waypoints", "speed", "acceleration", "deceleration", "angular_speed"),
            *("angular_acceleration", "angular_deceleration", "frame", "heading", "mode", "redraw"),
            *("start", "start_topic", "wait"),
        )
    ),
    "PosePublisher": frozenset(
        (
            *("body", "origin", "topic", "frame_id", "child_frame_id", "message", "update_rate"),
            "after_step",
        )
    ),
    "Tween": frozenset(("body", "delta", "duration", "easing", "mode", "trigger_topic", "redraw")),
}
"""Parameters by plugin."""
REQUIRED: Final[dict[str, frozenset[str]]] = {
    "DiffDrive": frozenset(("body",)),
    "OmniDrive": frozenset(("body",)),
    "AckermannDrive": frozenset(("body", "max_steer_angle")),
    "TricycleDrive": _WHEEL_JOINTS | {"body"},
    "PathFollower": frozenset(("waypoints",)),
    "PosePublisher": frozenset(),
    "Tween": frozenset(("body", "delta")),
}
"""Parameters without a default by plugin."""


def foreign_keys(plugin: str, keys: Iterable[str]) -> list[str]:
    """Returns the keys that a plugin does not have."""
    return sorted(set(keys) - PARAMETERS[plugin] - _OF_ALL)


def owners_of(key: str) -> list[str]:
    """Returns the plugins that have a parameter."""
    return [plugin for plugin, parameters in PARAMETERS.items() if key in parameters]
