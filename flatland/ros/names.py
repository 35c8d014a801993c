"""Names that ROS takes, for things that may be called anything."""

from __future__ import annotations

import re
from typing import Final

_LEGAL: Final = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
_ILLEGAL_CHARACTER: Final = re.compile(r"[^A-Za-z0-9_/]")


def legal_name(name: str) -> str:
    """Turns any name into one that may stand behind a namespace in a ROS name.

    Legal names stay as they are; every other character becomes an underscore.
    """
    # Not by rosgraph: it lets letters of all alphabets pass, which roscpp refuses.
    if _LEGAL.fullmatch(name):
        return name
    parts = _ILLEGAL_CHARACTER.sub("_", name).split("/")
    return "/".join(filter(None, parts)) or "_"


def sendable_text(text: str) -> str:
    """Replaces what UTF-8 cannot hold, which no ROS message can carry."""
    return text.encode("utf-8", "replace").decode()


class UniqueNames:
    """Gives each of many things a name that no other has."""

    def __init__(self) -> None:
        """Has given no name yet."""
        self._taken: set[str] = set()

    def claim(self, wanted: str) -> str:
        """Gives a name that is not in use: the wanted one, or that with a number behind it."""
        name, number = wanted, 1
        while name in self._taken:
            number += 1
            name = f"{wanted}_{number}"
        self._taken.add(name)
        return name

    def release(self, name: str) -> None:
        """Lets others have a name that `claim` gave."""
        self._taken.discard(name)
