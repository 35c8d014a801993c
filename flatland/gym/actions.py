"""Actions: numbers from -1 to 1 that are scaled to commands, or the index of a command."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeVar

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import InvalidAction

from flatland.checks import checked_positive, plain_numbers, shown
from flatland.errors import WorldError
from flatland.geometry import DoubleArray, FloatArray
from flatland.plugin_api.body_drive import BodyDrive
from flatland.plugins.ackermann_drive import AckermannDrive
from flatland.plugins.tricycle_drive import TricycleDrive

if TYPE_CHECKING:
    from flatland.gym.agents import Agent

A = TypeVar("A", DoubleArray, FloatArray)
Bounds = tuple[DoubleArray, DoubleArray]

DEFAULT_SPEED: Final = 1.0  # m/s, for a drive without a limit
DEFAULT_YAW_RATE: Final = 2.0  # rad/s
DEFAULT_STEERING_ANGLE: Final = math.pi / 4  # rad


class Action(ABC):
    """Commands of an agent, each of which is some numbers between two bounds.

    Attributes:
        columns: What the numbers of a command are: 0 for the forward velocity, 1 for the sideways
            velocity, 2 for the yaw rate or the steering angle.
    """

    columns: tuple[int, ...]

    @property
    @abstractmethod
    def space(self) -> spaces.Space[Any]:
        """The space of one action."""

    @abstractmethod
    def bounds(self, agent: Agent) -> Bounds:
        """Returns the lowest and the highest command of an agent, shape (len(columns),) each.

        Raises:
            WorldError: The drive does not take such commands.
        """

    @abstractmethod
    def velocity_limits(self, agent: Agent) -> DoubleArray:
        """Returns the greatest velocities (forward, sideways, yaw rate) [m/s, rad/s], shape (3,).

        They are the units in which velocities are observed.
        """

    @abstractmethod
    def read(self, actions: object, n: int | None, low: DoubleArray, high: DoubleArray) -> Any:
        """Returns actions as numbers from -1, the lowest command, to 1, the highest one.

        Args:
            actions: One action, or one for each agent.
            n: Number of agents; None for one action.
            low: The lowest command.
            high: The highest command.

        Returns:
            Numbers, shape (n, len(columns)), or (1, len(columns)) for one action, float64.

        Raises:
            InvalidAction: The actions are not elements of the space.
        """


class _ContinuousAction(Action):
    """Numbers from -1 to 1, the lowest and the highest command."""

    @property
    def space(self) -> spaces.Box:
        """The space of one action."""
        return spaces.Box(-1.0, 1.0, (len(self.columns),), np.float32)

    def read(
        self, actions: object, n: int | None, low: DoubleArray, high: DoubleArray
    ) -> DoubleArray:
        """Returns the actions, each number limited to [-1, 1]; see `Action.read`."""
        del low, high
        return checked_actions(actions, n, len(self.columns))


class VelocityAction(_ContinuousAction):
    """Two numbers from -1 to 1: forward speed and yaw rate.

    -1 is the lowest and 1 the highest speed; -1 turns to the right and 1 to the left at the highest
    yaw rate. Numbers beyond the bounds are limited to them.
    """

    columns: ClassVar[tuple[int, ...]] = (0, 2)  # type: ignore[misc]

    def __init__(
        self, speed: tuple[float, float] | None = None, yaw_rate: float | None = None
    ) -> None:
        """Creates the action.

        Args:
            speed: Lowest and highest forward speed [m/s]; None for 0 and the limit of the drive.
            yaw_rate: Highest yaw rate [rad/s]; None for the limit of the drive. For a drive without
                limits, they are 1 m/s and 2 rad/s.

        Raises:
            ValueError: A number is out of range.
        """
        self.speed = _checked_speeds(speed)
        self.yaw_rate = _checked_limit("yaw_rate", yaw_rate, "rad/s")

    def bounds(self, agent: Agent) -> Bounds:
        """Returns the commands (v, omega) of the actions (-1, -1) and (1, 1).

        Raises:
            WorldError: The drive takes steering angles.
        """
        if isinstance(agent.drive, BodyDrive) and agent.drive.takes_steering:
            raise WorldError(
                f'the drive of model "{agent.model.name}" takes steering angles: use '
                'SteeringAction, or "command: twist" in the model file'
            )
        slowest, fastest = self.speed or (0.0, agent.max_speed or DEFAULT_SPEED)
        turn = _yaw_rate(self.yaw_rate, agent)
        return np.array([slowest, -turn]), np.array([fastest, turn])

    def velocity_limits(self, agent: Agent) -> DoubleArray:
        """Returns the greatest velocities that can be commanded."""
        speed, turn = np.abs(self.bounds(agent)).max(axis=0)
        return np.array([speed, speed, turn])


class HolonomicAction(_ContinuousAction):
    """Three numbers from -1 to 1: forward and sideways velocity, and yaw rate; for OmniDrive.

    -1 drives backwards, to the right, and turns to the right.
    """

    columns: ClassVar[tuple[int, ...]] = (0, 1, 2)  # type: ignore[misc]

    def __init__(self, speed: float | None = None, yaw_rate: float | None = None) -> None:
        """Creates the action.

        Args:
            speed: Highest velocity along each axis [m/s]; None for the limit of the drive.
            yaw_rate: Highest yaw rate [rad/s]; None for the limit of the drive. For a drive without
                limits, they are 1 m/s and 2 rad/s.

        Raises:
            ValueError: A number is out of range.
        """
        self.speed = _checked_limit("speed", speed, "m/s")
        self.yaw_rate = _checked_limit("yaw_rate", yaw_rate, "rad/s")

    def bounds(self, agent: Agent) -> Bounds:
        """Returns the commands (vx, vy, omega) of the lowest and the highest action.

        Raises:
            WorldError: The drive does not move sideways.
        """
        if isinstance(agent.drive, BodyDrive) and not agent.drive.is_holonomic:
            raise WorldError(
                f'HolonomicAction requires an OmniDrive; model "{agent.model.name}" has a '
                f"{type(agent.drive).__name__}"
            )
        speed = self.speed or agent.max_speed or DEFAULT_SPEED
        high = np.array([speed, speed, _yaw_rate(self.yaw_rate, agent)])
        return -high, high

    def velocity_limits(self, agent: Agent) -> DoubleArray:
        """Returns the greatest velocities that can be commanded."""
        return self.bounds(agent)[1]


class SteeringAction(_ContinuousAction):
    """Two numbers from -1 to 1: speed and steering angle; for TricycleDrive and AckermannDrive.

    The drive must have the parameter `command: steering`. -1 is the lowest and 1 the highest speed;
    -1 steers to the right and 1 to the left.
    """

    columns: ClassVar[tuple[int, ...]] = (0, 2)  # type: ignore[misc]

    def __init__(
        self, speed: tuple[float, float] | None = None, angle: float | None = None
    ) -> None:
        """Creates the action.

        Args:
            speed: Lowest and highest speed of the driven wheel or axle [m/s]; None for 0 and the
                limit of the drive, or 1 m/s.
            angle: Greatest steering angle [rad]; None for the limit of the drive, or pi / 4.

        Raises:
            ValueError: A number is out of range.
        """
        self.speed = _checked_speeds(speed)
        self.angle = _checked_limit("angle", angle, "rad")

    def bounds(self, agent: Agent) -> Bounds:
        """Returns the commands (speed, steering angle) of the actions (-1, -1) and (1, 1).

        Raises:
            WorldError: The drive takes no steering angles.
        """
        drive = _steered_drive(agent)
        slowest, fastest = self.speed or (0.0, agent.max_speed or DEFAULT_SPEED)
        angle = self.angle or drive.max_steer_angle or DEFAULT_STEERING_ANGLE
        return np.array([slowest, -angle]), np.array([fastest, angle])

    def velocity_limits(self, agent: Agent) -> DoubleArray:
        """Returns the greatest speed, and the yaw rate at this speed and the greatest angle."""
        drive = _steered_drive(agent)
        speed, angle = np.abs(self.bounds(agent)).max(axis=0)
        # A tricycle drives the wheel that is steered, and a car the other axle.
        is_tricycle = isinstance(drive, TricycleDrive)
        slope = math.sin(min(angle, math.pi / 2)) if is_tricycle else math.tan(angle)
        return np.array([speed, speed, speed * slope / drive.geometry.wheelbase])


class DiscreteAction(Action):
    """The index of one of several commands, such as for deep Q-learning."""

    def __init__(self, commands: Sequence[Sequence[float]], kind: Action | None = None) -> None:
        """Creates the action.

        Args:
            commands: The commands that actions 0, 1, 2, … stand for, such as velocities (v, omega)
                [m/s, rad/s]; shape (k, 2), or (k, 3) for a `HolonomicAction`.
            kind: What the commands are, with the bounds in which they must be; None for
                `VelocityAction()`.

        Raises:
            TypeError: `kind` is not a continuous action.
            ValueError: There are no commands, or they are not rows of finite numbers.
        """
        kind = VelocityAction() if kind is None else kind
        if not isinstance(kind, _ContinuousAction):
            raise TypeError(f"kind must be a continuous action, got {shown(kind)}")
        self.kind = kind
        self.columns = kind.columns
        expected = (
            f"commands must be rows of {len(self.columns)} finite numbers, got {shown(commands)}"
        )
        try:
            self.commands: DoubleArray = np.array(commands, np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(expected) from error
        shape = self.commands.shape
        if len(shape) != 2 or shape[0] < 1 or shape[1] != len(self.columns):
            raise ValueError(expected)
        if not np.isfinite(self.commands).all():
            raise ValueError(expected)

    @property
    def space(self) -> spaces.Discrete:
        """The space of one action."""
        return spaces.Discrete(len(self.commands))

    def bounds(self, agent: Agent) -> Bounds:
        """Returns the bounds of the commands.

        Raises:
            WorldError: A command is out of these bounds, or the drive takes no such commands.
        """
        low, high = self.kind.bounds(agent)
        is_outside = ((self.commands < low) | (self.commands > high)).any(axis=1)
        if is_outside.any():
            index = int(is_outside.argmax())
            raise WorldError(
                f"the command {self.commands[index].tolist()} of action {index} is not between "
                f"{low.tolist()} and {high.tolist()}, the bounds of {type(self.kind).__name__} for "
                f'the drive of model "{agent.model.name}"'
            )
        return low, high

    def velocity_limits(self, agent: Agent) -> DoubleArray:
        """Returns the limits of the kind of commands."""
        return self.kind.velocity_limits(agent)

    def read(
        self, actions: object, n: int | None, low: DoubleArray, high: DoubleArray
    ) -> DoubleArray:
        """Returns the commands of indices as numbers; see `Action.read`."""
        count, shape = len(self.commands), () if n is None else (n,)
        indices = _as_array(actions, shape, "iu", "integers")
        is_unknown = (indices < 0) | (indices >= count)
        if is_unknown.any():
            raise InvalidAction(
                f"actions must be integers from 0 to {count - 1}, got {shown(actions)}"
            )
        chosen = self.commands[indices.reshape(-1)]
        numbers: DoubleArray = 2.0 * (chosen - low) / (high - low) - 1.0
        return numbers


def checked_actions(actions: object, n: int | None, size: int) -> DoubleArray:
    """Returns actions within their bounds as an array.

    Args:
        actions: One action, or one for each agent.
        n: Number of agents; None for one action.
        size: Numbers of an action.

    Returns:
        The actions, each number limited to [-1, 1], shape (n, size), or (1, size) for one action.

    Raises:
        InvalidAction: The actions have another shape, or are not numbers, or are NaN.
    """
    given = _as_array(actions, (size,) if n is None else (n, size), "fiub", "numbers")
    array: DoubleArray = given.astype(np.float64)
    if np.isnan(array).any():
        raise InvalidAction(f"actions must not be NaN, got {_first_nan(array)}")
    return limit_to_unit(array).reshape(-1, size)


def limit_to_unit(numbers: A) -> A:
    """Limits numbers to [-1, 1] in place, and returns them; faster than `numpy.clip`."""
    np.maximum(numbers, -1.0, out=numbers)
    np.minimum(numbers, 1.0, out=numbers)
    return numbers


def _as_array(actions: object, shape: tuple[int, ...], kinds: str, what: str) -> npt.NDArray[Any]:
    """Returns actions as an array of a shape and of one of some kinds of types.

    Raises:
        InvalidAction: They have another shape or type.
    """
    try:
        given = np.asarray(actions)
    except ValueError as error:  # rows of different lengths
        raise InvalidAction(
            f"actions must be {what} of shape {shape}, got {shown(actions)}"
        ) from error
    # A conversion would read strings, and drop the imaginary part of complex numbers.
    if given.dtype.kind not in kinds:
        raise InvalidAction(f"actions must be {what} of shape {shape}, got {shown(actions)}")
    if given.shape != shape:
        raise InvalidAction(f"actions must have the shape {shape}, got {given.shape}")
    return given


def _first_nan(array: DoubleArray) -> str:
    if array.ndim == 1:
        return str(array.tolist())
    row = int(np.isnan(array).any(axis=1).argmax())
    return f"{array[row].tolist()} for agent {row}"


def _yaw_rate(limit: float | None, agent: Agent) -> float:
    return limit or agent.max_yaw_rate or DEFAULT_YAW_RATE


def _steered_drive(agent: Agent) -> TricycleDrive | AckermannDrive:
    drive = agent.drive
    if isinstance(drive, TricycleDrive | AckermannDrive) and drive.takes_steering:
        return drive
    raise WorldError(
        'SteeringAction requires a TricycleDrive or an AckermannDrive with "command: steering"; '
        f'model "{agent.model.name}" has none'
    )


def _checked_speeds(speed: tuple[float, float] | None) -> tuple[float, float] | None:
    if speed is None:
        return None
    numbers = plain_numbers(speed, (2,))
    if numbers is None or not (all(map(math.isfinite, numbers)) and numbers[0] < numbers[1]):
        raise ValueError(
            f"speed must be the lowest and the highest speed [m/s], got {shown(speed)}"
        )
    return (numbers[0], numbers[1])


def _checked_limit(name: str, value: float | None, unit: str) -> float | None:
    return None if value is None else checked_positive(name, value, unit)
