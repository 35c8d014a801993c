"""The command `flatland`: looks at worlds without ROS."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

import flatland
from flatland.drawing import PICTURE_FORMATS, check_matplotlib, save
from flatland.errors import FlatlandError
from flatland.loading.world_loader import SIMPLIFICATIONS
from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.world import World


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command.

    Args:
        arguments: Without the command's name; None for those of the process.

    Returns:
        0, or 1 after an error in a file or of the system, which is printed.

    Raises:
        SystemExit: The arguments are wrong (code 2), or ask for help or version only (code 0).
    """
    parser = _make_parser()
    options = parser.parse_args(arguments)
    try:
        options.run(options)
    except (FlatlandError, OSError) as error:
        print(f"flatland: {error}", file=sys.stderr)
        return 1
    return 0


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="flatland", description=__doc__)
    parser.add_argument("--version", action="version", version=f"flatland {flatland.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    of_worlds = _world_arguments()

    show = commands.add_parser(
        "show",
        parents=[of_worlds],
        help="draw a picture of a world",
        description="Loads a world, steps it if asked to, and draws a picture of it.",
    )
    show.add_argument(
        "-o",
        "--output",
        required=True,
        type=_picture_path,
        metavar="FILE",
        help=f"the picture ({', '.join(PICTURE_FORMATS)}); one that is there is overwritten",
    )
    show.add_argument("--steps", type=_count, default=0, help="steps before the picture (0)")
    show.add_argument("--seed", type=_count, help="of all noise; without, another one each time")
    show.add_argument("--size", type=_size, metavar="WxH", help="of the picture, in pixels")
    show.add_argument("--dpi", type=float, default=100.0, help="pixels an inch of letters (100)")
    show.add_argument(
        "--view",
        type=float,
        nargs=4,
        metavar=("X_MIN", "Y_MIN", "X_MAX", "Y_MAX"),
        help="part to be seen, in metres; without, all walls and models",
    )
    show.add_argument("--layer", action="append", metavar="NAME", help="draw this layer only")
    show.add_argument("--names", action="store_true", help="write the models' names beside them")
    show.add_argument("--no-scans", action="store_true", help="without what the lasers see")
    show.add_argument("--no-axes", action="store_true", help="without axes")
    show.set_defaults(run=_show, parser=show)

    check = commands.add_parser(
        "check",
        parents=[of_worlds],
        help="load a world and say what is in it",
        description="Loads a world and says what is in it, or what is wrong with it.",
    )
    check.set_defaults(run=_check)
    return parser


def _world_arguments() -> argparse.ArgumentParser:
    """Makes the arguments of every command that loads a world."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("world", type=Path, metavar="WORLD", help="world file")
    parser.add_argument(
        "--param",
        type=_parameter,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="what param() in YAML files answers for a name; may be given several times",
    )
    parser.add_argument(
        "--simplify-map",
        type=int,
        choices=SIMPLIFICATIONS,
        default=0,
        help="0 exact, 1 simplified, 2 opened and simplified map boundaries (0)",
    )
    return parser


# -- values of arguments -------------------------------------------------------------------


def _count(text: str) -> int:
    if not re.fullmatch("[0-9]+", text):
        raise argparse.ArgumentTypeError(f"must be a whole number, 0 or more, got {text!r}")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch("([0-9]+)x([0-9]+)", text)
    if not found:
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, as in 1200x800, got {text!r}")
    return int(found[1]), int(found[2])


def _parameter(text: str) -> tuple[str, object]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, as in /noise=0.1, got {text!r}")
    try:
        # As rosparam has it: 1 is a number, true a bool, a b a string.
        return name, yaml.safe_load(value) if value else ""
    except yaml.YAMLError:
        raise argparse.ArgumentTypeError(f"the value is no YAML: {text!r}") from None


def _picture_path(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in PICTURE_FORMATS:
        raise argparse.ArgumentTypeError(
            f"must end with one of {', '.join(PICTURE_FORMATS)}, got {text!r}"
        )
    return path


# -- commands ------------------------------------------------------------------------------


def _load(options: argparse.Namespace, seed: int | None) -> World:
    return World.from_yaml(
        options.world, seed=seed, params=dict(options.param), simplify_map=options.simplify_map
    )


def _show(options: argparse.Namespace) -> None:
    check_matplotlib()  # before the time that loading and stepping takes
    with _load(options, options.seed) as world:
        world.step(options.steps)
        try:
            save(
                world,
                options.output,
                size=options.size,
                dpi=options.dpi,
                view=options.view,
                layers=options.layer,
                names=options.names,
                scans=not options.no_scans,
                axes=not options.no_axes,
            )
        except ValueError as error:
            options.parser.error(str(error))


def _check(options: argparse.Namespace) -> None:
    # Nothing random is shown, so the seed need not be another one each time.
    with _load(options, seed=0) as world:
        print(f"{options.world}: no errors")
        for layer in world.layers:
            print(f"layer {', '.join(layer.names)}: {_counted(len(layer.edges), 'edge')}")
        for model in world.models:
            parts = [
                _counted(len(model.bodies), "body", "bodies"),
                _counted(len(model.joints), "joint"),
            ]
            print(f"model {model.name}: {', '.join(parts)}{_plugins(model.plugins)}")
        if world.plugins:
            print(f"world{_plugins(world.plugins)}")


def _counted(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


def _plugins(plugins: Sequence[FlatlandPlugin]) -> str:
    names = ", ".join(f"{plugin.name} ({plugin.type})" for plugin in plugins)
    return f"; plugins: {names}" if names else ""
