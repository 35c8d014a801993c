"""A table of episodes of a robot, over worlds, seeds and controllers, on many machines."""

import sys
from pathlib import Path


def _extensions(entry: str) -> list[Path]:
    return list(Path(entry, "flatland").glob("_core.*so"))


# The workers of Ray search the current folder first. There, the sources of a clone, which have no
# extension, would hide the installed package.
if any(map(_extensions, sys.path)):
    sys.path[:] = [
        entry
        for entry in sys.path
        if _extensions(entry) or not Path(entry, "flatland", "__init__.py").is_file()
    ]
