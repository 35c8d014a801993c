"""The command `flatland`: checks and draws worlds without ROS."""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

import flatland
from flatland.drawing import PICTURE_FORMATS, check_matplotlib, save
from flatland.errors import FlatlandError
from flatland.loading.model_check import is_model_file, load_model_alone
from flatland.loading.world_loader import SIMPLIFICATIONS
from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.world import World

_BROKEN_PIPE = 128 + signal.SIGPIPE  # what a shell reports of a program that SIGPIPE ended


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command.

    Args:
        arguments: Without the command's name; None for those of the process.

    Returns:
        0, 1 after an error in a file or of the system, which is printed, or 141 when the reader
        of the output went away, as in `flatland check world.yaml | head -1`.

    Raises:
        SystemExit: The arguments are wrong (code 2), or ask for help or version only (code 0).
    """
    try:
        return _run(arguments)
    except BrokenPipeError:
        # What is still in the buffers has no reader, and is written when the interpreter ends.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr):
            os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        return _BROKEN_PIPE


def _run(arguments: Sequence[str] | None) -> int:
    try:
        try:
            options = _make_parser().parse_args(arguments)
            options.run(options)
        finally:
            # An error would be printed with a traceback when the interpreter ends.
            print(end="", flush=True)
    except BrokenPipeError:
        raise
    except (FlatlandError, OSError) as error:
        print(f"flatland: {error}", file=sys.stderr)
        return 1
    return 0


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="flatland", description=__doc__)
    parser.add_argument("--version", action="version", version=f"flatland {flatland.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    show = commands.add_parser(
        "show",
        parents=[_file_arguments("WORLD", "world file")],
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
        parents=[_file_arguments("FILE", "world or model file")],
        help="load a world or model and say what is in it",
        description="Loads a world or model and says what is in it, or what is wrong with it. "
        "A model is put into an empty world that has the layers that the model names.",
    )
    check.set_defaults(run=_check)
    return parser


def _file_arguments(name: str, kind: str) -> argparse.ArgumentParser:
    """Makes the arguments of every command that loads a file.

    Args:
        name: Of the file in the usage.
        kind: What the file may be.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("path", type=Path, metavar=name, help=kind)
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
        options.path, seed=seed, params=dict(options.param), simplify_map=options.simplify_map
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
    if is_model_file(options.path, dict(options.param)):
        with load_model_alone(World, options.path, dict(options.param)) as world:
            layers = ", ".join(world.collision_filter.names) or "none"
            _print_contents(options.path, world)
            print(f"checked in an empty world with the layers that the model names: {layers}")
    else:
        # Nothing random is shown, so the seed need not be another one each time.
        with _load(options, seed=0) as world:
            _print_contents(options.path, world)


def _print_contents(path: Path, world: World) -> None:
    print(f"{path}: no errors")
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
