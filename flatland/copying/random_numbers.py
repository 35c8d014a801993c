"""Generators of random numbers."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.copying.kind import Kind, MutableKind

if TYPE_CHECKING:
    from flatland.copying.copier import Copier
    from flatland.copying.record import Recorder


class _Generator(MutableKind):
    """A generator of numpy; its state is that of its bit generator."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.follow((obj.bit_generator,))

    def copy(self, obj: Any, copier: Copier) -> Any:
        return copier.add(obj, type(obj)(copier.copy(obj.bit_generator)))


class _BitGenerator(MutableKind):
    """A bit generator of numpy."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.add(self._write, obj, obj.state)

    @staticmethod
    def _write(obj: Any, state: Any) -> None:
        obj.state = state

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, type(obj)(0))
        made.state = obj.state
        return made


class _PythonRandom(MutableKind):
    """A generator of the module `random`."""

    def record(self, obj: Any, recorder: Recorder) -> None:
        recorder.add(self._write, obj, obj.getstate())

    @staticmethod
    def _write(obj: Any, state: Any) -> None:
        obj.setstate(state)

    def copy(self, obj: Any, copier: Copier) -> Any:
        made = copier.add(obj, type(obj)())
        made.setstate(obj.getstate())
        return made


GENERATORS: Final[tuple[tuple[tuple[type[Any], ...], Kind], ...]] = (
    ((np.random.Generator,), _Generator()),
    ((np.random.BitGenerator,), _BitGenerator()),
    ((random.Random,), _PythonRandom()),
)
"""The kinds of generators, also of classes derived from them."""
