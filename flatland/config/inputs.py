"""Collects the files and parameters that a world is made from, so that a run can be repeated.

Access to files can be limited to some folders, for models that clients of the ROS node spawn.
"""

from __future__ import annotations

import errno
import os
import zlib
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar, cast

T = TypeVar("T")


@dataclass(slots=True)
class InputCache:
    """The contents of the files and parameters of a world when the world was loaded.

    Attributes:
        files: Content of each file.
        results: Parsed contents of other files, such as images, by the arguments of the function.
        params: Values of the parameters.
        grids: The last grid of each layer whose map is received from a topic, by its first name.
    """

    files: dict[str, bytes] = field(default_factory=dict)
    results: dict[Hashable, object] = field(default_factory=dict)
    params: dict[str, object] = field(default_factory=dict)
    grids: dict[str, object] = field(default_factory=dict)


@dataclass(slots=True)
class Inputs:
    """The files and parameters that were read while a world and its models were loaded.

    Attributes:
        seed: Seed of the random numbers of expressions.
        simplify_map: Simplification of map boundaries, see `World.from_yaml`.
        files: Absolute paths of all files as keys, in the order of the first access.
        commands_received: Number of values that commands received, from plugins, when the world
            file was loaded.
        params: Values of all parameters that `param()` looked up; None if one is not set.
        cache: The inputs of the world file, for `World.reset`.
    """

    seed: int = 0
    simplify_map: int = 0
    commands_received: int = 0
    files: dict[str, None] = field(default_factory=dict)
    params: dict[str, object] = field(default_factory=dict)
    cache: InputCache = field(default_factory=InputCache)
    _expressions: int = 0
    _is_caching: bool = False

    @property
    def expression_count(self) -> int:
        """Number of expressions (`$eval`) that were evaluated."""
        return self._expressions

    @contextmanager
    def collecting(self, *, caching: bool = False) -> Iterator[None]:
        """Adds everything that the current thread reads in the block.

        Args:
            caching: Whether to read only what is not in the cache, and to add it to the cache.
        """
        token = _current.set(self)
        was_caching = self._is_caching
        self._is_caching = caching or was_caching
        try:
            yield
        finally:
            self._is_caching = was_caching
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


def cached_file(path: str, read: Callable[[str], bytes]) -> bytes:
    """Returns the content of a file, from the cache of the current world if it is in use.

    Args:
        path: The file.
        read: Reads the file.
    """
    inputs = _current.get()
    if inputs is None or not inputs._is_caching:
        return read(path)
    files, name = inputs.cache.files, str(Path(path).absolute())
    if name in files:
        note_file(path)
    else:
        files[name] = read(path)
    return files[name]


def is_cached_file(path: str) -> bool:
    """Returns whether `cached_file` would return the content of a file from the cache."""
    inputs = _current.get()
    return inputs is not None and (
        inputs._is_caching and str(Path(path).absolute()) in inputs.cache.files
    )


def cached_result(path: str, arguments: Hashable, make: Callable[[], T]) -> T:
    """Returns the parsed content of a file, from the cache of the current world if it is in use.

    Args:
        path: The file.
        arguments: Everything else that the result depends on, and a name of the kind of result.
        make: Reads the file and returns the result, which must not be changed.
    """
    inputs = _current.get()
    if inputs is None or not inputs._is_caching:
        return make()
    results, key = inputs.cache.results, (str(Path(path).absolute()), arguments)
    if key in results:
        note_file(path)
    else:
        results[key] = make()
    return cast("T", results[key])


def look_up_param(name: str, look_up: Callable[[str], object]) -> object:
    """Returns the value of a parameter, from the cache of the current world if it is in use.

    Args:
        name: The parameter.
        look_up: Returns its value; None if it is not set.
    """
    inputs = _current.get()
    if inputs is None:
        return look_up(name)
    if inputs._is_caching and name in inputs.cache.params:
        value = inputs.cache.params[name]
    else:
        value = look_up(name)
    if inputs._is_caching:
        inputs.cache.params[name] = value
    inputs.params[name] = value
    return value


def next_seed() -> int:
    """Returns the seed of the next expression: each one has random numbers of its own."""
    inputs = _current.get()
    if inputs is None:
        return 0
    inputs._expressions += 1
    return zlib.crc32(b"%d %d" % (inputs.seed, inputs._expressions))
