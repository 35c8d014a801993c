"""The reason why an image cannot be read."""

from __future__ import annotations

import re
from typing import Final

from flatland.config.file_kinds import missing_file
from flatland.config.files import LFS_HINT, LFS_START, foreign_kind, open_regular
from flatland.config.foreign_files import foreign_file

_HEADER_SIZE: Final = 512  # bytes
_TAIL_SIZE: Final = 64  # bytes, in which the end of an image is searched
_ENDS: Final = {b"\x89PNG": b"IEND", b"\xff\xd8": b"\xff\xd9"}
_RAW_PGM: Final = re.compile(rb"P5\s(?:#[^\n]*\n|\s)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s")


def why_unreadable(path: str, error: OSError) -> str:
    """Returns why an image cannot be read, and what helps.

    Args:
        path: The image.
        error: The error of reading it.
    """
    if isinstance(error, PermissionError):  # also for a file outside of the allowed folders
        return f"the file cannot be read: {error.strerror}"
    try:
        with open_regular(path) as file:
            head = file.read(_HEADER_SIZE)
            size = file.seek(0, 2)
            file.seek(max(0, size - _TAIL_SIZE))
            tail = file.read()
    except (FileNotFoundError, NotADirectoryError):
        similar = missing_file(path, "image")
        return f"the file does not exist; {similar}" if similar else "the file does not exist"
    except OSError as reason:
        return f"the file cannot be read: {reason.strerror}"
    if not size:
        return "the file is empty"
    if head.startswith(LFS_START):
        return LFS_HINT
    if foreign_kind(head) != "image":
        foreign = foreign_file(head)
        return f"the file is not an image; {foreign}" if foreign else "the file is not an image"
    if _is_truncated(head, tail, size):
        return f"the image is truncated after {size} bytes; copy or download the file again"
    detail = f" ({error.__cause__})" if str(error.__cause__ or "") else ""
    return f"the image is damaged, or its format is not supported{detail}"


def _is_truncated(head: bytes, tail: bytes, size: int) -> bool:
    """Returns whether the end of an image is missing.

    Args:
        head: First bytes of the file.
        tail: Last bytes of the file.
        size: Size of the file [bytes].
    """
    for start, end in _ENDS.items():
        if head.startswith(start):
            return end not in tail
    pgm = _RAW_PGM.match(head)
    if pgm is None:
        return False
    width, height, largest = (int(number) for number in pgm.groups())
    return size < pgm.end() + width * height * (1 if largest < 256 else 2)
