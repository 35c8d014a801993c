"""Checks of arguments of public functions.

Each function returns the argument as a plain value of Python, or raises an error whose text names
the argument, what is expected and the value found.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any, Final

import numpy as np

_MAX_SHOWN: Final = 100  # characters of a value in an error
_NO_NUMBERS: Final = (bool, np.bool_, str, bytes, bytearray, complex, np.complexfloating)


def shown(value: object) -> str:
    """Returns a value as a text of one line and at most about a hundred characters."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # such as an integer of more than 4300 digits
        return f"an object of type {type(value).__name__}"
    return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]}..."


def quoted(name: object) -> str:
    """Returns a name in double quotes, on one line and at most about a hundred characters long."""
    if not isinstance(name, str):
        return f'"{shown(name)}"'
    characters = (c if c.isprintable() else repr(c)[1:-1] for c in name[:_MAX_SHOWN])
    return f'"{"".join(characters)}{"..." if len(name) > _MAX_SHOWN else ""}"'


def checked_count(name: str, value: Any, least: int = 1, most: int | None = None) -> int:
    """Returns an integer of Python for an integer of any type.

    Args:
        name: Name of the number, for the error.
        value: The number.
        least: Its least value.
        most: Its greatest value, None for no limit.

    Raises:
        ValueError: It is no integer, too small or too large.
    """
    limits = f"of at least {least}"
    if not isinstance(value, bool | np.bool_):
        try:
            number = operator.index(value)
        except TypeError:
            number = least - 1
        if number >= least:
            if most is None or number <= most:
                return number
            limits = f"from {least} to {most}"
    raise ValueError(f"{name} must be an integer {limits}, got {shown(value)}")


def plain_number(value: Any) -> float:
    """Returns a real number of any type as a float, infinite if it is too large for one.

    Raises:
        TypeError: It is no number.
        ValueError: It is an object that cannot be converted.
    """
    if type(value) is float:
        return value
    if isinstance(value, _NO_NUMBERS) or (isinstance(value, np.ndarray) and value.ndim):
        raise TypeError(f"{type(value).__name__} is no number")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def checked_number(name: str, value: object, unit: str = "") -> float:
    """Returns a real number of any type as a float, which may be infinite or NaN.

    Args:
        name: Name of the number, for the error.
        value: The number.
        unit: Its unit, empty for none.

    Raises:
        ValueError: It is no number.
    """
    if type(value) is float:
        return value
    try:
        return plain_number(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number{_in(unit)}, got {shown(value)}") from None


def checked_finite(name: str, value: object, unit: str = "") -> float:
    """Returns a finite number as a float; see `checked_number`."""
    number = checked_number(name, value, unit)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite{_in(unit)}, got {shown(value)}")
    return number


def checked_range(name: str, value: object, least: float, most: float, unit: str = "") -> float:
    """Returns a number within two limits as a float; see `checked_number`."""
    number = checked_number(name, value, unit)
    if not least <= number <= most:
        unit = unit and f" {unit}"
        raise ValueError(f"{name} must be from {least:g} to {most:g}{unit}, got {shown(value)}")
    return number


def checked_limit(name: str, value: object, unit: str = "") -> float:
    """Returns a number of at least 0, which may be infinite, as a float; see `checked_number`."""
    number = checked_number(name, value, unit)
    if not number >= 0:
        raise ValueError(f"{name} must not be negative or NaN{_in(unit)}, got {shown(value)}")
    return number


def checked_positive(name: str, value: object, unit: str = "") -> float:
    """Returns a finite number above 0 as a float; see `checked_number`."""
    number = checked_number(name, value, unit)
    if not 0 < number < math.inf:
        raise ValueError(f"{name} must be positive{_in(unit)}, got {shown(value)}")
    return number


def checked_not_negative(name: str, value: object, unit: str = "") -> float:
    """Returns a finite number of at least 0 as a float; see `checked_number`."""
    number = checked_number(name, value, unit)
    if not 0 <= number < math.inf:
        raise ValueError(f"{name} must be finite and not negative{_in(unit)}, got {shown(value)}")
    return number


def plain_numbers(values: Any, sizes: Sequence[int]) -> tuple[float, ...] | None:
    """Returns real numbers as a tuple of floats, None if they are none, or not that many.

    Args:
        values: A list, tuple or array; the numbers may be infinite or NaN.
        sizes: Permitted numbers of them.
    """
    if isinstance(values, str | bytes | bytearray | Mapping | Set):
        return None
    try:
        numbers = tuple(map(plain_number, values))
    except (TypeError, ValueError):
        return None
    return numbers if len(numbers) in sizes else None


def checked_names(name: str, value: object) -> list[str]:
    """Returns names as a list.

    Args:
        name: Name of the argument, for the error.
        value: A name, or several.

    Raises:
        ValueError: It is neither.
    """
    if isinstance(value, str):
        return [value]
    if isinstance(value, Iterable):
        names = list(value)
        if all(isinstance(each, str) for each in names):
            return names
    raise ValueError(f"{name} must be a name or a list of names, got {shown(value)}")


def check_kind(name: str, value: object, kind: type[Any], what: str) -> None:
    """Checks the class of an argument.

    Args:
        name: Name of the argument, for the error.
        value: The argument.
        kind: The class.
        what: Description of the class, such as `a Reward`.

    Raises:
        TypeError: The argument is an object of another class.
    """
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be {what}, got {shown(value)}")


def check_function(name: str, value: object) -> None:
    """Checks that an argument can be called.

    Raises:
        TypeError: It cannot.
    """
    if not callable(value):
        raise TypeError(f"{name} must be a function, got {shown(value)}")


def check_choice(name: str, value: object, choices: Iterable[object]) -> None:
    """Checks that a value is one of several.

    Raises:
        ValueError: It is another one.
    """
    known = list(choices)
    if not any(type(value) is type(each) and value == each for each in known):
        raise ValueError(f"{name} must be one of {', '.join(map(str, known))}, got {shown(value)}")


def plain_path(name: str, value: object) -> str:
    """Returns a path, or a text that is given in place of one.

    Raises:
        ValueError: It is neither a text nor a path.
    """
    path = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(path, str):
        raise ValueError(f"{name} must be a path, got {shown(value)}")
    return path


def checked_path(name: str, value: object) -> str:
    """Returns a path.

    Raises:
        ValueError: It is neither a text nor a path, or contains a null character.
    """
    path = plain_path(name, value)
    if "\0" in path:
        raise ValueError(f"{name} must be a path without null characters, got {shown(value)}")
    return path


def checked_options(options: object, known: Iterable[str]) -> Mapping[str, Any]:
    """Returns the options of a reset, empty for None.

    Raises:
        ValueError: They are no dictionary, or one of them is unknown.
    """
    if options is None:
        return {}
    names = ", ".join(sorted(known))
    if not isinstance(options, Mapping):
        raise ValueError(f"options must be a dictionary with {names}, got {shown(options)}")
    unknown = [name for name in options if name not in known]
    if unknown:
        listed = ", ".join(sorted(map(str, unknown)))
        raise ValueError(f"options must be among {names}, got {listed}")
    return options


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
