"""The command `flatland`: checks and draws worlds without ROS."""

from __future__ import annotations

import argparse
import logging
import os
import re
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import yaml

import flatland
from flatland.drawing import PICTURE_FORMATS, check_matplotlib, save
from flatland.errors import FlatlandError
from flatland.loading.model_check import is_model_file, load_model_alone
from flatland.loading.world_loader import SIMPLIFICATIONS
from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.world import World

_BROKEN_PIPE = 128 + signal.SIGPIPE  # exit code in a shell of a program ended by SIGPIPE


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command.

    Args:
        arguments: Arguments without the name of the command; None for those of the process.

    Returns:
        The exit code: 0 for success, 1 for an error of a file or of the system, which is printed,
        or for problems that `flatland check` found, or 141 if the reader closed the output, as in
        `flatland check world.yaml | head -1`.

    Raises:
        SystemExit: The arguments are invalid (code 2), or request the help or version (code 0).
    """
    try:
        return _run(arguments)
    except BrokenPipeError:
        # The interpreter flushes the buffers at its end; redirect them, as they have no reader.
        null_device = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr):
            os.dup2(null_device, stream.fileno())
        os.close(null_device)
        return _BROKEN_PIPE


def _run(arguments: Sequence[str] | None) -> int:
    try:
        try:
            options = _make_parser().parse_args(arguments)
            code: int = options.run(options)
        finally:
            # Flush here: an error at the end of the interpreter is printed with a traceback.
            print(end="", flush=True)
    except BrokenPipeError:
        raise
    except (FlatlandError, OSError) as error:
        print(f"flatland: {error}", file=sys.stderr)
        return 1
    return code


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="flatland", description=__doc__)
    parser.add_argument("--version", action="version", version=f"flatland {flatland.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    show = commands.add_parser(
        "show",
        parents=[_file_arguments("WORLD", "world file")],
        help="draw a picture of a world",
        description="Loads a world, optionally steps it, and draws a picture of it.",
    )
    show.add_argument(
        "-o",
        "--output",
        required=True,
        type=_picture_path,
        metavar="FILE",
        help=f"picture file ({', '.join(PICTURE_FORMATS)}); an existing file is overwritten",
    )
    show.add_argument(
        "--steps", type=_count, default=0, help="number of steps before the picture (default: 0)"
    )
    show.add_argument("--seed", type=_count, help="seed of all noise (default: random)")
    show.add_argument("--size", type=_size, metavar="WxH", help="size of the picture in pixels")
    show.add_argument(
        "--dpi", type=float, default=100.0, help="pixels per inch, scales the text (default: 100)"
    )
    show.add_argument(
        "--view",
        type=float,
        nargs=4,
        metavar=("X_MIN", "Y_MIN", "X_MAX", "Y_MAX"),
        help="visible area in metres (default: all walls and models)",
    )
    show.add_argument(
        "--layer",
        action="append",
        metavar="NAME",
        help="draw only this layer; may be given several times",
    )
    show.add_argument("--names", action="store_true", help="draw the names of the models")
    show.add_argument("--no-scans", action="store_true", help="do not draw the laser scans")
    show.add_argument("--no-axes", action="store_true", help="do not draw axes")
    show.set_defaults(run=_show, parser=show)

    check = commands.add_parser(
        "check",
        parents=[_file_arguments("FILE", "world or model file")],
        help="load a world or model and print its contents",
        description="Loads a world or model and prints its contents, or an error. "
        "A model is loaded into an empty world with the layers that the model names.",
    )
    check.set_defaults(run=_check)
    return parser


def _file_arguments(name: str, kind: str) -> argparse.ArgumentParser:
    """Returns a parser of the arguments of all commands that load a file.

    Args:
        name: Name of the file in the usage.
        kind: Kind of the file, for the help.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("path", type=Path, metavar=name, help=kind)
    parser.add_argument(
        "--param",
        type=_parameter,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value of param(NAME) in YAML files; may be given several times",
    )
    parser.add_argument(
        "--simplify-map",
        type=int,
        choices=SIMPLIFICATIONS,
        default=0,
        help="0 exact, 1 simplified, 2 opened and simplified map boundaries (default: 0)",
    )
    return parser


# -- values of arguments -------------------------------------------------------------------


def _count(text: str) -> int:
    if not re.fullmatch("[0-9]+", text):
        raise argparse.ArgumentTypeError(f"must be an integer of at least 0, got {text!r}")
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
        # YAML as in rosparam: 1 is a number, true a bool, a b a string.
        return name, yaml.safe_load(value) if value else ""
    except yaml.YAMLError:
        raise argparse.ArgumentTypeError(f"the value is not YAML: {text!r}") from None


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


def _show(options: argparse.Namespace) -> int:
    check_matplotlib()  # before loading and stepping, which may take long
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
    return 0


def _check(options: argparse.Namespace) -> int:
    with _collected_warnings() as problems:
        is_model = is_model_file(options.path, dict(options.param))
        if is_model:
            world = load_model_alone(World, options.path, dict(options.param))
        else:
            # A fixed seed: nothing random is printed, and no log line about a drawn seed is wanted.
            world = _load(options, seed=0)
    with world:
        if problems:
            print(f"{options.path}: {_counted(len(problems), 'problem')}")
            for problem in problems:
                print(f"problem: {problem}")
        else:
            print(f"{options.path}: no errors")
        _print_contents(world)
        if is_model:
            layers = ", ".join(world.collision_filter.names) or "none"
            print(f"checked in an empty world with the layers that the model names: {layers}")
    return 1 if problems else 0


@contextmanager
def _collected_warnings() -> Iterator[list[str]]:
    """Collects the warnings that are logged in the block; prints them if it raises."""
    texts: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            texts.append(record.getMessage())

    log, handler = logging.getLogger("flatland"), Collector(logging.WARNING)
    propagate, log.propagate = log.propagate, False
    log.addHandler(handler)
    try:
        yield texts
    except FlatlandError:
        for text in texts:
            print(f"problem: {text}", file=sys.stderr)
        raise
    finally:
        log.removeHandler(handler)
        log.propagate = propagate


def _print_contents(world: World) -> None:
    for layer in world.layers:
        text = f"layer {', '.join(layer.names)}: {_counted(len(layer.edges), 'edge')}"
        if layer.unknown_map_keys:
            text += f"; unknown keys in the map file: {', '.join(layer.unknown_map_keys)}"
        print(text)
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
