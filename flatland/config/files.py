"""Reading of regular files."""

from __future__ import annotations

import errno
import os
import re
import stat
from pathlib import Path
from typing import BinaryIO, Final, Literal

MAX_BYTES: Final = 64 * 1024 * 1024
# File systems whose files are functions of the kernel: reading one can block, or change something.
_VIRTUAL_FILE_SYSTEMS: Final = frozenset(
    ("proc", "sysfs", "debugfs", "tracefs", "configfs", "securityfs", "cgroup", "cgroup2", "bpf")
)
_MOUNTS: Final = Path("/proc/self/mountinfo")
IMAGE_SUFFIXES: Final = frozenset(
    (
        ".bmp",
        ".gif",
        ".jpeg",
        ".jpg",
        ".pbm",
        ".pgm",
        ".png",
        ".pnm",
        ".ppm",
        ".tif",
        ".tiff",
        ".webp",
    )
)
LFS_START: Final = b"version https://git-lfs"
LFS_HINT: Final = 'the file is a pointer of Git LFS; "git lfs pull" downloads its content'
# The names of the formats in Pillow, by the first bytes of a file.
_IMAGE_FORMATS: Final = (
    (re.compile(rb"\x89PNG"), "Png"),
    (re.compile(rb"P[1-6][\s#]"), "Ppm"),
    (re.compile(rb"\xff\xd8\xff"), "Jpeg"),
    (re.compile(rb"BM.*\0", re.S), "Bmp"),  # Without a null byte, it may be a text.
    (re.compile(rb"II[*+]\0|MM\0[*+]"), "Tiff"),
    (re.compile(rb"RIFF....WEBP", re.S), "WebP"),
    (re.compile(rb"\xff\x4f\xff\x51|\0\0\0\x0cjP  \r\n\x87\n"), "Jpeg2K"),
    (re.compile(rb"\x59\xa6\x6a\x95"), "Sun"),
    (re.compile(rb"GIF8[79]a"), "Gif"),
)
SIGNATURE_SIZE: Final = 32  # bytes that decide about the format
_NUMBER: Final = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_MAX_START: Final = 4096  # bytes in which a line segment is searched


def image_format(content: bytes) -> str | None:
    """Returns the name of the format of an image in Pillow, None if it is not an image.

    Args:
        content: The content of the file, or its first 32 bytes.
    """
    signature = content[:SIGNATURE_SIZE]
    return next((name for pattern, name in _IMAGE_FORMATS if pattern.match(signature)), None)


def foreign_kind(content: bytes) -> Literal["image", "data"] | None:
    """Returns the kind of a file that is not a YAML file, by its content.

    Args:
        content: The content, or its first 4096 bytes.

    Returns:
        `image`; `data` for a file of line segments; otherwise None.
    """
    if image_format(content) is not None:
        return "image"
    lines = (line.strip() for line in content[:_MAX_START].splitlines())
    words = next((line for line in lines if line and not line.startswith(b"#")), b"").split()
    return "data" if len(words) >= 4 and all(map(_NUMBER.fullmatch, words[:4])) else None


def open_regular(path: str) -> BinaryIO:
    """Opens a regular file for reading bytes.

    Other kinds of files are refused: reading a pipe can block, and a device may be endless. So are
    the files of `/proc` and `/sys`.

    Raises:
        OSError: The file does not exist, is not a regular file, or cannot be read.
    """
    try:
        status = Path(path).stat()
    except ValueError as error:  # a null character in the path
        raise FileNotFoundError(errno.ENOENT, str(error), path) from error
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file", path)
    if _is_virtual(status):
        raise OSError(errno.EINVAL, "it is a virtual file of the kernel", path)
    return Path(path).open("rb")


def _is_virtual(status: os.stat_result) -> bool:
    """Returns whether a file belongs to a file system of the kernel."""
    if status.st_blocks:  # of a disk
        return False
    device = f"{os.major(status.st_dev)}:{os.minor(status.st_dev)}"
    try:
        mounts = [line.split() for line in _MOUNTS.read_text().splitlines()]
    except OSError:  # not Linux
        return False
    # Any number of optional fields, and a hyphen, precede the type of the file system.
    types = {mount[mount.index("-") + 1] for mount in mounts if mount[2] == device}
    return bool(types & _VIRTUAL_FILE_SYSTEMS)


def read_regular(path: str) -> bytes:
    """Reads a regular file of at most 64 MiB.

    Raises:
        OSError: The file does not exist, is not a regular file, is too large, or cannot be read.
    """
    with open_regular(path) as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise OSError(errno.EFBIG, "it is larger than 64 MiB", path)
    return content
