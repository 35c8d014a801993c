"""The private parameters of the node, read once and checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from flatland.defaults import (
    DEFAULT_RESOLUTION,
    IF_BLOCKED,
    MAX_LAG,
    WEB_HOST,
    WEB_PORT,
    IfBlocked,
)
from flatland.ros.message_types import MESSAGE_PACKAGES, OWN_PACKAGE
from flatland.ros.shutdown import DEFAULT_SHUTDOWN_TIMEOUT
from flatland.timekeeper import MAX_STEP_SIZE, MIN_STEP_SIZE

W = TypeVar("W", bound=str)
ParameterSource = Callable[[str], object]
"""Returns the value of a parameter, None if it is not set."""

NO_WORLD_PATH = "No world_path parameter given!"
_SIMPLIFICATIONS = (0, 1, 2)


class ParameterError(Exception):
    """A parameter of the node is missing or invalid; the text names it and its value."""


@dataclass(frozen=True, slots=True)
class WebParameters:
    """The parameters of the viewer in the browser.

    Attributes:
        host: Address that the viewer listens on.
        port: Its port, 0 for any free one.
        token: Text that its address must contain; None for none, or for a random one if `host` can
            be reached from other machines.
        read_only: Whether the page only displays the world.
    """

    host: str
    port: int
    token: str | None
    read_only: bool


@dataclass(frozen=True, slots=True)
class NodeParameters:
    """The parameters of the node.

    Attributes:
        world_path: The world file.
        update_rate: Steps per second of wall time [Hz]; 0 for as many as possible.
        max_lag: Limit of the lost wall time that is made up for [s]; 0 for one cycle.
        step_size: Simulated time of one step [s].
        lockstep: Whether time passes only on request.
        show_viz: Whether debug markers are published.
        viz_pub_rate: Rate of the debug markers in wall time [Hz].
        simplify_map: 0 exact, 1 simplified, 2 opened and simplified map boundaries.
        seed: Seed of all random numbers; None draws one.
        benchmark_duration: Simulated time after which the node logs its speed and ends [s]; None
            for no end.
        plugin_timeout: Limit of wall time of `on_initialize` of a plugin [s]; None for no limit.
        shutdown_timeout: Limit of wall time between a stop request and the end of the process [s];
            None for no limit.
        if_blocked: Behaviour of `spawn_model` and `move_model` at poses that are not free.
        move_keeps_odometry: Whether the odometry of a model that is moved by a service or by its
            interactive marker continues as if it had not moved.
        initialpose_model: Name of the model that messages on `initialpose` move; empty for none.
        record: The recording to write, from which the run can be repeated; empty for none.
        record_mcap: The MCAP file to write, with all messages; empty for none.
        use_sim_time: Whether `/clock` is published and stamps are simulated times; otherwise they
            are wall times.
        clock_rate: Maximum rate of `/clock` in wall time [Hz]; 0 for one message per step.
        model_states_rate: Rate of the topic `model_states` in simulated time [Hz]; 0 for one
            message per step.
        publish_map: Name of the layer that is published as a map; empty for that of the world file,
            None for no map.
        map_frame: Frame of the map.
        map_resolution: Size of a cell of the map of a layer without an image [m].
        msgs_package: Package of the message and service types, `flatland` or `flatland_msgs`.
        model_path: Folders outside which `spawn_model` reads no file; None for no restriction.
        web: The viewer in the browser; None for no such viewer.
    """

    world_path: str
    update_rate: float
    max_lag: float
    step_size: float
    lockstep: bool
    show_viz: bool
    viz_pub_rate: float
    simplify_map: int
    seed: int | None
    benchmark_duration: float | None
    plugin_timeout: float | None
    shutdown_timeout: float | None
    if_blocked: IfBlocked
    move_keeps_odometry: bool
    initialpose_model: str
    record: str
    record_mcap: str
    use_sim_time: bool
    clock_rate: float
    model_states_rate: float
    publish_map: str | None
    map_frame: str
    map_resolution: float
    msgs_package: str
    model_path: tuple[str, ...] | None
    web: WebParameters | None


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
    reader = _Reader(get)
    if reader.boolean("lockstep", False) and get("benchmark_duration") is not None:
        raise ParameterError(
            'Invalid parameter "~lockstep": it must be false with "~benchmark_duration", because '
            "time passes only on request"
        )
    return NodeParameters(
        world_path=reader.path("world_path"),
        update_rate=reader.rate("update_rate", 200.0),
        max_lag=reader.lag("max_lag", MAX_LAG),
        step_size=reader.step_size("step_size", 0.005),
        lockstep=reader.boolean("lockstep", False),
        show_viz=reader.boolean("show_viz", False),
        viz_pub_rate=reader.positive("viz_pub_rate", 30.0),
        simplify_map=reader.choice("simplify_map", 0, _SIMPLIFICATIONS),
        seed=reader.natural("seed"),
        benchmark_duration=reader.optional_positive("benchmark_duration"),
        plugin_timeout=reader.timeout("plugin_timeout", 60.0),
        shutdown_timeout=reader.timeout("shutdown_timeout", DEFAULT_SHUTDOWN_TIMEOUT),
        if_blocked=reader.word("if_blocked", "warn", IF_BLOCKED, "one of " + ", ".join(IF_BLOCKED)),
        move_keeps_odometry=reader.boolean("move_keeps_odometry", False),
        initialpose_model=reader.name("initialpose_model"),
        record=reader.file("record"),
        record_mcap=reader.file("record_mcap"),
        use_sim_time=reader.boolean("use_sim_time", True),
        clock_rate=reader.rate("clock_rate", 0.0, unlimited="one message per step"),
        model_states_rate=reader.rate("model_states_rate", 50.0, "one message per step"),
        publish_map=reader.optional_name("publish_map"),
        map_frame=reader.frame("map_frame", "map"),
        map_resolution=reader.finite_positive("map_resolution", DEFAULT_RESOLUTION),
        msgs_package=reader.word(
            "msgs_package", default_msgs_package, MESSAGE_PACKAGES, " or ".join(MESSAGE_PACKAGES)
        ),
        model_path=reader.folders("model_path"),
        web=_read_web(reader),
    )


def _read_web(reader: _Reader) -> WebParameters | None:
    """Reads the parameters of the viewer in the browser, which are checked in any case."""
    parameters = WebParameters(
        host=reader.name("web_host", "the address of an interface, or its name") or WEB_HOST,
        port=reader.port("web_port", WEB_PORT),
        token=reader.name("web_token", "a text") or None,
        read_only=reader.boolean("web_read_only", False),
    )
    return parameters if reader.boolean("web", False) else None


@dataclass(frozen=True, slots=True)
class TeleopParameters:
    """The parameters of the node `teleop_key`.

    Attributes:
        max_linear: Maximum velocity [m/s].
        max_angular: Maximum angular velocity [rad/s].
        rate: Rate of the commands while a key is held [Hz].
        repeat_delay: Time from a press to the first repetition of the terminal [s].
        key_timeout: Time after a repetition in which the next one is expected [s].
    """

    max_linear: float
    max_angular: float
    rate: float
    repeat_delay: float
    key_timeout: float


def read_teleop_parameters(get: ParameterSource) -> TeleopParameters:
    """Reads and checks all parameters of the node `teleop_key`.

    Args:
        get: Returns the value of a parameter of the node, None if it is not set.

    Raises:
        ParameterError: A parameter is invalid.
    """
    reader = _Reader(get)
    return TeleopParameters(
        max_linear=reader.finite_positive("max_linear", 1.0),
        max_angular=reader.finite_positive("max_angular", 2.0),
        rate=reader.finite_positive("rate", 20.0),
        repeat_delay=reader.finite_positive("repeat_delay", 0.6),
        key_timeout=reader.finite_positive("key_timeout", 0.2),
    )


class _Reader:
    """Converts and checks one parameter at a time."""

    def __init__(self, get: ParameterSource) -> None:
        self._get = get

    def path(self, name: str) -> str:
        value = self._get(name)
        if value is None or value == "":
            raise ParameterError(NO_WORLD_PATH)
        if not isinstance(value, str):
            raise _invalid(name, "the path of a world file", value)
        return value

    def rate(self, name: str, default: float, unlimited: str = "as fast as possible") -> float:
        wanted = f"a number of Hz that is not negative (0 or inf: {unlimited})"
        rate = self._number(name, default, wanted, lambda rate: rate >= 0)
        return 0.0 if math.isinf(rate) else rate

    def lag(self, name: str, default: float) -> float:
        wanted = "a finite number of seconds that is not negative"
        return self._number(name, default, wanted, lambda seconds: 0 <= seconds < math.inf)

    def step_size(self, name: str, default: float) -> float:
        wanted = f"a number of seconds from {MIN_STEP_SIZE:g} to {MAX_STEP_SIZE:g}"
        return self._number(
            name, default, wanted, lambda size: MIN_STEP_SIZE <= size <= MAX_STEP_SIZE
        )

    def positive(self, name: str, default: float) -> float:
        return self._number(name, default, "a positive number", lambda number: number > 0)

    def finite_positive(self, name: str, default: float) -> float:
        wanted = "a positive, finite number"
        return self._number(name, default, wanted, lambda number: 0 < number < math.inf)

    def optional_positive(self, name: str) -> float | None:
        return None if self._get(name) is None else self.positive(name, 0.0)

    def timeout(self, name: str, default: float) -> float | None:
        wanted = "a positive number of seconds (inf: no limit)"
        seconds = self._number(name, default, wanted, lambda seconds: seconds > 0)
        return None if math.isinf(seconds) else seconds

    def boolean(self, name: str, default: bool) -> bool:
        value = self._get(name)
        if value is None:
            return default
        if isinstance(value, bool):
            return value
        if isinstance(value, str) and value.lower() in ("true", "false"):
            return value.lower() == "true"
        raise _invalid(name, "true or false", value)

    def choice(self, name: str, default: int, choices: tuple[int, ...]) -> int:
        wanted = "one of " + ", ".join(map(str, choices))
        value = self._integer(name, wanted)
        if value is None:
            return default
        if value not in choices:
            raise _invalid(name, wanted, value)
        return value

    def port(self, name: str, default: int) -> int:
        wanted = "a port number from 0 (any free port) to 65535"
        value = self._integer(name, wanted)
        if value is None:
            return default
        if not 0 <= value <= 65535:
            raise _invalid(name, wanted, value)
        return value

    def word(self, name: str, default: W, words: Sequence[W], wanted: str) -> W:
        """Reads one of several words."""
        value = self._get(name)
        if value is None:
            return default
        for word in words:
            if value == word:
                return word
        raise _invalid(name, wanted, value)

    def name(self, name: str, wanted: str = "a name") -> str:
        """Reads a name; empty by default. rosrun passes a name of digits as a number."""
        value = self._get(name)
        if value is None:
            return ""
        if isinstance(value, bool) or not isinstance(value, (str, int)):
            raise _invalid(name, wanted, value)
        return str(value).strip()

    def file(self, name: str) -> str:
        """Reads the path of a file to write; empty by default, otherwise absolute."""
        value = self._get(name)
        if value is None:
            return ""
        if not isinstance(value, str):
            raise _invalid(name, "the path of a file", value)
        path = value.strip()
        return str(Path(path).expanduser().absolute()) if path else ""

    def optional_name(self, name: str) -> str | None:
        """Reads a name; empty by default, None for false."""
        value = self._get(name)
        return None if value is False else self.name(name, "the name of a layer, or false")

    def frame(self, name: str, default: str) -> str:
        value = self._get(name)
        if value is None:
            return default
        if not isinstance(value, str) or not value.strip(" /"):
            raise _invalid(name, "the name of a frame", value)
        return value.strip().lstrip("/")

    def folders(self, name: str) -> tuple[str, ...] | None:
        """Reads a list of absolute folders, or a text with colons between them; empty for none."""
        wanted = "a list of existing folders with absolute paths, or a text with colons in between"
        value = self._get(name)
        if value is None or (isinstance(value, str) and not value.strip()):
            return None
        folders = value.strip().split(":") if isinstance(value, str) else value
        if not isinstance(folders, list) or not folders:
            raise _invalid(name, wanted, value)
        for folder in folders:
            # The node is started in ~/.ros, so that relative paths would be surprising.
            path = Path(folder) if isinstance(folder, str) else Path()
            if not (path.is_absolute() and path.is_dir()):
                raise _invalid(name, wanted, value)
        return tuple(folders)

    def natural(self, name: str) -> int | None:
        wanted = "an integer that is not negative"
        if self._get(name) == "":
            return None  # The launch argument is empty.
        value = self._integer(name, wanted)
        if value is not None and value < 0:
            raise _invalid(name, wanted, value)
        return value

    def _number(
        self, name: str, default: float, wanted: str, is_valid: Callable[[float], bool]
    ) -> float:
        """Reads a number that may be infinite; roslaunch passes `inf` and `1e3` as text."""
        value = self._get(name)
        if value is None:
            return default
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise _invalid(name, wanted, value)
        try:
            number = float(value)
        except (ValueError, OverflowError):
            raise _invalid(name, wanted, value) from None
        if math.isnan(number):
            raise _invalid(name, wanted, value)
        if not is_valid(number):
            raise _invalid(name, wanted, number)
        return number

    def _integer(self, name: str, wanted: str) -> int | None:
        """Reads an integer; one that is too large for XML-RPC is passed as text."""
        value = self._get(name)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, (int, str)):
            raise _invalid(name, wanted, value)
        try:
            return int(value)
        except ValueError:
            raise _invalid(name, wanted, value) from None


def _invalid(name: str, wanted: str, value: object) -> ParameterError:
    return ParameterError(f'Invalid parameter "~{name}": it must be {wanted}, got {value!r}')
