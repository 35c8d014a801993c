"""Runs one cell of a sweep."""

from __future__ import annotations

import hashlib
import math
import os
import socket
import time
import traceback
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland import FlatlandError, Model, Twist, World
from flatland.geometry import compose, invert, transform_points
from flatland.plugins.laser import Laser
from flatland_sweep.cells import Cell, Row, Settings, SweepError
from flatland_sweep.columns import row_of
from flatland_sweep.controllers import Scan, Task, find_controller
from flatland_sweep.measurements import Measurements

if TYPE_CHECKING:
    from flatland.geometry import Pose, Vector2

_MAX_TRIES: Final = 100  # of random goals
_ALL_BITS: Final = 0xFFFF


class EpisodeError(Exception):
    """A world, robot or controller that cannot be used."""


def run_cell(cell: Cell, settings: Settings, folder: str) -> Row:
    """Runs an episode; all that fails in it becomes a row with the error.

    Args:
        cell: The world, controller and seed.
        settings: Settings of all cells.
        folder: Folder that relative paths of the cell start from; empty for the current one.
    """
    start = time.perf_counter()
    try:
        values = _run(cell, settings, folder)
    except (Exception, SystemExit) as error:
        values = {"outcome": "error", "error": describe(error)}
    worker = f"{socket.gethostname()}:{os.getpid()}"
    return row_of(cell, **values, wall_time=time.perf_counter() - start, worker=worker)


def describe(error: BaseException) -> str:
    """Returns the type, text and innermost line of code of an error."""
    if isinstance(error, FlatlandError):
        return error.text_with_hint
    text = f"{type(error).__name__}: {error}"
    if isinstance(error, EpisodeError | SweepError):
        return str(error)
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return text
    return f"{text} [{Path(frames[-1].filename).name}:{frames[-1].lineno}]"


def _run(cell: Cell, settings: Settings, folder: str) -> dict[str, Any]:
    controller_class = find_controller(cell.controller, folder)
    path, params = Path(folder, cell.world), dict(settings.params)
    with World.from_yaml(path, seed=cell.seed, params=params) as world:
        inputs_hash = _hash_files(world)
        robot, laser = _find_robot(world, settings)
        drive = world.command("/".join(filter(None, (robot.namespace, settings.cmd_vel))))
        radius, bits = _footprint(robot)
        start, goal = _choose_places(world, robot, radius, bits, settings, cell.seed)
        world.move_model(robot.name, start, if_blocked="refuse")
        controller = controller_class(
            Task(
                world=world,
                robot=robot,
                radius=radius,
                category_bits=bits,
                goal=goal,
                period=settings.period,
                max_speed=settings.max_speed,
                max_turn=settings.max_turn,
                rng=_generator(cell.seed, "controller"),
            )
        )
        measured = Measurements(world, robot)
        outcome = ""
        step_size = world.timekeeper.step_size
        steps, limit = 0, max(1, round(settings.time_limit / step_size))
        steps_per_period = max(1, round(settings.period / step_size))
        while not outcome:
            if steps % steps_per_period == 0:
                twist = controller.command(_read(laser, robot), robot.pose, goal)
                drive.set(_checked(twist, settings))
            world.step()
            steps += 1
            pose = measured.update()
            if measured.collisions > settings.max_collisions:
                outcome = "collision"
            elif math.dist(pose[:2], goal) <= settings.tolerance:
                outcome = "reached"
            elif steps == limit:
                outcome = "timeout"
        return {
            "outcome": outcome,
            "time": world.time,
            "path_length": measured.path_length,
            "collisions": measured.collisions,
            "min_clearance": measured.min_clearance,
            "distance": math.dist(start[:2], goal),
            "start_x": start[0],
            "start_y": start[1],
            "goal_x": goal[0],
            "goal_y": goal[1],
            "final_distance": math.dist(robot.pose[:2], goal),
            "steps": steps,
            "state_hash": world.state_hash(),
            "inputs_hash": inputs_hash,
        }


def _find_robot(world: World, settings: Settings) -> tuple[Model, Laser]:
    models = world.models
    if settings.robot:
        models = [world.model(settings.robot)]
    for model in models:
        for plugin in model.plugins:
            if isinstance(plugin, Laser) and settings.laser in ("", plugin.name):
                return model, plugin
    laser = f'plugin "{settings.laser}" of type Laser' if settings.laser else "plugin of type Laser"
    owner = f'model "{settings.robot}"' if settings.robot else "the world"
    raise EpisodeError(f"{owner} has no {laser}")


def _footprint(robot: Model) -> tuple[float, int]:
    """Returns the radius of a robot about its origin, and the categories of its obstacles."""
    to_origin = invert(robot.pose)
    radius, bits = 0.0, 0
    for body in robot.bodies:
        pose = compose(to_origin, body.pose)
        for fixture in body.fixtures:
            if fixture.is_sensor or not fixture.mask_bits:
                continue
            bits |= fixture.category_bits
            points = np.array([fixture.center] if fixture.shape == "circle" else fixture.vertices)
            reach = np.hypot(*transform_points(pose, points).T).max() + fixture.radius
            radius = max(radius, float(reach))
    if not radius:
        raise EpisodeError(f'model "{robot.name}" has no footprint that collides')
    return radius, bits


def _choose_places(
    world: World, robot: Model, radius: float, bits: int, settings: Settings, seed: int
) -> tuple[Pose, Vector2]:
    """Returns a random start and goal that are connected to the initial pose of the robot."""
    rng = _generator(seed, "places")
    known = world.collision_filter
    layers = (
        "all"
        if bits == _ALL_BITS
        else [name for name in known.names if bits >> known.layer_id(name) & 1]
    )
    home = robot.pose[:2]

    def sample() -> Pose:
        (place,) = world.sample_free(
            1, radius, settings.clearance, rng, connected_to=home, layers=layers, ignore=robot
        ).tolist()
        x, y, theta = place
        return (x, y, theta)

    start = sample()
    longest = math.inf if settings.max_distance is None else settings.max_distance
    for _ in range(_MAX_TRIES):
        x, y, _theta = sample()
        if settings.min_distance <= math.dist(start[:2], (x, y)) <= longest:
            return start, (x, y)
    raise EpisodeError(
        f"found no goal at a distance from {settings.min_distance:g} to "
        f"{longest:g} m from the start ({start[0]:.2f}, {start[1]:.2f})"
    )


def _generator(seed: int, purpose: str) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])


def _read(laser: Laser, robot: Model) -> Scan:
    """Returns a scan from the current pose, with noise."""
    measured = laser.compute_ranges()
    is_hit = np.isfinite(measured) & (measured < np.float32(laser.range))
    ranges = np.where(is_hit, measured.astype(np.float64), laser.range)
    ranges[np.isneginf(measured)] = 0.0
    p_laser = laser.beam_ends[is_hit] * (ranges[is_hit] / laser.range)[:, np.newaxis]
    mount = compose(compose(invert(robot.pose), laser.body.pose), laser.origin)
    return Scan(ranges, laser.range, transform_points(mount, p_laser))


def _checked(twist: object, settings: Settings) -> Twist:
    """Returns a command within the limits.

    Raises:
        EpisodeError: It is not a twist of finite numbers.
    """
    if not isinstance(twist, Twist):
        raise EpisodeError(f"the controller must return a flatland.Twist, got {twist!r}")
    if not all(map(math.isfinite, (twist.linear_x, twist.linear_y, twist.angular_z))):
        raise EpisodeError(f"the controller returned a command that is not finite, {twist}")
    speed, turn = settings.max_speed, settings.max_turn
    return Twist(
        linear_x=min(max(twist.linear_x, -speed), speed),
        linear_y=min(max(twist.linear_y, -speed), speed),
        angular_z=min(max(twist.angular_z, -turn), turn),
    )


def _hash_files(world: World) -> str:
    """Returns a hash of the names and contents of all files that a world was loaded from."""
    digest = hashlib.sha256()
    folder = Path(world.path).absolute().parent
    for path in sorted(os.path.relpath(path, folder) for path in world.source.inputs.files):
        content = Path(folder, path).read_bytes()
        digest.update(f"{path}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:32]
