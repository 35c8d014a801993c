"""Arguments that several commands have in common, and the types of their values."""

from __future__ import annotations

import argparse
import math
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from flatland.loading.model_check import is_model_file, load_model_alone
from flatland.loading.world_source import SIMPLIFICATIONS
from flatland.world import World

Commands = Any  # argparse._SubParsersAction, which is not public


def add_command(
    commands: Commands,
    name: str,
    *,
    summary: str,
    description: str,
    examples: Sequence[str],
    parents: Sequence[argparse.ArgumentParser] = (),
) -> argparse.ArgumentParser:
    """Adds a command with examples at the end of its help.

    Args:
        commands: The commands of the parser.
        name: Name of the command.
        summary: Help in the list of commands.
        description: Text at the start of its help.
        examples: Command lines.
        parents: Parsers whose arguments the command has too.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        parents=list(parents),
        help=summary,
        description=textwrap.fill(description, 80),
        epilog="examples:\n" + "".join(f"  {example}\n" for example in examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(parser=parser)
    return parser


def file_arguments(name: str, kind: str) -> argparse.ArgumentParser:
    """Returns a parser of the arguments of all commands that load a file.

    Args:
        name: Name of the file in the usage.
        kind: Kind of the file, for the help.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("path", type=Path, metavar=name, help=kind)
    add_param(parser)
    parser.add_argument(
        "--simplify-map",
        type=int,
        choices=SIMPLIFICATIONS,
        default=0,
        help="0 exact, 1 simplified, 2 opened and simplified map boundaries (default: 0)",
    )
    return parser


def picture_arguments() -> argparse.ArgumentParser:
    """Returns a parser of the arguments of all commands that draw a world."""
    parser = argparse.ArgumentParser(add_help=False)
    group = parser.add_argument_group("picture")
    group.add_argument("--size", type=size, metavar="WxH", help="size of the picture in pixels")
    group.add_argument(
        "--dpi",
        type=positive,
        default=100.0,
        help="pixels per inch, scales the text (default: 100)",
    )
    group.add_argument(
        "--view",
        type=float,
        nargs=4,
        metavar=("X_MIN", "Y_MIN", "X_MAX", "Y_MAX"),
        help="visible area in metres (default: all walls and models)",
    )
    group.add_argument(
        "--layer",
        action="append",
        metavar="NAME",
        help="draw only this layer; may be given several times",
    )
    group.add_argument("--names", action="store_true", help="draw the names of the models")
    group.add_argument("--no-scans", action="store_true", help="do not draw the laser scans")
    group.add_argument("--no-axes", action="store_true", help="do not draw axes")
    return parser


def picture_options(options: argparse.Namespace) -> dict[str, Any]:
    """Returns the arguments of `flatland.draw` for the options of `picture_arguments`."""
    return {
        "size": options.size,
        "dpi": options.dpi,
        "view": options.view,
        "layers": options.layer,
        "names": options.names,
        "scans": not options.no_scans,
        "axes": not options.no_axes,
    }


def add_param(parser: argparse.ArgumentParser) -> None:
    """Adds the option `--param`."""
    parser.add_argument(
        "--param",
        type=parameter,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value of param(NAME) in YAML files; may be given several times",
    )


def add_step_size(parser: argparse.ArgumentParser) -> None:
    """Adds the option `--step-size`."""
    parser.add_argument(
        "--step-size",
        type=positive,
        default=0.005,
        metavar="SECONDS",
        help="simulated time of one step (default: 0.005)",
    )


def load(options: argparse.Namespace, seed: int | None, **more: Any) -> World:
    """Loads the world of the options of `file_arguments`.

    Args:
        options: The options.
        seed: Seed of all random numbers, None to draw one.
        **more: Further arguments of `World.from_yaml`.
    """
    return World.from_yaml(
        options.path,
        seed=seed,
        params=dict(options.param),
        simplify_map=options.simplify_map,
        **more,
    )


def load_world_or_model(options: argparse.Namespace, seed: int | None) -> World:
    """Loads the world or, into an empty world, the model of the options of `file_arguments`.

    Args:
        options: The options.
        seed: Seed of all random numbers, None to draw one.
    """
    params = dict(options.param)
    if is_model_file(options.path, params):
        return load_model_alone(World, options.path, params, seed=seed)
    return load(options, seed)


# -- types of values -----------------------------------------------------------------------


def count(text: str) -> int:
    """Converts an integer of at least 0."""
    if not re.fullmatch("[0-9]+", text):
        raise argparse.ArgumentTypeError(f"must be an integer of at least 0, got {text!r}")
    return int(text)


def positive(text: str) -> float:
    """Converts a finite number above 0."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0):
        raise argparse.ArgumentTypeError(f"must be a number above 0, got {text!r}")
    return number


def size(text: str) -> tuple[int, int]:
    """Converts WIDTHxHEIGHT."""
    found = re.fullmatch("([0-9]+)x([0-9]+)", text)
    if not found:
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, as in 1200x800, got {text!r}")
    return int(found[1]), int(found[2])


def parameter(text: str) -> tuple[str, object]:
    """Converts NAME=VALUE with a YAML value."""
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, as in /noise=0.1, got {text!r}")
    try:
        # YAML as in rosparam: 1 is a number, true a bool, a b a string.
        return name, yaml.safe_load(value) if value else ""
    except yaml.YAMLError:
        raise argparse.ArgumentTypeError(f"the value is not YAML: {text!r}") from None
