"""Worker processes of scenarios that are forked from one process, which has imported the package.

A process that imports everything itself, as those of `flatland test` do, takes longer to start.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping
from typing import Any, Final

_FORKSERVER: Final = multiprocessing.get_context("forkserver")
_IMPORTED: Final = (
    "__main__",
    "PIL.PngImagePlugin",
    "flatland.plugins.diff_drive",
    "flatland.plugins.laser",
    "flatland.recording",
    "flatland.scenarios.episode",
    "flatland.scenarios.ros1",
    "rosmaster.master",
)


class _Context:
    """Creates processes with the current environment, not that of the first one."""

    Pipe = staticmethod(_FORKSERVER.Pipe)
    Value = staticmethod(_FORKSERVER.Value)

    def Process(  # noqa: N802 - as multiprocessing
        self, target: Callable[..., None], args: tuple[Any, ...], *, daemon: bool
    ) -> multiprocessing.process.BaseProcess:
        """Returns a process that has not been started."""
        args = (dict(os.environ), target, args)
        return _FORKSERVER.Process(target=_run, args=args, daemon=daemon)


def _run(environment: Mapping[str, str], target: Callable[..., None], args: Any) -> None:
    os.environ.clear()
    os.environ.update(environment)
    target(*args)


_FORKSERVER.set_forkserver_preload(list(_IMPORTED))
CONTEXT: Final = _Context()
"""Takes the place of `flatland.scenarios.workers._CONTEXT`."""
