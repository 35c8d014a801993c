"""Files that are written completely or not at all, and errors that name them."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flatland.errors import FlatlandError


def check_outputs(*paths: str | os.PathLike[str] | None) -> None:
    """Checks before long work that files can be created in their folders.

    Args:
        *paths: The files; None for those that are not wanted.

    Raises:
        FlatlandError: A folder does not exist, or the path is that of a folder.
    """
    for path in paths:
        if path is None:
            continue
        folder = Path(os.path.realpath(path)).parent
        if not folder.is_dir():
            shown = Path(path).parent
            raise FlatlandError(f"cannot write {os.fspath(path)}: there is no folder {shown}")
        if Path(path).is_dir():
            raise FlatlandError(f"cannot write {os.fspath(path)}: it is a folder")


@contextmanager
def named_errors(path: str | os.PathLike[str], part: Path | None = None) -> Iterator[None]:
    """Adds a path to errors of the operating system without one, such as those of a full disk.

    Args:
        path: The path as the user knows it.
        part: A temporary path that stands for it.
    """
    name, temporary = os.fspath(path), os.fspath(part or path)
    try:
        yield
    except OSError as error:
        if error.errno is None:  # not from the operating system
            text = str(error).replace(temporary, name)
            raise OSError(text if name in text else f"{name}: {text}") from error
        if error.filename is not None and os.fspath(error.filename) != temporary:
            raise
        raise OSError(error.errno, error.strerror or str(error), name) from error


@contextmanager
def replaced(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a temporary path with the same suffix; its file becomes `path` at the end.

    On an error, the temporary file is removed, and an existing file is kept. A device or pipe is
    written directly. If several processes write one file, it is that of the last one to finish.

    Args:
        path: The file; the file that a symbolic link refers to.

    Raises:
        OSError: The file cannot be written; the text names `path`.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        with named_errors(path):
            yield target
        return
    # Another process may be writing the same file.
    part = target.with_name(f"{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        with named_errors(path, part):
            yield part
            os.replace(part, target)  # noqa: PTH105
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Writes a file, see `replaced`."""
    with replaced(path) as part:
        part.write_bytes(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a text in UTF-8, see `replaced`; what cannot be encoded is escaped."""
    write_bytes(path, text.encode(errors="backslashreplace"))


def append(file: int, data: bytes) -> None:
    """Appends data to a file that was opened with `O_APPEND`.

    Args:
        file: The file descriptor.
        data: The data.

    Raises:
        OSError: It cannot be written; what was written of it is removed.
    """
    size = os.fstat(file).st_size
    try:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(file, rest) :]
    except OSError:
        with suppress(OSError):  # raised if this is not a regular file
            os.ftruncate(file, size)
        raise
