"""The hash of the state of a world, for comparisons of two runs."""

from __future__ import annotations

import dataclasses
import hashlib
import struct
from collections.abc import Mapping, Sequence, Set
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.errors import WorldError
from flatland.plugin_api.plugin import FlatlandPlugin, describe

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.physics import PhysicsWorld
    from flatland.timekeeper import Timekeeper

_DIGEST_BYTES: Final = 16


def state_hash(
    seed: int,
    timekeeper: Timekeeper,
    physics: PhysicsWorld,
    models: Sequence[Model],
    world_plugins: Sequence[FlatlandPlugin],
) -> str:
    """Returns the hash of the state of a world; see `World.state_hash`.

    Args:
        seed: Seed of the world.
        timekeeper: Simulated time of the world.
        physics: Contains all bodies.
        models: The models in the order in which they were spawned.
        world_plugins: The world plugins in order of loading.

    Raises:
        WorldError: The state of a plugin cannot be hashed.
        Exception: Raised by the method `state` of a plugin.
    """
    hasher = StateHasher()
    hasher.add((seed, timekeeper.sim_time_ns, timekeeper.step_size_ns))
    hasher.add(physics.body_states())
    for model in models:
        hasher.add((model.name, model.namespace, len(model.bodies), len(model.joints)))
        _add_plugins(hasher, model.plugins)
    _add_plugins(hasher, world_plugins)
    return hasher.hexdigest()


def _add_plugins(hasher: StateHasher, plugins: Sequence[FlatlandPlugin]) -> None:
    for plugin in plugins:
        hasher.add((plugin.name, plugin.type))
        hasher.add(plugin._random_state())
        # Of the class: the instance may have an attribute of its own with this name.
        state = type(plugin).state(plugin)
        try:
            hasher.add(plugin._command_state())
            hasher.add(state)
        except TypeError as error:
            raise WorldError(f"{describe(plugin)}: its state has {error}") from None


class StateHasher:
    """Computes the hash of plain values.

    Every value is preceded by its kind and size, so that different sequences of values have
    different encodings. Numbers are hashed by their exact bits: 0.0 and -0.0 differ, as do 1 and
    1.0.
    """

    def __init__(self) -> None:
        """Creates the hash of an empty sequence."""
        self._digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)

    def hexdigest(self) -> str:
        """Returns the hash of all values so far, 32 hexadecimal digits."""
        return self._digest.hexdigest()

    def add(self, value: Any) -> None:
        """Appends a value.

        Args:
            value: None, a bool, number, string, bytes, array of numbers, dataclass, or a tuple,
                list, set or mapping of such values. The order of sets and mappings has no effect.

        Raises:
            TypeError: The value, or one inside it, has another type; the text describes it.
        """
        match value:
            case None:
                self._write(b"N", b"")
            case bool() | np.bool_():
                self._write(b"B", b"1" if value else b"0")
            case int() | np.integer():
                self._write(b"I", str(int(value)).encode())
            case float() | np.floating():
                self._write(b"F", struct.pack("<d", float(value)))
            case str():
                self._write(b"S", value.encode("utf-8", "surrogatepass"))
            case bytes() | bytearray():
                self._write(b"Y", bytes(value))
            case np.ndarray() if value.dtype.kind in "biuf":
                self._write(b"A", f"{value.dtype.str}{value.shape}".encode())
                self._write(b"D", np.ascontiguousarray(value).tobytes())
            case tuple() | list():
                self._open(b"L", len(value))
                for item in value:
                    self.add(item)
            case Set():
                self._add_unordered(b"U", list(value))
            case Mapping():
                self._add_unordered(b"M", list(value.items()))
            case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
                fields = dataclasses.fields(value)
                self._open(b"C", len(fields))
                for field in fields:
                    self.add(getattr(value, field.name))
            case _:
                raise TypeError(f"a value of type {type(value).__name__}, which cannot be hashed")

    def _add_unordered(self, kind: bytes, items: Sequence[Any]) -> None:
        digests = []
        for item in items:
            part = StateHasher()
            part.add(item)
            digests.append(part._digest.digest())
        self._open(kind, len(digests))
        for digest in sorted(digests):
            self._digest.update(digest)

    def _open(self, kind: bytes, count: int) -> None:
        self._digest.update(kind + struct.pack("<Q", count))

    def _write(self, kind: bytes, content: bytes) -> None:
        self._digest.update(kind + struct.pack("<Q", len(content)))
        self._digest.update(content)
