"""Draws the images of README.md and docs/drawing.md that require neither ROS nor a display.

Usage: draw_pictures.py [FOLDER]   (default: docs/images; existing images are overwritten)

The images are the same in every run.
"""

from __future__ import annotations

import sys
from pathlib import Path

from flatland import Twist, World
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


def main(arguments: list[str]) -> int:
    """Draws all images into a folder."""
    folder = Path(arguments[0]) if arguments else _CHECKOUT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    with office() as world:
        save(world, folder / "office.png")
        save(world, folder / "corridor.png", view=(-5.5, -7.8, 6.0, -3.0), names=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
