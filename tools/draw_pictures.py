"""Draws the images of README.md and docs/*.md that require neither ROS nor a display.

Usage: draw_pictures.py [FOLDER]   (default: docs/images; existing images are overwritten)

The images are the same in every run.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from flatland import Body, Twist, World
from flatland.drawing import save

_CHECKOUT = Path(__file__).resolve().parent.parent

# Name of the model file, pose (x, y [m], yaw [rad]).
FURNITURE = [
    ("chair", (-0.6, -5.2, 0.0)),
    ("chair", (1.6, -5.9, 2.0)),
    ("box", (3.6, -5.0, 0.4)),
    ("box", (4.3, -5.2, 1.3)),
    ("box", (-2.2, 5.0, 0.2)),
    ("chair", (0.3, 5.9, -2.0)),
    ("door", (-3.5, -4.4, 0.9)),
]


def office() -> World:
    """Loads the office, adds furniture and drives both robots for some seconds."""
    world = World.from_yaml(_CHECKOUT / "worlds" / "office" / "world.yaml", seed=1)
    for number, (kind, pose) in enumerate(FURNITURE, start=1):
        world.spawn_model(f"{kind}.model.yaml", f"{kind}_{number}", pose=pose)
    for topic in ("/scan", "/tricycle/scan"):
        world.output(topic)  # a scan is computed only if its output is wanted
    robot, tricycle = world.command("/cmd_vel"), world.command("/tricycle/cmd_vel")
    robot.set(Twist(linear_x=0.5, angular_z=-0.25))
    tricycle.set(Twist(linear_x=0.9, angular_z=-0.2))
    world.step(300)
    robot.set(Twist(linear_x=0.5, angular_z=0.45))
    tricycle.set(Twist(linear_x=0.9, angular_z=0.25))
    world.step(200)
    return world


# Parameters of the drives whose odometry is compared.
ODOMETRY = ("odom_pose_noise: [0.01, 0.01, 0.01]", "odom_drift: [0.002, 0.001, 0.01, 0.001]")
_SIDE, _SPEED, _TURN_RATE, _LAPS = 6.0, 0.5, 0.6, 2  # m, m/s, rad/s
_RATE = 10  # Hz


def drive_squares(parameter: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Drives some laps of a square with round corners.

    Args:
        parameter: Parameter of the drive, as YAML.

    Returns:
        Time [s], x and y [m] of the ground truth and of the odometry, each of shape (n, 3).
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.model.yaml").write_text(
            "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]\n"
            "plugins:\n"
            f"  - {{type: DiffDrive, name: drive, body: base, pub_rate: {_RATE}, {parameter}}}\n"
        )
        (folder / "world.yaml").write_text(
            "properties: {}\nlayers: [{name: 2d}]\n"
            "models: [{name: robot, model: robot.model.yaml}]\n"
        )
        with World.from_yaml(folder / "world.yaml", seed=5) as world:
            paths: list[list[tuple[float, float, float]]] = [[], []]
            for topic, path in zip(("ground_truth", "filtered"), paths, strict=True):
                world.output(f"/odometry/{topic}").subscribe(
                    lambda value, path=path: path.append((value.stamp / 1e9, *value.pose[:2]))
                )
            command, step_size = world.command("/cmd_vel"), world.timekeeper.step_size
            for _ in range(4 * _LAPS):
                command.set(Twist(linear_x=_SPEED))
                world.step(round(_SIDE / _SPEED / step_size))
                command.set(Twist(linear_x=_SPEED, angular_z=_TURN_RATE))
                world.step(round(np.pi / 2 / _TURN_RATE / step_size))
    return np.array(paths[0]), np.array(paths[1])


def draw_odometry(path: Path) -> None:
    """Plots paths and errors of odometry with white noise and of odometry that drifts."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 8), dpi=100, height_ratios=(3, 1))
    for parameter, (paths, errors) in zip(ODOMETRY, axes.T, strict=True):
        truth, odometry = drive_squares(parameter)
        paths.plot(odometry[:, 1], odometry[:, 2], color="tab:orange", lw=1, label="odometry")
        paths.plot(truth[:, 1], truth[:, 2], color="black", lw=1.5, label="ground truth")
        paths.set(title=parameter, xlabel="x [m]", ylabel="y [m]", aspect="equal")
        paths.set(xlim=(-3, 9), ylim=(-2.5, 9.5))
        paths.legend(loc="center")
        error = np.hypot(*(odometry - truth)[:, 1:].T)
        errors.plot(truth[:, 0], error, color="tab:orange", lw=1)
        errors.set(xlabel="simulated time [s]", ylabel="error [m]", xlim=(0, truth[-1, 0]))
        errors.set(ylim=(0, 2))
        for axis in (paths, errors):
            axis.grid(alpha=0.3)
    _save(figure, path)


def load_world(name: str) -> World:
    """Loads an included world."""
    return World.from_yaml(_CHECKOUT / "worlds" / name / "world.yaml", seed=1)


def draw_moving(
    world: World, axis: Axes, times: Sequence[float], names: Sequence[str] | None = None
) -> None:
    """Steps a world, and draws its bodies at some times with the paths of its models.

    Args:
        world: The world.
        axis: Where to draw.
        times: Times at which the models are drawn [s]; they are paler at earlier times.
        names: Models whose paths are drawn; None for all.
    """
    shown = [model.name for model in world.models] if names is None else list(names)
    paths: dict[str, list[tuple[float, float]]] = {name: [] for name in shown}
    for layer in world.layers:
        edges = layer.world_edges.reshape(-1, 2, 2)
        axis.add_collection(LineCollection(list(edges), colors="0.2", lw=1.5))
        axis.update_datalim(edges.reshape(-1, 2))
    for number, end in enumerate(times):
        while world.time < end - 1e-9:
            world.step(10)
            for name in shown:
                paths[name].append(world.model(name).pose[:2])
        alpha = 0.25 + 0.65 * number / max(1, len(times) - 1)
        for model in world.models:
            for body in model.bodies:
                _draw_body(axis, body, alpha)
    for name in shown:
        axis.plot(*np.array(paths[name]).T, color="0.45", lw=0.8, ls=(0, (4, 2)), zorder=1)
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axis.autoscale_view()


def _draw_body(axis: Axes, body: Body, alpha: float) -> None:
    x, y, theta = body.pose
    rotation = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    style = {"facecolor": body.color[:3], "edgecolor": "black", "lw": 0.6, "alpha": alpha}
    for fixture in body.fixtures:
        if fixture.shape == "circle":
            axis.add_patch(Circle(rotation @ fixture.center + (x, y), fixture.radius, **style))
        else:
            axis.add_patch(Polygon(fixture.vertices @ rotation.T + (x, y), **style))


def draw_paths(path: Path) -> None:
    """Draws vehicles and a door that follow waypoints, and the speed of one of them."""
    figure, (plan, speed) = plt.subplots(1, 2, figsize=(12, 4.2), dpi=100, width_ratios=(2, 1))
    with load_world("traffic") as world:
        world.command("/door").set(True)
        draw_moving(world, plan, (0.0, 9.0, 23.0))
    with load_world("traffic") as world:
        body, speeds = world.model("shuttle").bodies[0], []
        for _ in range(500):
            world.step(10)
            speeds.append(np.hypot(*body.velocity[:2]))
    speed.plot(np.arange(1, 501) * 0.05, speeds, color="tab:blue")
    speed.set(xlabel="simulated time [s]", ylabel="speed of the shuttle [m/s]")
    speed.grid(alpha=0.3)
    _save(figure, path)


def draw_drives(path: Path) -> None:
    """Draws a car and holonomic robots with their paths."""
    figure, plan = plt.subplots(figsize=(9, 5.6), dpi=100)
    with load_world("drives") as world:
        world.command("/car/cmd_vel").set(Twist(1.5, 0.0, 0.5))
        world.command("/mecanum/cmd_vel").set(Twist(0.1, 0.45, 0.0))
        world.command("/trio/cmd_vel").set(Twist(-0.3, 0.0, 0.5))
        draw_moving(world, plan, (0.0, 2.5, 5.0))
    _save(figure, path)


def draw_forces(path: Path) -> None:
    """Draws two robots that push each other, and the speeds of all models."""
    figure, (plan, speed) = plt.subplots(1, 2, figsize=(12, 4.2), dpi=100, width_ratios=(5, 4))
    speeds: dict[str, list[float]] = {}
    with load_world("pushing") as world:
        for name in ("strong", "weak", "pusher"):
            world.command(f"/{name}/cmd_vel").set(Twist(0.8))
        draw_moving(world, plan, (0.0, 3.0, 8.0))
    with load_world("pushing") as world:
        for name in ("strong", "weak", "pusher"):
            world.command(f"/{name}/cmd_vel").set(Twist(0.8))
        for _ in range(300):
            world.step(5)
            for model in world.models:
                speeds.setdefault(model.name, []).append(model.bodies[0].velocity[0])
    for name, values in speeds.items():
        speed.plot(np.arange(1, len(values) + 1) * 0.025, values, lw=1.2, label=name)
    speed.set(xlabel="simulated time [s]", ylabel="velocity along x [m/s]")
    speed.legend()
    speed.grid(alpha=0.3)
    _save(figure, path)


def draw_trailers(path: Path) -> None:
    """Draws a tractor with three trailers."""
    figure, plan = plt.subplots(figsize=(9, 5.6), dpi=100)
    with load_world("trailers") as world:
        world.command("/cmd_vel").set(Twist(1.5))
        world.step(600)
        world.command("/cmd_vel").set(Twist(1.5, 0.0, 0.35))
        draw_moving(world, plan, (3.0, 6.0, 12.0))
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    # Without the version of matplotlib, so that the file is the same in every run.
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)


def main(arguments: list[str]) -> int:
    """Draws all images into a folder."""
    folder = Path(arguments[0]) if arguments else _CHECKOUT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    with office() as world:
        save(world, folder / "office.png")
        save(world, folder / "corridor.png", view=(-5.5, -7.8, 6.0, -3.0), names=True)
    draw_odometry(folder / "odometry.png")
    draw_paths(folder / "paths.png")
    draw_drives(folder / "drives.png")
    draw_forces(folder / "forces.png")
    draw_trailers(folder / "trailers.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
