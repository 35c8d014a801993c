"""The private parameters of the node: one table of names, types, defaults and meanings.

The table is `dataclasses.fields(NodeParameters)`; `meaning` describes a field.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from flatland.defaults import (
    DEFAULT_RESOLUTION,
    IF_BLOCKED,
    MAX_LAG,
    WEB_HOST,
    WEB_PORT,
    IfBlocked,
)
from flatland.node.shutdown import DEFAULT_SHUTDOWN_TIMEOUT
from flatland.timekeeper import MAX_STEP_SIZE, MIN_STEP_SIZE

P = TypeVar("P")
ParameterSource = Callable[[str], object]
"""Returns the value of a parameter, None if it is not set."""
Read = Callable[[Any], Any]
"""Checks and converts a value that is set; raises `_InvalidError`."""

Limits = tuple[int, int] | tuple[float, float] | None
"""Least and greatest valid number of a parameter; None for a parameter that is not a number."""

OWN_PACKAGE: Final = "flatland"
MESSAGE_PACKAGES: Final = (OWN_PACKAGE, "flatland_msgs")
"""Packages with the message and service types; the second one is the package of the reference."""
NO_WORLD_PATH: Final = "No world_path parameter given!"


class ParameterError(Exception):
    """A parameter of the node is missing or invalid; the text names it and its value."""


class _InvalidError(Exception):
    """A value is invalid.

    Attributes:
        wanted: Description of valid values.
        value: The value.
    """

    def __init__(self, wanted: str, value: object) -> None:
        super().__init__(wanted)
        self.wanted = wanted
        self.value = value


# -- types of parameters ----------------------------------------------------------------------


def _number(wanted: str, is_valid: Callable[[float], bool], *, infinite: Any = math.inf) -> Read:
    """Returns the reader of a number; roslaunch passes `inf` and `1e3` as text.

    Args:
        wanted: Description of valid numbers.
        is_valid: Whether a number is valid.
        infinite: What replaces infinity.
    """

    def read(value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise _InvalidError(wanted, value)
        try:
            number = float(value)
        except (ValueError, OverflowError):
            raise _InvalidError(wanted, value) from None
        if math.isnan(number):
            raise _InvalidError(wanted, value)
        if not is_valid(number):
            raise _InvalidError(wanted, number)
        return infinite if math.isinf(number) else number

    return read


def _rate(unlimited: str) -> Read:
    wanted = f"a number of Hz that is not negative (0 or inf: {unlimited})"
    return _number(wanted, lambda rate: rate >= 0, infinite=0.0)


_steps_per_second = _rate("as fast as possible")
_messages = _rate("one message per step")
_positive = _number("a positive number", lambda number: number > 0)
_finite_positive = _number("a positive, finite number", lambda number: 0 < number < math.inf)
_timeout = _number(
    "a positive number of seconds (inf: no limit)", lambda seconds: seconds > 0, infinite=None
)
_lag = _number(
    "a finite number of seconds that is not negative", lambda seconds: 0 <= seconds < math.inf
)
_step_size = _number(
    f"a number of seconds from {MIN_STEP_SIZE:g} to {MAX_STEP_SIZE:g}",
    lambda size: MIN_STEP_SIZE <= size <= MAX_STEP_SIZE,
)


def _integer(wanted: str, is_valid: Callable[[int], bool]) -> Read:
    """Returns the reader of an integer; one that is too large for XML-RPC is passed as text."""

    def read(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, (int, str)):
            raise _InvalidError(wanted, value)
        try:
            number = int(value)
        except ValueError:
            raise _InvalidError(wanted, value) from None
        if not is_valid(number):
            raise _InvalidError(wanted, number)
        return number

    return read


_natural = _integer("an integer that is not negative", lambda number: number >= 0)
_simplification = _integer("one of 0, 1, 2", lambda number: number in (0, 1, 2))
_port = _integer(
    "a port number from 0 (any free port) to 65535", lambda number: 0 <= number <= 65535
)


def _seed(value: Any) -> int | None:
    return None if value == "" else _natural(value)  # The launch argument is empty.


def _boolean(value: Any) -> bool:
    if isinstance(value, bool):
        return value
    if isinstance(value, str) and value.lower() in ("true", "false"):
        return value.lower() == "true"
    raise _InvalidError("true or false", value)


def _word(words: Sequence[str], separator: str = ", ", prefix: str = "one of ") -> Read:
    def read(value: Any) -> str:
        for word in words:
            if value == word:
                return word
        raise _InvalidError(prefix + separator.join(words), value)

    return read


_package = _word(MESSAGE_PACKAGES, " or ", "")


def _path(value: Any) -> str:
    if value == "":
        raise ParameterError(NO_WORLD_PATH)
    if not isinstance(value, str):
        raise _InvalidError("the path of a world file", value)
    return value


def _name(wanted: str = "a name", *, default: str | None = "") -> Read:
    """Returns the reader of a name; rosrun passes a name of digits as a number."""

    def read(value: Any) -> str | None:
        if isinstance(value, bool) or not isinstance(value, (str, int)):
            raise _InvalidError(wanted, value)
        return str(value).strip() or default

    return read


_address = _name("the address of an interface, or its name", default=WEB_HOST)
_token = _name("a text", default=None)
_layer_name = _name("the name of a layer, or false")


def _layer(value: Any) -> str | None:
    return None if value is False else _layer_name(value)


def _file(value: Any) -> str:
    """Reads the path of a file to write; empty, or absolute."""
    if not isinstance(value, str):
        raise _InvalidError("the path of a file", value)
    path = value.strip()
    return str(Path(path).expanduser().absolute()) if path else ""


def _frame(value: Any) -> str:
    if not isinstance(value, str) or not value.strip(" /"):
        raise _InvalidError("the name of a frame", value)
    return value.strip().lstrip("/")


def _folders(value: Any) -> tuple[str, ...] | None:
    """Reads a list of absolute folders, or a text with colons between them; empty for none."""
    wanted = "a list of existing folders with absolute paths, or a text with colons in between"
    if isinstance(value, str) and not value.strip():
        return None
    folders = value.strip().split(":") if isinstance(value, str) else value
    if not isinstance(folders, list) or not folders:
        raise _InvalidError(wanted, value)
    for folder in folders:
        # The node is started in ~/.ros, so that relative paths would be surprising.
        path = Path(folder) if isinstance(folder, str) else Path()
        if not (path.is_absolute() and path.is_dir()):
            raise _InvalidError(wanted, value)
    return tuple(folders)


# -- the tables -------------------------------------------------------------------------------


_UNLIMITED: Final = (0.0, math.inf)
_MAX_INTEGER: Final = 2**63 - 1


def _row(read: Read, default: Any, meaning: str, limits: Limits = None) -> Any:
    """Describes a parameter.

    Args:
        read: Checks and converts a value.
        default: The value of a parameter that is not set.
        meaning: Description for users.
        limits: Least and greatest valid number, if there are any.
    """
    metadata = {"read": read, "meaning": meaning, "limits": limits}
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True, slots=True)
class NodeParameters:
    """The parameters of the node."""

    world_path: str = _row(_path, "", "World file.")
    update_rate: float = _row(
        _steps_per_second, 200.0, "Steps per second of wall time [Hz].", _UNLIMITED
    )
    max_lag: float = _row(
        _lag, MAX_LAG, "Limit of the lag that is made up for [s]; 0: one cycle.", _UNLIMITED
    )
    step_size: float = _row(
        _step_size, 0.005, "Simulated time of one step [s].", (MIN_STEP_SIZE, MAX_STEP_SIZE)
    )
    lockstep: bool = _row(_boolean, False, "Whether time passes only on request.")
    show_viz: bool = _row(_boolean, False, "Whether debug markers are published.")
    viz_pub_rate: float = _row(
        _positive, 30.0, "Rate of the debug markers in wall time [Hz].", _UNLIMITED
    )
    simplify_map: int = _row(
        _simplification, 0, "0 exact, 1 simplified, 2 opened and simplified.", (0, 2)
    )
    seed: int | None = _row(
        _seed, None, "Seed of all random numbers; None: a random one.", (0, _MAX_INTEGER)
    )
    benchmark_duration: float | None = _row(
        _positive,
        None,
        "Simulated time after which the node logs its speed and ends [s].",
        _UNLIMITED,
    )
    plugin_timeout: float | None = _row(
        _timeout,
        60.0,
        "Limit of wall time of `on_initialize` of a plugin [s]; None: no limit.",
        _UNLIMITED,
    )
    shutdown_timeout: float | None = _row(
        _timeout,
        DEFAULT_SHUTDOWN_TIMEOUT,
        "Limit of wall time from a stop request to the end [s].",
        _UNLIMITED,
    )
    if_blocked: IfBlocked = _row(  # noqa: RUF009 - a field
        _word(IF_BLOCKED), "warn", "Behaviour of spawns and moves at poses that are not free."
    )
    move_keeps_odometry: bool = _row(
        _boolean, False, "Whether services and handles move models without a jump of odometry."
    )
    initialpose_model: str = _row(_name(), "", "Model that messages on `initialpose` move, if any.")
    record: str = _row(_file, "", "Recording to write, which can be repeated; empty: none.")
    record_mcap: str = _row(_file, "", "MCAP file to write, with all messages; empty: none.")
    use_sim_time: bool = _row(
        _boolean, True, "Whether `/clock` is published and stamps are not wall times."
    )
    clock_rate: float = _row(
        _messages, 0.0, "Rate of `/clock` in wall time [Hz]; 0: each step.", _UNLIMITED
    )
    model_states_rate: float = _row(
        _messages, 50.0, "Rate of `model_states` in simulated time [Hz]; 0: each step.", _UNLIMITED
    )
    publish_map: str | None = _row(
        _layer, "", "Layer that is published as a map; empty: that of the world file, None: none."
    )
    map_frame: str = _row(_frame, "map", "Frame of the map.")
    map_resolution: float = _row(
        _finite_positive,
        DEFAULT_RESOLUTION,
        "Cell size of the map of a layer without image [m].",
        _UNLIMITED,
    )
    msgs_package: str = _row(_package, OWN_PACKAGE, "Package of the message and service types.")
    model_path: tuple[str, ...] | None = _row(
        _folders, None, "Folders outside which `spawn_model` reads no file; None: any."
    )
    web: bool = _row(_boolean, False, "Whether the viewer in the browser is started.")
    web_host: str = _row(_address, WEB_HOST, "Address that the viewer in the browser listens on.")
    web_port: int = _row(
        _port, WEB_PORT, "Port of the viewer in the browser; 0: any free one.", (0, 65535)
    )
    web_token: str | None = _row(
        _token, None, "Text that the address of the viewer must contain; None: see docs/viewer.md."
    )
    web_view_token: str | None = _row(
        _token,
        None,
        "Text in the address of viewers, who cannot change the world; None: none.",
    )
    web_read_only: bool = _row(_boolean, False, "Whether the page only displays the world.")


@dataclass(frozen=True, slots=True)
class Ros2Parameters:
    """The parameters that the node has in ROS 2 only."""

    enable_stamped_cmd_vel: bool = _row(
        _boolean, False, "Whether velocity commands are `geometry_msgs/TwistStamped`, as in Nav2."
    )
    reliable_sensors: bool = _row(
        _boolean, False, "Whether measurements of sensors are published reliably."
    )


@dataclass(frozen=True, slots=True)
class TeleopParameters:
    """The parameters of the node `teleop_key`."""

    max_linear: float = _row(_finite_positive, 1.0, "Maximum velocity [m/s].")
    max_angular: float = _row(_finite_positive, 2.0, "Maximum angular velocity [rad/s].")
    rate: float = _row(_finite_positive, 20.0, "Rate of commands while a key is held [Hz].")
    repeat_delay: float = _row(_finite_positive, 0.6, "Time to the first repetition of a key [s].")
    key_timeout: float = _row(_finite_positive, 0.2, "Time to the next repetition of a key [s].")


def read_table(table: type[P], get: ParameterSource) -> P:
    """Reads and checks all parameters of a table.

    Args:
        table: One of the tables of this module.
        get: Returns the value of a parameter of the node, None if it is not set.

    Raises:
        ParameterError: A parameter is invalid.
    """
    found = {}
    for field in dataclasses.fields(table):  # type: ignore[arg-type]
        value = get(field.name)
        if value is None:
            continue
        try:
            found[field.name] = field.metadata["read"](value)
        except _InvalidError as error:
            raise ParameterError(
                f'Invalid parameter "~{field.name}": it must be {error.wanted}, got {error.value!r}'
            ) from None
    return table(**found)


def read_parameters(
    get: ParameterSource, *, default_msgs_package: str = OWN_PACKAGE
) -> NodeParameters:
    """Reads and checks all parameters of the node.

    Args:
        get: Returns the value of a parameter of the node, None if it is not set.
        default_msgs_package: Default of `msgs_package`.

    Raises:
        ParameterError: A parameter is missing or invalid.
    """
    defaults = {"world_path": "", "msgs_package": default_msgs_package}

    def get_or_default(name: str) -> object:
        value = get(name)
        return defaults.get(name) if value is None else value

    parameters = read_table(NodeParameters, get_or_default)
    if parameters.lockstep and parameters.benchmark_duration is not None:
        raise ParameterError(
            'Invalid parameter "~lockstep": it must be false with "~benchmark_duration", because '
            "time passes only on request"
        )
    return parameters
