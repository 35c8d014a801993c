"""Public module of the parameter readers of `flatland.plugin_api.parameters`."""

from flatland.plugin_api.parameters import (
    MAX_COORDINATE,
    at_key,
    find_body,
    planar_diagonal,
    read_bodies,
    read_body,
    read_body_or_first,
    read_covariance,
    read_finite,
    read_not_negative,
    read_pose,
    read_rate,
    read_variances,
)

__all__ = [
    "MAX_COORDINATE",
    "at_key",
    "find_body",
    "planar_diagonal",
    "read_bodies",
    "read_body",
    "read_body_or_first",
    "read_covariance",
    "read_finite",
    "read_not_negative",
    "read_pose",
    "read_rate",
    "read_variances",
]
