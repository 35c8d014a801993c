"""The interface of controllers, the included ones, and how they are found.

A controller is a class with two methods:

- `__init__(self, task)`, called once per episode with a `Task`. It may look at the world, for
  example to plan a path, but must not change it.
- `command(self, scan, pose, goal)`, called once per period with the current `Scan`, the pose
  (x, y, theta) of the robot and the goal (x, y), both in the world frame [m, rad]. It returns a
  `flatland.Twist`: linear_x [m/s] and angular_z [rad/s] of the robot.

An episode must depend only on its seed: random numbers come from `task.rng`, and classes have no
state that survives an episode.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from flatland import Twist
from flatland_sweep.cells import SweepError

if TYPE_CHECKING:
    from types import ModuleType

    from flatland import Model, World
    from flatland.geometry import DoubleArray, Pose, Vector2


@dataclass(frozen=True, slots=True)
class Task:
    """What a controller has to do, and with which robot.

    Attributes:
        world: The world; only for queries.
        robot: The model to be driven.
        radius: Radius of the circle about the origin of the robot that contains it [m].
        category_bits: Categories of the obstacles that the robot collides with.
        goal: Goal (x, y) in the world frame [m].
        period: Time between two commands [s].
        max_speed: Limit of the speed [m/s]; commands above it are reduced.
        max_turn: Limit of the yaw rate [rad/s].
        rng: Random numbers that derive from the seed of the cell.
    """

    world: World
    robot: Model
    radius: float
    category_bits: int
    goal: Vector2
    period: float
    max_speed: float
    max_turn: float
    rng: np.random.Generator


@dataclass(frozen=True, slots=True)
class Scan:
    """A laser scan, with the noise of the laser.

    Attributes:
        ranges: Range of each beam [m], shape (n,); `max_range` for a beam without a hit, 0 for a
            hit that is too close.
        max_range: Length of a beam [m].
        points: Hits in the frame of the robot [m], shape (k, 2).
    """

    ranges: DoubleArray
    max_range: float
    points: DoubleArray


class Controller(Protocol):
    """A controller; see the description of the module."""

    def __init__(self, task: Task) -> None:
        """Prepares an episode."""

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the velocities until the next call."""


class FollowGap:
    """Drives straight towards the goal, or into the open direction that is closest to it.

    It has neither a map nor a memory: dead ends on the way to the goal trap it.
    """

    _MARGIN: Final = 0.1  # distance to the sides of a gap [m]
    _LOOKAHEAD: Final = 2.5  # [m]
    _WIDEST: Final = math.radians(115)  # change of direction, within the view of a usual scanner
    _DIRECTIONS: Final = 93  # candidates, 2.5 degrees apart
    _PERSISTENCE: Final = 0.3  # cost of a change of direction, relative to a deviation
    _DECELERATION: Final = 0.8  # assumed ability of the robot to brake [m/s^2]

    def __init__(self, task: Task) -> None:
        """Starts without a preferred direction."""
        self._task = task
        self._angles = np.linspace(-self._WIDEST, self._WIDEST, self._DIRECTIONS)
        self._units = np.stack((np.cos(self._angles), np.sin(self._angles)))
        self._heading: float | None = None  # last direction in the world frame [rad]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Chooses an open direction, and a speed at which the robot can still stop."""
        dx, dy = goal[0] - pose[0], goal[1] - pose[1]
        cost = self._deviations(math.atan2(dy, dx) - pose[2])
        if self._heading is not None:
            cost += self._PERSISTENCE * self._deviations(self._heading - pose[2])
        free = self._free_lengths(scan)
        needed = min(math.hypot(dx, dy), self._LOOKAHEAD)
        while not (free >= needed).any():
            needed = needed / 2 if needed > 0.01 else 0.0
        best = int(np.argmin(np.where(free >= needed, cost, np.inf)))
        angle = float(self._angles[best])
        self._heading = pose[2] + angle
        # The free length ahead matters as well, until the robot has turned.
        room = max(0.0, min(float(free[best]), float(free[self._DIRECTIONS // 2])))
        speed = self._task.max_speed * max(0.0, math.cos(1.5 * min(abs(angle), 1.0)))
        return Twist(
            linear_x=min(speed, math.sqrt(2 * self._DECELERATION * room)), angular_z=2.0 * angle
        )

    def _deviations(self, bearing: float) -> DoubleArray:
        """Returns the angles between a direction and all candidates, from 0 to pi [rad]."""
        deviations: DoubleArray = np.abs(
            np.remainder(self._angles - bearing + np.pi, math.tau) - np.pi
        )
        return deviations

    def _free_lengths(self, scan: Scan) -> DoubleArray:
        """Returns the free length of a lane as wide as the robot in each direction [m]."""
        along = scan.points @ self._units
        across = scan.points @ np.stack((-self._units[1], self._units[0]))
        lane = self._task.radius + self._MARGIN
        is_in_lane = (along > 0) & (np.abs(across) < lane)
        nearest = np.where(is_in_lane, along, scan.max_range).min(axis=0, initial=scan.max_range)
        lengths: DoubleArray = np.maximum(nearest - self._task.radius, 0.0)
        return lengths


class RandomWalk:
    """Drives with random velocities, each for a second: a lower bound for all other controllers."""

    _HOLD: Final = 1.0  # time between two changes [s]

    def __init__(self, task: Task) -> None:
        """Starts at rest."""
        self._task = task
        self._twist = Twist()
        self._left = 0.0  # time until the next change [s]

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Returns the current velocities."""
        if self._left <= 0:
            turn = self._task.rng.uniform(-self._task.max_turn, self._task.max_turn)
            self._twist = Twist(
                linear_x=self._task.rng.uniform(0, self._task.max_speed), angular_z=turn
            )
            self._left = self._HOLD
        self._left -= self._task.period
        return self._twist


class PurePursuit:
    """Follows the shortest path on a grid map of all obstacles, as they are at the start.

    It uses the exact map and pose instead of the scan: an upper bound for other controllers.
    """

    _LOOKAHEAD: Final = 0.35  # [m]
    _SLOW_DOWN: Final = 0.8  # distance to the goal below which it slows down [m]
    _TURN: Final = math.radians(30)  # deviation above which it turns on the spot

    def __init__(self, task: Task) -> None:
        """Plans the path."""
        from flatland_sweep.planner import plan_path

        self._task = task
        self._path = plan_path(task)
        self._next = 0  # index of the point of the path that was closest

    def command(self, scan: Scan, pose: Pose, goal: Vector2) -> Twist:
        """Steers towards a point on the path ahead."""
        distances = np.hypot(*(self._path - pose[:2]).T)
        # Only a short part ahead: the path may return to the same place.
        self._next += int(np.argmin(distances[self._next : self._next + 20]))
        far = np.flatnonzero(distances[self._next :] >= self._LOOKAHEAD)
        target = self._path[self._next + far[0]] if len(far) else self._path[-1]
        dx, dy = float(target[0]) - pose[0], float(target[1]) - pose[1]
        distance = max(math.hypot(dx, dy), 1e-6)
        bearing = math.remainder(math.atan2(dy, dx) - pose[2], math.tau)
        if abs(bearing) > self._TURN:
            return Twist(angular_z=math.copysign(self._task.max_turn, bearing))
        left = math.hypot(goal[0] - pose[0], goal[1] - pose[1])
        speed = self._task.max_speed * min(1.0, left / self._SLOW_DOWN) * math.cos(bearing)
        curvature = 2 * math.sin(bearing) / distance
        # On a narrow curve, the speed follows from the limit of the yaw rate.
        if abs(curvature) * speed > self._task.max_turn:
            speed = self._task.max_turn / abs(curvature)
        return Twist(linear_x=speed, angular_z=curvature * speed)


INCLUDED: Final[dict[str, type[Controller]]] = {
    "gap": FollowGap,
    "pursuit": PurePursuit,
    "random": RandomWalk,
}


def find_controller(name: str, folder: str) -> type[Controller]:
    """Returns the class of a controller.

    Args:
        name: Name of an included controller, `FILE.py:CLASS` or `MODULE:CLASS`.
        folder: Folder that a relative path of a file starts from; empty for the current one.

    Raises:
        SweepError: It does not exist or is not a controller.
    """
    included = INCLUDED.get(name)
    if included is not None:
        return included
    module_name, colon, class_name = name.rpartition(":")
    if not (colon and module_name and class_name):
        raise SweepError(
            f"controller {name!r} does not exist; included are {', '.join(INCLUDED)}, others are "
            "given as FILE.py:CLASS or MODULE:CLASS"
        )
    try:
        if module_name.endswith(".py"):
            module = _load_file(controller_file(name, folder))
        else:
            module = importlib.import_module(module_name)
    except SweepError:
        raise
    except (Exception, SystemExit) as error:
        raise SweepError(
            f"controller {name!r}: {type(error).__name__}: {error}, while it was imported"
        ) from error
    found: Any = getattr(module, class_name, None)
    if not (isinstance(found, type) and callable(getattr(found, "command", None))):
        raise SweepError(
            f"controller {name!r}: {module_name} has no class {class_name} with a method command"
        )
    return found


def controller_file(name: str, folder: str) -> Path | None:
    """Returns the file of a controller given as `FILE.py:CLASS`, None for another controller."""
    path = name.rpartition(":")[0]
    return Path(folder, path).expanduser() if path.endswith(".py") else None


def _load_file(path: Path | None) -> ModuleType:
    if path is None or not path.is_file():
        raise SweepError(f"controller file not found: {path}")
    path = path.resolve()
    # Each file is loaded once per process.
    name = f"flatland_sweep_{hashlib.sha256(bytes(path)).hexdigest()[:16]}"
    known = sys.modules.get(name)
    if known is not None:
        return known
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise SweepError(f"controller file cannot be loaded: {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
