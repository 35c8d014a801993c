"""Collects the files and parameters that a world is made from, so that a run can be repeated."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
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
