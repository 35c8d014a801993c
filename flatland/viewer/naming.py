"""Names for models that are spawned from files."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import PurePath


def model_name(path: str) -> str:
    """Makes a model's name of its file's name: without the ending, `.` becomes `_`.

    The name is a namespace as well, so all else that is not legal in one becomes `_`, too.
    """
    name = re.sub(r"\W", "_", PurePath(path).stem, flags=re.ASCII)
    return name if not name or name[0].isalpha() else f"m{name}"


def numbered(name: str, taken: Collection[str]) -> str:
    """Appends the lowest number, from 1, that makes a name that is not taken."""
    number = 1
    while f"{name}{number}" in taken:
        number += 1
    return f"{name}{number}"
