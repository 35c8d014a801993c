"""Names of layers and the category bits assigned to them."""

from __future__ import annotations

from collections.abc import Iterable

from flatland.errors import YamlError
from flatland.suggestions import did_you_mean

MAX_LAYERS = 16
ALL_LAYERS = 0xFFFF


class CollisionFilter:
    """Assigns one of the 16 category bits of Box2D to each layer name.

    Attributes:
        is_complete: Whether all names are registered. Otherwise, if errors of the layers were
            collected, names that are not registered are accepted, and have no bits.
    """

    def __init__(self) -> None:
        """Creates a filter without names."""
        self._ids: dict[str, int] = {}
        self.is_complete = True

    def __getstate__(self) -> tuple[str, ...]:
        """Returns the part of the state of the world that a snapshot saves."""
        return tuple(self._ids)

    def __setstate__(self, names: tuple[str, ...]) -> None:
        """Restores a saved state."""
        self._ids = {name: number for number, name in enumerate(names)}

    def clear(self) -> None:
        """Removes all names."""
        self._ids.clear()

    @property
    def names(self) -> list[str]:
        """All names in order of their ids."""
        return list(self._ids)

    def register(self, names: Iterable[str]) -> list[int]:
        """Assigns the lowest free ids to new names.

        Args:
            names: All names of a layer.

        Returns:
            The ids in the order of the names, each from 0 to 15.

        Raises:
            YamlError: A name already exists, or the number of names would exceed 16. No name is
                registered in that case.
        """
        names = list(names)
        taken = set(self._ids)
        for name in names:
            if name in taken:
                raise YamlError(f'Layer with name "{name}" already exists')
            taken.add(name)
        if len(self._ids) + len(names) > MAX_LAYERS:
            raise YamlError(
                f"Unable to add {len(names)} additional layer(s) {{{', '.join(names)}}}, "
                f"current layers count is {len(self._ids)}, max allowed is {MAX_LAYERS}"
            )
        for name in names:
            self._ids[name] = len(self._ids)
        return [self._ids[name] for name in names]

    def layer_id(self, name: str) -> int:
        """Returns the id of a layer name, -1 if no layer has the name."""
        return self._ids.get(name, -1)

    def names_of(self, category_bits: int) -> list[str]:
        """Returns the names of some category bits, in order of their ids."""
        return [name for name, number in self._ids.items() if category_bits >> number & 1]

    def unknown(self, names: Iterable[str]) -> list[str]:
        """Returns the names that no layer has; the single name `all` is always accepted."""
        names = list(names)
        if names == ["all"] or not self.is_complete:
            return []
        return [name for name in names if name not in self._ids]

    def category_bits(self, names: Iterable[str]) -> int:
        """Returns the category bits of a set of names.

        Args:
            names: Layer names; the single name `all` stands for all layers, an empty list for no
                layer.

        Raises:
            YamlError: No layer has one of the names.
        """
        names = list(names)
        if names == ["all"]:
            return ALL_LAYERS
        unknown = self.unknown(names)
        if unknown:
            hint = did_you_mean(unknown[0], self._ids, "layers of the world")
            raise YamlError(f"{{{','.join(unknown)}}} layer(s) does not exist", hint=hint)
        bits = 0
        for name in names:
            bits |= 1 << self._ids[name] if name in self._ids else 0
        return bits
