"""Check of the optional packages of the room."""

from __future__ import annotations

import importlib.util
from typing import Final

INSTALL: Final = 'pip install "flatland-sim[gym]"'


def check_gymnasium() -> None:
    """Checks that Gymnasium is installed.

    Raises:
        ImportError: It is not; the text names the command that installs it.
    """
    _check("gymnasium", "flatland.gym", "Gymnasium")


def check_pettingzoo() -> None:
    """Checks that PettingZoo is installed.

    Raises:
        ImportError: It is not; the text names the command that installs it.
    """
    _check("pettingzoo", "environments with several robots", "PettingZoo")


def _check(module: str, user: str, package: str) -> None:
    if importlib.util.find_spec(module) is None:
        verb = "require" if user.endswith("s") else "requires"
        raise ImportError(
            f"{user} {verb} {package}, which is not installed: {INSTALL}", name=module
        )
