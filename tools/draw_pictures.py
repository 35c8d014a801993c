"""Draws the images of README.md and docs/*.md that require neither ROS nor a display.

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
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from picture_folder import picture_folder

from flatland import Body, JointState, LaserScan, Odometry, SemanticScan, Twist, World, worldgen
from flatland.drawing import save
from flatland.geometry import circle_points, compose, transform_points

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


def draw_wheel_states(path: Path) -> None:
    """Plots the speeds of the wheels of a car in a curve, and an angle with ticks."""
    figure, (speeds, angle) = plt.subplots(1, 2, figsize=(12, 4.2), dpi=100)
    for axis, robot, command in (
        (speeds, "car", Twist(linear_x=1.5, angular_z=0.5)),
        (angle, "mecanum", Twist(linear_x=0.02)),
    ):
        states: list[JointState] = []
        exact: list[float] = []
        with load_world("drives") as world:
            plugin = world.model(robot).plugin("wheels")
            world.output(f"/{robot}/joint_states").subscribe(states.append)
            world.command(f"/{robot}/cmd_vel").set(command)
            for _ in range(600 if robot == "car" else 100):
                world.step()
                exact.append(plugin.angles[0])
        times = np.array([state.stamp for state in states]) / 1e9
        if robot == "car":
            axis.plot(times, [state.velocities for state in states], label=states[0].names)
            axis.set(ylabel="speeds of the wheels of the car [rad/s]")
        else:
            axis.plot(0.005 * np.arange(1, len(exact) + 1), exact, color="0.6", label="exact")
            measured = [state.positions[0] for state in states]
            axis.plot(times, measured, ".", color="tab:red", label="encoder, 1024 ticks per turn")
            axis.set(ylabel="angle of a slow wheel [rad]")
        axis.set(xlabel="simulated time [s]")
        axis.grid(alpha=0.3)
        axis.legend()
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


def sensors() -> World:
    """Loads the world of sensors, with all outputs wanted, and performs some steps."""
    world = World.from_yaml(_CHECKOUT / "worlds" / "sensors" / "world.yaml", seed=1)
    for topic in ("/scan", "/semantic_scan", "/sonar/left", "/sonar/front", "/sonar/right", "/tip"):
        world.output(topic)
    world.step(100)
    return world


def _draw_walls(world: World, axis: Axes) -> None:
    """Draws the walls and the outlines of models."""
    for layer in world.layers:
        for x1, y1, x2, y2 in layer.world_edges:
            axis.plot([x1, x2], [y1, y2], color=layer.color, lw=3 if layer.material else 1.5)
    for model in world.models:
        for body in model.bodies:
            for fixture in body.fixtures:
                points = (
                    circle_points(fixture.center, fixture.radius, 40)
                    if fixture.shape == "circle"
                    else fixture.vertices
                )
                outline = transform_points(body.pose, points)
                axis.fill(*outline.T, facecolor=body.color, edgecolor="black", lw=0.5, zorder=3)
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")


def _points(world: World, scan: LaserScan | SemanticScan) -> npt.NDArray[np.float64]:
    """Returns the end points of the beams of the robot in the world frame, shape (n, 2)."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    ends = scan.ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return transform_points(world.model("robot").body("base").pose, ends.astype(np.float64))


def draw_materials(world: World, path: Path) -> None:
    """Plots a scan with intensities in front of a window and a mirror."""
    figure, axis = plt.subplots(figsize=(9, 7.5), dpi=100)
    _draw_walls(world, axis)
    scan = world.output("/scan").latest
    points = _points(world, scan)
    is_hit = np.isfinite(scan.ranges)
    dots = axis.scatter(
        *points[is_hit].T,
        c=np.maximum(scan.intensities[is_hit], 0.3),
        s=9,
        cmap="plasma",
        norm=LogNorm(0.3, 255),
        zorder=4,
    )
    figure.colorbar(dots, label="intensity", shrink=0.8)
    axis.set(xlim=(-0.3, 10.3), ylim=(-6.3, 6.3))
    axis.text(6.1, 3.2, "window", color=world.layer("glass").color, rotation=90)
    axis.text(3.0, -0.45, "mirror, and the images in it", color=world.layer("mirror").color)
    _save(figure, path)


def draw_semantic_scan(world: World, path: Path) -> None:
    """Plots the hits of a semantic scan by class."""
    figure, axis = plt.subplots(figsize=(9, 5.6), dpi=100)
    _draw_walls(world, axis)
    scan = world.output("/semantic_scan").latest
    classes = np.array([label.class_name for label in scan.table])[scan.labels]
    # Points in a mirror are not drawn.
    points = _points(world, scan)
    is_inside = points[:, 1] > 0
    for name in sorted(set(classes) - {""}):
        found = (classes == name) & is_inside
        if found.any():
            axis.scatter(*points[found].T, s=12, label=name, zorder=4)
    axis.set(xlim=(-0.3, 10.3), ylim=(-0.3, 6.3))
    axis.legend(title="class", loc="upper left", bbox_to_anchor=(1, 1))
    _save(figure, path)


def draw_sonar(world: World, path: Path) -> None:
    """Plots the rays and the readings of sonars."""
    figure, axis = plt.subplots(figsize=(7, 5.2), dpi=100)
    world.move_model("robot", (3.4, 3.4, 0.35))
    world.step(20)
    _draw_walls(world, axis)
    base = world.model("robot").body("base").pose
    for side in ("left", "front", "right"):
        sonar = world.model("robot").plugin(f"sonar_{side}")
        reading = world.output(f"/sonar/{side}").latest
        distance = min(reading.range, reading.max_range)
        pose = compose(base, sonar.origin)
        ends = transform_points(pose, sonar.beam_ends * (distance / sonar.range))
        corners = np.vstack([[pose[:2]], ends])
        color = "tab:green" if np.isfinite(reading.range) else "lightgrey"
        axis.fill(*corners.T, color=color, alpha=0.3, lw=0)
        axis.plot(*ends.T, color=color, lw=2, zorder=4)
        for end in ends[:: max(1, len(ends) // 12)]:
            axis.plot([pose[0], end[0]], [pose[1], end[1]], color=color, lw=0.4)
        text = f"{reading.range:.2f} m" if np.isfinite(reading.range) else "inf"
        axis.annotate(text, ends[len(ends) // 2], zorder=5)
    axis.set(xlim=(2.5, 8.2), ylim=(1.2, 6.2))
    _save(figure, path)


def draw_pose_publisher(world: World, path: Path) -> None:
    """Plots the path and the velocities of the end of an arm."""
    values: list[Odometry] = []
    world.move_model("robot", (1.5, 2.0, 0.0))
    world.output("/tip").subscribe(values.append)
    for turn in (0.0, 1.2, -1.2):
        world.command("/cmd_vel").set(Twist(linear_x=0.6, angular_z=turn))
        world.step(400)
    poses = np.array([value.pose for value in values])
    twists = np.array([value.twist for value in values])
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    vx, vy = c * twists[:, 0] - s * twists[:, 1], s * twists[:, 0] + c * twists[:, 1]
    figure, axis = plt.subplots(figsize=(7, 5.2), dpi=100)
    _draw_walls(world, axis)
    axis.plot(*poses[:, :2].T, color="tab:orange", lw=1.5, label="position of the end of the arm")
    arrows = slice(None, None, 4)
    axis.quiver(
        *poses[arrows, :2].T,
        vx[arrows],
        vy[arrows],
        color="tab:blue",
        angles="xy",
        scale_units="xy",
        scale=2.5,
        width=0.004,
        label="velocity",
        zorder=4,
    )
    axis.set(xlim=(1.2, 5.2), ylim=(0.8, 4.6))
    axis.legend(loc="upper left")
    _save(figure, path)


def main(arguments: list[str]) -> int:
    """Draws all images into a folder."""
    folder = picture_folder(str(__doc__), arguments)
    with office() as world:
        save(world, folder / "office.png")
        save(world, folder / "corridor.png", view=(-5.5, -7.8, 6.0, -3.0), names=True)
    draw_odometry(folder / "odometry.png")
    draw_appearance(folder / "appearance.png")
    for kind in RANDOM_WORLDS:
        draw_random_worlds(kind, folder / f"random_{kind}.png")
    for draw, name in (
        (draw_materials, "materials"),
        (draw_semantic_scan, "semantic_scan"),
        (draw_sonar, "sonar"),
        (draw_pose_publisher, "pose_publisher"),
    ):
        with sensors() as world:
            draw(world, folder / f"{name}.png")
    draw_paths(folder / "paths.png")
    draw_drives(folder / "drives.png")
    draw_wheel_states(folder / "wheel_states.png")
    draw_forces(folder / "forces.png")
    draw_trailers(folder / "trailers.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
