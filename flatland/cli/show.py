"""`flatland show`: draws a picture of a world or model."""

from __future__ import annotations

import argparse
from pathlib import Path

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
from flatland.output_files import check_outputs

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
    return 0
