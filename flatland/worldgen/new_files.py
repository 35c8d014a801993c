"""Files that are created from templates: all of them, or none."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from flatland.output_files import named_errors

_SUFFIX = ".in"


def expand(templates: Traversable, values: Mapping[str, str]) -> dict[str, bytes]:
    """Returns the contents of files by their relative paths.

    Args:
        templates: Folder of templates, whose names end with `.in`; in names, `__name__` stands for
            the value of `name`.
        values: Replacement of each `@KEY@` in the texts by key.
    """
    files: dict[str, bytes] = {}
    for entry in sorted(templates.iterdir(), key=lambda entry: entry.name):
        name = entry.name.replace("__name__", values["name"])
        if entry.is_dir():
            files |= {f"{name}/{path}": data for path, data in expand(entry, values).items()}
        elif name.endswith(_SUFFIX):
            text = entry.read_text(encoding="utf-8")
            for key, value in values.items():
                text = text.replace(f"@{key}@", value)
            files[name.removesuffix(_SUFFIX)] = text.encode()
    return files


def write_new(target: Path, files: Mapping[str, bytes], member: str = "") -> None:
    """Writes files into a new folder.

    Args:
        target: The folder; the folder that contains it must exist.
        files: Contents by relative path.
        member: The only file to keep, which becomes `target` itself; by default, all are kept.

    Raises:
        OSError: A file cannot be written; nothing is left behind.
    """
    # In a temporary folder first, so that nothing incomplete is left behind.
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".flatland-new-") as temporary:
        content = Path(temporary) / "content"
        for name, data in files.items():
            path = content / name
            path.parent.mkdir(parents=True, exist_ok=True)
            with named_errors(target if name == member else target / name, path):
                path.write_bytes(data)
        os.rename(content / member, target)  # noqa: PTH104


def grey_image(pixels: npt.NDArray[np.uint8]) -> bytes:
    """Returns a grey image (PGM), whose bytes depend on no library, from the top row down."""
    rows, columns = pixels.shape
    return b"P5\n%d %d\n255\n" % (columns, rows) + pixels.tobytes()
