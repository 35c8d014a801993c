"""`flatland show`: draws a picture of a world or model."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from flatland.cli.arguments import (
    Commands,
    add_command,
    count,
    file_arguments,
    load_world_or_model,
    picture_arguments,
    picture_options,
)
from flatland.drawing import PICTURE_FORMATS, check_matplotlib, save
from flatland.drawing.footprints import footprints_of
from flatland.geometry import Bounds
from flatland.output_files import check_outputs
from flatland.scene.world_scene import Scene, describe_world

_MAX_HIDDEN = 3  # bodies that are named

_EXAMPLES = (
    "flatland show worlds/office/world.yaml -o office.png",
    "flatland show worlds/office/world.yaml -o corridor.pdf --view -6 -8 6 -3 --names",
    "flatland show worlds/office/diff_robot.model.yaml -o robot.png",
    "flatland show worlds/office/world.yaml -o later.png --steps 400 --seed 1 --size 1200x800",
)


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "show",
        parents=[file_arguments("FILE", "world or model file"), picture_arguments()],
        summary="draw a picture of a world or model",
        description="Loads a world or model, optionally steps it, and draws a picture of it.",
        examples=_EXAMPLES,
    )
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        type=_picture_path,
        metavar="FILE",
        help=f"picture file ({', '.join(PICTURE_FORMATS)}); an existing file is overwritten",
    )
    parser.add_argument(
        "--steps", type=count, default=0, help="number of steps before the picture (default: 0)"
    )
    parser.add_argument("--seed", type=count, help="seed of all noise (default: random)")
    parser.set_defaults(run=_show)


def _picture_path(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in PICTURE_FORMATS:
        raise argparse.ArgumentTypeError(
            f"must end with one of {', '.join(PICTURE_FORMATS)}, got {text!r}"
        )
    return path


def _unseen(scene: Scene, view: Bounds | None) -> list[str]:
    """Returns lines about what a picture does not show.

    Args:
        scene: Contents of the picture.
        view: The requested view [m]; None if it contains everything.
    """
    lines = []
    hidden = [
        f'body "{body.name}" of model "{model.name}"'
        for model in scene.models
        for body in model.bodies
        if body.visible_shapes and not body.color[3]
    ]
    if hidden:
        shown = hidden[:_MAX_HIDDEN]
        if hidden[_MAX_HIDDEN:]:
            shown.append(f"{len(hidden) - _MAX_HIDDEN} others")
        names = ", ".join(shown[:-1]) + f" and {shown[-1]}" if shown[1:] else shown[0]
        lines.append(f"not drawn, because the alpha of the color is 0: {names}")
    outlines = [
        outline.points
        for model in scene.models
        for outline in footprints_of(model).outlines
        if outline.color[3]
    ]
    walls = [layer.world_edges().reshape(-1, 2, 2) for layer in scene.layers]
    parts = [
        np.concatenate([*walls, np.empty((0, 2, 2))]),
        *(each[np.newaxis] for each in outlines),
    ]
    lows = np.concatenate([part.min(axis=1) for part in parts])
    highs = np.concatenate([part.max(axis=1) for part in parts])
    if not len(lows):
        why = "" if hidden else ", because the world has neither walls nor footprints"
        lines.append(f"the picture is empty{why}")
    elif view is not None and not scene.lasers:
        is_inside = (lows <= view[2:]) & (highs >= view[:2])
        if not is_inside.all(axis=1).any():
            (x_min, y_min), (x_max, y_max) = lows.min(axis=0), highs.max(axis=0)
            lines.append(
                "the picture is empty, because everything is outside of the view: walls and models "
                f"extend from ({x_min:.6g}, {y_min:.6g}) to ({x_max:.6g}, {y_max:.6g})"
            )
    return lines


def _show(options: argparse.Namespace) -> int:
    check_outputs(options.output)
    check_matplotlib()  # before loading and stepping, which may take long
    with load_world_or_model(options, options.seed) as world:
        world.step(options.steps)
        try:
            save(world, options.output, **picture_options(options))
        except ValueError as error:
            options.parser.error(str(error))
        for layer in world.layers:
            is_drawn = options.layer is None or not set(options.layer).isdisjoint(layer.names)
            if is_drawn and len(layer.edges) and not layer.color[3]:
                print(f'layer "{layer.name}" is drawn faintly, because the alpha of its color is 0')
        scene = describe_world(world, options.layer, scans=not options.no_scans)
        for line in _unseen(scene, options.view):
            print(line)
    return 0
