"""Collects the files and parameters that a world is made from, so that a run can be repeated.

Access to files can be limited to some folders, for models that clients of the ROS node spawn.
"""

from __future__ import annotations

import errno
import os
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(slots=True)
class Inputs:
    """What was read while a world and its models were loaded.

    Attributes:
        seed: Seed of the random numbers of expressions.
        simplify_map: Simplification of map boundaries, see `World.from_yaml`.
        files: Absolute paths of all files as keys, in the order of the first access.
        commands_received: Number of values that commands received, from plugins, when the world
            file was loaded.
        params: Values of all parameters that `param()` looked up; None if one is not set.
    """

    seed: int = 0
    simplify_map: int = 0
    commands_received: int = 0
    files: dict[str, None] = field(default_factory=dict)
    params: dict[str, object] = field(default_factory=dict)
    _expressions: int = 0

    @contextmanager
    def collecting(self) -> Iterator[None]:
        """Adds everything that the current thread reads in the block."""
        token = _current.set(self)
        try:
            yield
        finally:
            _current.reset(token)


_current: ContextVar[Inputs | None] = ContextVar("flatland_inputs", default=None)


_allowed: ContextVar[tuple[str, ...] | None] = ContextVar("flatland_folders", default=None)


def real_folders(folders: Iterable[str | os.PathLike[str]] | None) -> tuple[str, ...] | None:
    """Returns the absolute paths of some folders without symbolic links, None for None.

    Raises:
        ValueError: The argument is a single path or empty, or a path is not a folder.
    """
    if folders is None:
        return None
    if isinstance(folders, str | os.PathLike):
        raise ValueError(f"model_path must be a list of folders, got {os.fspath(folders)!r}")
    paths = [Path(folder).expanduser() for folder in folders]
    if not paths:
        raise ValueError("model_path must contain at least one folder")
    for path in paths:
        if not path.is_dir():
            raise ValueError(f"model_path must be a list of folders, {str(path)!r} is not a folder")
    return tuple(os.path.realpath(path) for path in paths)


@contextmanager
def only_files_in(folders: tuple[str, ...] | None) -> Iterator[None]:
    """Restricts the files that the current thread reads in the block.

    Args:
        folders: Result of `real_folders`; None for no restriction.
    """
    token = _allowed.set(folders)
    try:
        yield
    finally:
        _allowed.reset(token)


def check_allowed(path: str) -> None:
    """Checks that a file may be read; symbolic links are resolved first.

    Raises:
        PermissionError: The file is outside the folders of `only_files_in`, whether it exists or
            not.
    """
    folders = _allowed.get()
    # No file has a name with a null character.
    if folders is None or "\0" in path:
        return
    real = os.path.realpath(path)
    if not any(os.path.commonpath((real, folder)) == folder for folder in folders):
        raise PermissionError(
            errno.EACCES, f"it is outside the folders of model_path, {', '.join(folders)}", path
        )


def note_file(path: str) -> None:
    """Records that a file is read."""
    inputs = _current.get()
    if inputs is not None:
        inputs.files[str(Path(path).absolute())] = None


def note_param(name: str, value: object) -> None:
    """Records that a parameter is looked up."""
    inputs = _current.get()
    if inputs is not None:
        inputs.params[name] = value


def next_seed() -> int:
    """Returns the seed of the next expression: each one has random numbers of its own."""
    inputs = _current.get()
    if inputs is None:
        return 0
    inputs._expressions += 1
    return zlib.crc32(b"%d %d" % (inputs.seed, inputs._expressions))
