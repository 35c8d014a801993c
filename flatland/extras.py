"""Optional packages, and the error for those that are not installed."""

from __future__ import annotations

import importlib
from typing import Any

from flatland.errors import FlatlandError
from flatland.requirements import PACKAGES, failure


class MissingPackageError(FlatlandError, ImportError):
    """An optional package is not installed, or cannot be imported.

    The text names the cause and the command that helps.
    """


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
    except Exception as error:  # such as an AttributeError of a module for another numpy
        raise missing(module.partition(".")[0], need, error) from error


def missing(module: str, need: str, error: Exception) -> MissingPackageError:
    """Returns the error for a package whose import has failed; see `require` for the need."""
    reason = str(error).strip().partition("\n")[0]
    name = PACKAGES[module].name
    cause, remedy = failure(module, reason)
    if cause == "not installed":
        return MissingPackageError(f"{need} {name} ({reason}): {remedy}")
    return MissingPackageError(f"{need} {name}, which is {cause}: {remedy}")
