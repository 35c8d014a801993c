"""Layer names and the collision bits that stand for them."""

from __future__ import annotations

from collections.abc import Iterable

from flatland.errors import YamlError

MAX_LAYERS = 16
ALL_LAYERS = 0xFFFF


class CollisionFilter:
    """Gives each layer name a bit of Box2D's 16 category bits."""

    def __init__(self) -> None:
        """Starts without any name."""
        self._ids: dict[str, int] = {}

    @property
    def names(self) -> list[str]:
        """All names in the order of their ids."""
        return list(self._ids)

    def register(self, names: Iterable[str]) -> list[int]:
        """Gives each of some new names the lowest free id.

        Args:
            names: Names of one layer, its aliases included.

        Returns:
            The ids, 0 to 15, in the order of the names.

        Raises:
            YamlError: A name is taken, or there would be more than 16; nothing is registered then.
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
        """Returns the id of a layer name, -1 when there is none."""
        return self._ids.get(name, -1)

    def unknown(self, names: Iterable[str]) -> list[str]:
        """Returns those of some names that no layer has; `all` alone is always known."""
        names = list(names)
        if names == ["all"]:
            return []
        return [name for name in names if name not in self._ids]

    def category_bits(self, names: Iterable[str]) -> int:
        """Returns the bits that stand for a set of names.

        Args:
            names: Layer names; the single name `all` means every layer, none means no bits.

        Raises:
            YamlError: A name is not that of a layer.
        """
        names = list(names)
        if names == ["all"]:
            return ALL_LAYERS
        unknown = self.unknown(names)
        if unknown:
            raise YamlError(f"{{{','.join(unknown)}}} layer(s) does not exist")
        bits = 0
        for name in names:
            bits |= 1 << self._ids[name]
        return bits
