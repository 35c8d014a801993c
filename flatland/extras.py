"""Optional packages, and the error for those that are not installed."""

from __future__ import annotations

import importlib
from typing import Any

from flatland.errors import FlatlandError
from flatland.requirements import PACKAGES, install_command


class MissingPackageError(FlatlandError, ImportError):
    """An optional package is not installed; the text names the command that installs it."""


def require(module: str, need: str) -> Any:
    """Imports an optional module.

    Args:
        module: Name of the module, in a package of `flatland.requirements.PACKAGES`.
        need: What needs the package, with the verb, for the error.

    Returns:
        The module.

    Raises:
        MissingPackageError: The package is not installed, or its import fails.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise missing(module.partition(".")[0], need, error) from error


def missing(module: str, need: str, error: ImportError) -> MissingPackageError:
    """Returns the error for a package whose import has failed; see `require` for the need."""
    reason = str(error).partition("\n")[0]
    name = PACKAGES[module].name
    return MissingPackageError(f"{need} {name} ({reason}): {install_command(module)}")
