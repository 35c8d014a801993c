"""Reads the kinds of parameters that several plugins have, and checks them.

All errors are made by `YamlReader.error`, so they name the file and line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flatland.geometry import IDENTITY, DoubleArray, Pose

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model

Triple = tuple[float, float, float]

MAX_COORDINATE = 1e8  # m, rad; added to a pose it stays within what the physics takes, 1e9


def at_key(config: YamlReader, key: str) -> YamlReader:
    """Returns the place of a key for an error about it; the map's when the key is missing."""
    return config.subnode(key) if key in config else config


def find_body(config: YamlReader, key: str, model: Model, name: str) -> Body:
    """Finds the body that the parameter `key` names.

    Raises:
        YamlError: `Body with name "B" does not exist`.
    """
    body = model.find_body(name)
    if body is None:
        raise at_key(config, key).error(f'Body with name "{name}" does not exist')
    return body


def read_body(config: YamlReader, model: Model, key: str = "body") -> Body:
    """Reads the name of a body, required.

    Raises:
        YamlError: It is missing, or there is no such body.
    """
    return find_body(config, key, model, config.get(key, "string"))


def read_body_or_first(config: YamlReader, model: Model, key: str) -> Body:
    """Reads the name of a body, which is the model's first when left out.

    Raises:
        YamlError: There is no such body.
    """
    return find_body(config, key, model, config.get(key, "string", model.bodies[0].name))


def read_bodies(config: YamlReader, model: Model, key: str) -> list[Body]:
    """Reads a list of bodies, none when left out.

    Raises:
        YamlError: One does not exist.
    """
    return [find_body(config, key, model, name) for name in config.get_list(key, "string", [])]


def read_rate(config: YamlReader, key: str = "update_rate", default: float = math.inf) -> float:
    """Reads a rate [Hz]; infinity is allowed.

    Raises:
        YamlError: It is no number, negative or NaN.
    """
    return read_not_negative(config, key, default)


def read_not_negative(config: YamlReader, key: str, default: float) -> float:
    """Reads a number of at least 0; infinity is allowed.

    Raises:
        YamlError: It is no number, negative or NaN.
    """
    return config.get(key, "float", default, minimum=0)


def read_finite(config: YamlReader, key: str, default: float) -> float:
    """Reads a finite number.

    Raises:
        YamlError: It is no number, infinite or NaN.
    """
    return config.get(key, "float", default, finite=True)


def read_pose(config: YamlReader, key: str, default: Pose = IDENTITY) -> Pose:
    """Reads a pose (x, y, theta) of finite numbers.

    Raises:
        YamlError: It is no pose, or a number is infinite, NaN or beyond `MAX_COORDINATE`.
    """
    return config.get(
        key, "pose", default, finite=True, minimum=-MAX_COORDINATE, maximum=MAX_COORDINATE
    )


def read_variances(config: YamlReader, key: str) -> Triple:
    """Reads three variances of noise, 0 when left out.

    Raises:
        YamlError: There are not three, or one is negative, infinite or NaN.
    """
    # Unlike the reference: a negative variance is an error.
    x, y, z = config.get_list(key, "float", [0.0, 0.0, 0.0], size=3, finite=True, minimum=0)
    return (x, y, z)


def read_covariance(config: YamlReader, key: str, default_diagonal: Sequence[float]) -> DoubleArray:
    """Reads a covariance matrix, row by row.

    It is reported, not used: a value such as -1 or a huge one has a meaning for who reads it.

    Args:
        config: The plugin's parameters.
        key: The parameter.
        default_diagonal: What the diagonal is when the parameter is left out; its length n is
            that of a row.

    Returns:
        Shape (n, n), read-only, as many messages share it.

    Raises:
        YamlError: There are not n² numbers, or one is NaN.
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
    """Places the variances of x, y and yaw on the diagonal of x, y, z, roll, pitch, yaw."""
    x, y, yaw = variances
    return [x, y, 0.0, 0.0, 0.0, yaw]
