"""The included worlds for learning."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from flatland.errors import WorldError

FOLDER: Final = Path("worlds") / "learning"
ROBOT: Final = "robot.model.yaml"


def find_world(world: str | os.PathLike[str]) -> Path:
    """Returns the path of a world file.

    Args:
        world: A path, or the name of an included world, such as `navigate`.

    Raises:
        WorldError: There is no such file.
    """
    path = Path(world).expanduser()
    if path.is_file():
        return path
    name = os.fspath(world)
    if name.isidentifier():
        folder = included_folder()
        path = folder / f"{name}.yaml"
        if path.is_file():
            return path
        known = sorted(p.stem for p in folder.glob("*.yaml") if p.name.count(".") == 1)
        raise WorldError(
            f'world "{name}" does not exist: it is neither a file nor an included world '
            f"({', '.join(known)})"
        )
    raise WorldError(f'world file "{name}" does not exist')


def included_robot() -> Path:
    """Returns the path of the model file of the robot of the included worlds.

    Raises:
        WorldError: This installation lacks the worlds.
    """
    return included_folder() / ROBOT


def included_folder() -> Path:
    """Returns the folder of the included worlds for learning.

    Raises:
        WorldError: This installation lacks the worlds.
    """
    package = Path(__file__).resolve().parents[1]
    # In a source tree the worlds are beside the package; otherwise in the data of the environment.
    for parent in package.parents:
        for folder in (parent / FOLDER, parent / "share" / "flatland" / FOLDER):
            if (folder / ROBOT).is_file():
                return folder
    raise WorldError(f"the included worlds ({FOLDER}) are not installed")
