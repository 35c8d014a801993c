"""`flatland new`: creates a robot, a world or a package with a plugin to start from."""

from __future__ import annotations

import argparse
import importlib.resources
import keyword
import re
import secrets
import sys
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from flatland.cli.arguments import Commands, add_command, count, positive
from flatland.errors import FlatlandError

_EXAMPLES = (
    "flatland new robot rover",
    "flatland new world arena",
    "flatland new world floor --office --seed 7",
    "flatland new world depot --warehouse --seed 7 --size 80x40",
    "flatland new plugin speedometer",
    "flatland new world lab --folder worlds",
)
_NEXT = {
    "robot": ("flatland check {path}", "flatland info {path}"),
    "world": (
        "flatland check {path}/world.yaml",
        "flatland show {path}/world.yaml -o {name}.png",
        "flatland run {path}/world.yaml --duration 60",
        "roslaunch flatland server.launch world_path:=$PWD/{path}/world.yaml",
    ),
    "plugin": ("python3 -m unittest discover -s {path}/test",),
}
_TEMPLATES = {"robot": "flatland.worldgen", "world": "flatland.cli", "plugin": "flatland.cli"}
_RANDOM_OPTIONS = ("seed", "size", "resolution", "radius")
_MAX_DRAWN_SEED = 2**31
_PIXELS_PER_METRE = 20
_ROOM = (8.0, 6.0)  # m


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "new",
        summary="create a robot, a world or a plugin to start from",
        description="Creates commented files that run: a robot with a drive and a laser scanner "
        "(the file NAME.model.yaml), a world with a map and a robot (the folder NAME), or a ROS "
        "package with a plugin and its test (the folder NAME). The map of a world can be a random "
        "floor plan. Existing files are never changed.",
        examples=_EXAMPLES,
    )
    parser.add_argument("kind", choices=sorted(_NEXT), help="what to create")
    parser.add_argument("name", metavar="NAME", help="letters, digits and underscores")
    parser.add_argument(
        "--folder",
        type=Path,
        default=Path(),
        help="existing folder to create it in (default: the current one)",
    )
    group = parser.add_argument_group("random worlds")
    kinds = group.add_mutually_exclusive_group()
    for kind, text in (
        ("office", "rooms with furniture along corridors"),
        ("maze", "passages with several ways"),
        ("warehouse", "racks along aisles, docks and goods"),
    ):
        kinds.add_argument(
            f"--{kind}",
            dest="plan",
            action="store_const",
            const=kind,
            help=f"a random {kind}: {text}",
        )
    group.add_argument("--seed", type=count, help="of the random numbers (default: a new one)")
    group.add_argument(
        "--size", type=_size, metavar="WxH", help="width and height in metres (default: 60x25)"
    )
    group.add_argument(
        "--resolution", type=positive, help="cell of the map in metres (default: 0.05)"
    )
    group.add_argument(
        "--radius",
        type=positive,
        help="of the largest robot that reaches every free place, in metres (default: 0.3)",
    )
    parser.set_defaults(run=_new)


def _new(options: argparse.Namespace) -> int:
    given = {name: getattr(options, name) for name in _RANDOM_OPTIONS}
    given = {name: value for name, value in given.items() if value is not None}
    if options.plan is not None and options.kind != "world":
        options.parser.error(f"--{options.plan} is an option of `flatland new world`")
    if options.plan is None and given:
        options.parser.error(f"--{next(iter(given))} requires --office, --maze or --warehouse")
    if options.plan is None:
        path = create(options.kind, options.name, options.folder)
        print(f"created {path}")
    else:
        given.setdefault("seed", secrets.randbelow(_MAX_DRAWN_SEED))
        path = create_random(options.plan, options.name, options.folder, **given)
        print(f"created {path}, seed {given['seed']}")
    print("next:")
    for command in _NEXT[options.kind]:
        print(f"  {command.format(path=path, name=options.name)}")
    return 0


def create(kind: str, name: str, folder: Path) -> Path:
    """Creates a robot, a world or a plugin.

    Args:
        kind: `robot`, `world` or `plugin`.
        name: Its name.
        folder: Existing folder to create it in.

    Returns:
        The file of the robot, or the folder of the world or plugin.

    Raises:
        FlatlandError: The name is invalid, or the file or folder exists.
        OSError: A file cannot be written; nothing is left behind.
    """
    _check_name(kind, name)
    target = folder / (f"{name}.model.yaml" if kind == "robot" else name)
    _check_target(target)
    # Imported late, because most commands do not create files.
    from flatland.worldgen.new_files import expand, grey_image, write_new

    files = expand(*_templates(kind, name))
    if kind == "world":
        files |= expand(*_templates("robot", "robot")) | {"map.pgm": grey_image(_map())}
    write_new(target, files, target.name if kind == "robot" else "")
    return target


def create_random(kind: str, name: str, folder: Path, **arguments: Any) -> Path:
    """Creates a random world.

    Args:
        kind: `office`, `maze` or `warehouse`.
        name: Name of the world.
        folder: Existing folder to create it in.
        **arguments: Further arguments of `flatland.worldgen.generate`.

    Returns:
        The folder of the world.

    Raises:
        FlatlandError: The name or an argument is invalid, or the folder of the world exists.
        OSError: A file cannot be written; nothing is left behind.
    """
    _check_name("world", name)
    target = folder / name
    _check_target(target)
    from flatland.worldgen import generate  # Late, as in `create`.

    try:
        generate(kind, **arguments).write(target)
    except ValueError as error:
        raise FlatlandError(str(error)) from None
    return target


def _size(text: str) -> tuple[float, float]:
    """Converts WIDTHxHEIGHT in metres."""
    try:
        width, height = (float(side) for side in text.split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be WIDTHxHEIGHT in metres, as in 60x25, got {text!r}"
        ) from None
    return width, height


def _check_target(target: Path) -> None:
    if target.exists() or target.is_symlink():
        raise FlatlandError(f"{target} exists, choose another name or --folder")
    if not target.parent.is_dir():
        raise FlatlandError(f"the folder {target.parent} does not exist")


def _check_name(kind: str, name: str) -> None:
    if kind == "plugin":
        if not re.fullmatch("[a-z][a-z0-9_]*", name):
            raise FlatlandError(
                "the name of a package must start with a lower-case letter and contain only "
                f"lower-case letters, digits and underscores, got {name!r}"
            )
        if keyword.iskeyword(name) or name in sys.stdlib_module_names or name == "flatland":
            raise FlatlandError(f"the name {name!r} is that of a Python keyword or module")
    elif not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        raise FlatlandError(
            "the name must start with a letter and contain only letters, digits and underscores, "
            f"got {name!r}"
        )


def _templates(kind: str, name: str) -> tuple[Traversable, dict[str, str]]:
    """Returns the folder of templates of a kind, and the values in them."""
    class_name = "".join(part.capitalize() for part in name.split("_"))
    folder = importlib.resources.files(_TEMPLATES[kind]) / "templates" / kind
    return folder, {"name": name, "Name": class_name}


def _map() -> npt.NDArray[np.uint8]:
    """Returns the grey values of a room with a partition and two pillars."""
    width, height = (round(side * _PIXELS_PER_METRE) for side in _ROOM)
    image = np.zeros((height, width), np.uint8)  # black is occupied

    def fill(x_min: float, y_min: float, x_max: float, y_max: float, value: int) -> None:
        columns = slice(round(x_min * _PIXELS_PER_METRE), round(x_max * _PIXELS_PER_METRE))
        rows = slice(
            height - round(y_max * _PIXELS_PER_METRE), height - round(y_min * _PIXELS_PER_METRE)
        )
        image[rows, columns] = value

    fill(0.2, 0.2, _ROOM[0] - 0.2, _ROOM[1] - 0.2, 255)
    fill(5.0, 2.0, 5.2, _ROOM[1], 0)  # the partition leaves a passage of 1.8 m
    fill(2.8, 3.6, 3.2, 4.0, 0)
    fill(6.4, 2.4, 6.8, 2.8, 0)
    return image
