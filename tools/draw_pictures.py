"""Draws the images of README.md and docs/*.md that require neither ROS nor a display.

Usage: draw_pictures.py [FOLDER]   (default: docs/images; existing images are overwritten)

The images are the same in every run.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt

from flatland import Twist, World, worldgen
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
    figure.tight_layout()
    # Without the version of matplotlib, so that the file is the same in every run.
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)


def draw_appearance(path: Path) -> None:
    """Draws a part of the office before and after changes of the appearance of its models."""
    view = (-5.5, -7.8, 6.0, -3.0)
    with office() as world:
        before = world.draw(view=view, dpi=72)
        world.set_appearance("robot", color=(0.1, 0.65, 0.25))
        for name in ("box_3", "box_4"):
            world.set_appearance(name, color=(0.85, 0.2, 0.2, 1.0))
        world.set_appearance("chair_1", visible=False)
        after = world.draw(view=view, dpi=72)
    plt.imsave(path, np.concatenate((before, after)), metadata={"Software": None})


# Seeds of the random worlds of docs/random_worlds.md.
RANDOM_WORLDS = {"office": (1, 4, 11), "maze": (1, 2, 3), "warehouse": (1, 2, 4)}
_FLOOR, _WALL, _FURNITURE, _MARGIN = 255, (70, 74, 82), (214, 178, 128), (255, 255, 255)
_GAP = 24  # pixels between two plans


def draw_random_worlds(kind: str, path: Path) -> None:
    """Draws the floor plans of three random worlds, one pixel for each cell."""
    plans: list[npt.NDArray[np.uint8]] = []
    for seed in RANDOM_WORLDS[kind]:
        world = worldgen.generate(kind, seed)
        plan = np.full((*world.furniture.shape, 3), _FLOOR, np.uint8)
        plan[world.grid.cells > 0] = _WALL
        plan[world.furniture] = _FURNITURE
        if plans:
            plans.append(np.full((_GAP, plan.shape[1], 3), _MARGIN, np.uint8))
        plans.append(plan[::-1])
    plt.imsave(path, np.concatenate(plans), metadata={"Software": None})


def main(arguments: list[str]) -> int:
    """Draws all images into a folder."""
    folder = Path(arguments[0]) if arguments else _CHECKOUT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    with office() as world:
        save(world, folder / "office.png")
        save(world, folder / "corridor.png", view=(-5.5, -7.8, 6.0, -3.0), names=True)
    draw_odometry(folder / "odometry.png")
    draw_appearance(folder / "appearance.png")
    for kind in RANDOM_WORLDS:
        draw_random_worlds(kind, folder / f"random_{kind}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
