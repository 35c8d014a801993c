"""Check of the modules without which flatland cannot be imported."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Final

REQUIRED_MODULES: Final = {
    "numpy": "apt-get install python3-numpy",
    "yaml": "apt-get install python3-yaml",
    "lupa": "apt-get install python3-lupa, or pip install lupa",
    "flatland._core": "make setup in a clone of flatland, or pip install of its folder",
}
"""What installs each module."""


def check_requirements() -> None:
    """Checks that the required modules exist.

    Raises:
        ImportError: Some are missing; the text names the command that installs them.
    """
    missing = [name for name in REQUIRED_MODULES if importlib.util.find_spec(name) is None]
    if missing:
        remedies = "; ".join(f"{name}: {REQUIRED_MODULES[name]}" for name in missing)
        doctor = Path(__file__).parent / "cli" / "doctor.py"
        raise ImportError(
            f"flatland requires modules that are not installed ({remedies}); for details, run "
            f"python3 {doctor}",
            name=missing[0],
        )
