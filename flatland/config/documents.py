"""Loading of YAML files into trees of nodes with line numbers.

Scalars stay text; their type is determined when a parameter is read. An alias is the same node as
its anchor. A merge key (`<<`) is an ordinary key, as in yaml-cpp, so that every entry of a map is
written in that map.
"""

from __future__ import annotations

import errno
import stat
from pathlib import Path
from typing import BinaryIO

from flatland.config.composer import Composer, end_position, malformed
from flatland.config.hints import similar_file
from flatland.config.inputs import cached_file, check_allowed, note_file
from flatland.config.node import Node, Source
from flatland.errors import Place, UnreadableFileError

_MAX_FILE_BYTES = 64 * 1024 * 1024


def load_documents(path: str) -> list[Node]:
    """Loads all documents of a file.

    Args:
        path: The file, encoded in UTF-8, or in UTF-16 with a byte order mark.

    Returns:
        The root of each document; an empty list for a file that contains only comments.

    Raises:
        YamlError: The file does not exist, cannot be read, or is not valid YAML.
    """
    source = Source.of_file(path)
    return parse_documents(_decode(_read(path), source), source)


def parse_documents(text: str, source: Source) -> list[Node]:
    """Parses all documents of a text.

    Characters that YAML does not allow, and the surrogates that represent undecodable bytes, are
    accepted in comments only. If a key occurs several times in a map, its first value is used.

    Raises:
        YamlError: The text is not valid YAML.
    """
    return Composer(text.removeprefix("\ufeff"), source).compose()


def open_regular(path: str) -> BinaryIO:
    """Opens a regular file for reading bytes.

    Other kinds of files are refused: reading a pipe can block, and a device may be endless.

    Raises:
        OSError: The file does not exist, is not a regular file, or cannot be read.
    """
    check_allowed(path)
    try:
        is_regular = stat.S_ISREG(Path(path).stat().st_mode)
    except ValueError as error:  # a null character in the path
        raise FileNotFoundError(errno.ENOENT, str(error), path) from error
    if not is_regular:
        raise OSError(errno.EINVAL, "it is not a regular file", path)
    note_file(path)
    return Path(path).open("rb")


def read_regular(path: str) -> bytes:
    """Reads a regular file of at most 64 MiB.

    Raises:
        OSError: The file does not exist, is not a regular file, is too large, or cannot be read.
    """
    with open_regular(path) as file:
        content = file.read(_MAX_FILE_BYTES + 1)
    if len(content) > _MAX_FILE_BYTES:
        raise OSError(errno.EFBIG, "it is larger than 64 MiB", path)
    return content


def _read(path: str) -> bytes:
    try:
        return cached_file(path, read_regular)
    except (FileNotFoundError, NotADirectoryError):
        raise UnreadableFileError(
            f'File does not exist, path="{path}"', place=Place(path), hint=similar_file(path)
        ) from None
    except OSError as error:
        raise UnreadableFileError(
            f'Failed to read file, path="{path}", {error.strerror}', place=Place(path)
        ) from error


def _decode(content: bytes, source: Source) -> str:
    if content[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-8", "surrogateescape")
    try:
        return content.decode("utf-16")
    except UnicodeDecodeError as error:
        line, column = end_position(content[: error.start].decode("utf-16", "replace"))
        why = f"byte 0x{content[error.start]:02x} is not valid UTF-16"
        raise malformed(source, line, column, why) from error
