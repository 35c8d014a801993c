"""Opens files that users name, and nothing else that a path may lead to."""

from __future__ import annotations

import errno
import stat
from pathlib import Path
from typing import BinaryIO


def open_regular(path: str) -> BinaryIO:
    """Opens a file to read its bytes.

    Args:
        path: A plain file: a pipe would block for ever, and a device may never end.

    Raises:
        OSError: There is no such file, it is not a regular one, or it cannot be read.
    """
    try:
        is_regular = stat.S_ISREG(Path(path).stat().st_mode)
    except ValueError as error:  # a zero byte in the name
        raise FileNotFoundError(errno.ENOENT, str(error), path) from error
    if not is_regular:
        raise OSError(errno.EINVAL, "it is not a regular file", path)
    return Path(path).open("rb")
