"""Readers of parameters that several plugins share, with checks of the values.

All errors are created by `YamlReader.error` and name the file and line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flatland.config.hints import choice, did_you_mean
from flatland.geometry import IDENTITY, DoubleArray, Pose, Vector2

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.plugin_api.updates import Phase

Triple = tuple[float, float, float]

MAX_COORDINATE = 1e8  # m, rad; added to a pose, the sum is within the limit of the physics, 1e9


def at_key(config: YamlReader, key: str) -> YamlReader:
    """Returns a reader of a key for errors about its value; the map if the key is missing."""
    return config.subnode(key) if key in config else config


def find_body(config: YamlReader, key: str, model: Model, name: str) -> Body:
    """Returns the body of a name, which is the value of the parameter `key`.

    Raises:
        YamlError: `Body with name "B" does not exist`.
    """
    body = model.find_body(name)
    if body is None:
        hint = did_you_mean(name, (other.name for other in model.bodies), "bodies of the model")
        entry = at_key(config, key)
        entry.report(entry.error(f'Body with name "{name}" does not exist', hint))
        return model.bodies[0]  # only if errors are collected
    return body


def read_body(config: YamlReader, model: Model, key: str = "body") -> Body:
    """Reads the required name of a body and returns the body.

    Raises:
        YamlError: The key is missing, or the body does not exist.
    """
    return find_body(config, key, model, config.get(key, "string"))


def read_body_or_first(config: YamlReader, model: Model, key: str) -> Body:
    """Reads the optional name of a body and returns the body, by default the first of the model.

    Raises:
        YamlError: The body does not exist.
    """
    return find_body(config, key, model, config.get(key, "string", model.bodies[0].name))


def read_choice(config: YamlReader, key: str, choices: Sequence[str], default: str = "") -> str:
    """Reads one of several words.

    Args:
        config: Parameters of the plugin.
        key: Name of the parameter.
        choices: The words.
        default: The default, the first word if it is empty.

    Raises:
        YamlError: The value is none of the words.
    """
    value: str = config.get(key, "string", default or choices[0])
    if value not in choices:
        text = f'Invalid "{key}", must be one of: {", ".join(choices)}, got {value}'
        raise at_key(config, key).error(text, choice(value, choices))
    return value


def read_bodies(config: YamlReader, model: Model, key: str) -> list[Body]:
    """Reads an optional list of names of bodies and returns the bodies.

    Raises:
        YamlError: A body does not exist.
    """
    return [find_body(config, key, model, name) for name in config.get_list(key, "string", [])]


def read_phase(config: YamlReader, rate: float) -> Phase:
    """Reads `after_step`: whether to publish the state after a step, instead of that before it.

    By default, plugins that publish before the physics step publish the state at time t, when the
    node has published the time t already. With `after_step: true`, they publish the state at time
    t + dt after the step. The times at which updates are due are the same, except that the state at
    time 0, which no step precedes, is published only if the rate is 0, that is, if it is the only
    update.

    Args:
        config: Parameters of the plugin.
        rate: Rate of its updates [Hz].

    Raises:
        YamlError: The value is not a boolean.
    """
    return "after" if config.get("after_step", "bool", False) and rate > 0 else "before"


def read_rate(config: YamlReader, key: str = "update_rate", default: float = math.inf) -> float:
    """Reads a rate [Hz]; infinity is allowed.

    Raises:
        YamlError: The value is not a number, negative or NaN.
    """
    return read_not_negative(config, key, default)


def read_not_negative(config: YamlReader, key: str, default: float) -> float:
    """Reads a number of at least 0; infinity is allowed.

    Raises:
        YamlError: The value is not a number, negative or NaN.
    """
    return config.get(key, "float", default, minimum=0)


def read_finite(config: YamlReader, key: str, default: float) -> float:
    """Reads a finite number.

    Raises:
        YamlError: The value is not a number, infinite or NaN.
    """
    return config.get(key, "float", default, finite=True)


def read_positive(config: YamlReader, key: str, *default: float) -> float:
    """Reads a number above 0.

    Args:
        config: Parameters of the plugin.
        key: Name of the parameter.
        default: The default; without one, the parameter is required.

    Raises:
        YamlError: The value is not a number, not finite or not above 0.
    """
    number: float = config.get(key, "float", *default, finite=True)
    if number <= 0.0:
        raise config.invalid(key, f"must be greater than 0, got {number}")
    return number


def read_point(config: YamlReader, key: str) -> Vector2:
    """Reads a point (x, y) in the frame of a body [m], by default its origin.

    Raises:
        YamlError: The value is not a point, or a number is not finite or beyond `MAX_COORDINATE`.
    """
    return config.get(
        key, "vector", (0.0, 0.0), finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE
    )


def read_pose(config: YamlReader, key: str, default: Pose = IDENTITY) -> Pose:
    """Reads a pose (x, y, theta) of finite numbers.

    Raises:
        YamlError: The value is not a pose, or a number is not finite or beyond `MAX_COORDINATE`.
    """
    return config.get(
        key, "pose", default, finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE
    )


def read_variances(config: YamlReader, key: str) -> Triple:
    """Reads three variances of noise, by default 0.

    Raises:
        YamlError: The value is not a list of three numbers, or one is negative or not finite.
    """
    # Unlike the reference: a negative variance is an error.
    x, y, z = config.get_list(key, "float", [0.0, 0.0, 0.0], size=3, finite=True, minimum=0)
    return (x, y, z)


def read_covariance(config: YamlReader, key: str, default_diagonal: Sequence[float]) -> DoubleArray:
    """Reads a covariance matrix, row by row.

    The matrix is only emitted and never used in computations, so that special values such as -1
    are allowed.

    Args:
        config: Parameters of the plugin.
        key: Name of the parameter.
        default_diagonal: Diagonal of the default matrix; its length n is that of a row.

    Returns:
        The matrix, shape (n, n), read-only since many messages share it.

    Raises:
        YamlError: The value is not a list of n² numbers, or one is NaN.
    """
    n = len(default_diagonal)
    default = np.diag(np.asarray(default_diagonal, dtype=np.float64)).ravel().tolist()
    values = config.get_list(key, "float", default, size=n * n)
    matrix = np.array(values, dtype=np.float64).reshape(n, n)
    if np.isnan(matrix).any():
        raise config.invalid(key, "must not hold NaN")
    matrix.flags.writeable = False
    return matrix


def planar_diagonal(variances: Triple) -> list[float]:
    """Returns the diagonal for x, y, z, roll, pitch, yaw from the variances of x, y and yaw."""
    x, y, yaw = variances
    return [x, y, 0.0, 0.0, 0.0, yaw]
