"""The file format of recordings: lines of JSON with checksums, only ever appended to.

Each line is `CHECKSUM JSON`: the CRC-32 of the JSON text in eight hexadecimal digits, a space, and
an object. Every line is written by one call of the operating system and therefore survives the end
of the process for any reason. A line that was cut off by a full disk or a loss of power can only be
the last one.
"""

from __future__ import annotations

import base64
import dataclasses
import fcntl
import importlib
import json
import os
import stat
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from flatland.checks import checked_path
from flatland.errors import FlatlandError
from flatland.output_files import append

FORMAT: Final = "flatland recording 1"

Record = dict[str, Any]

_HEADER: Final[dict[str, type[Any]]] = {
    "world": str,
    "seed": int,
    "step_size_ns": int,
    "simplify_map": int,
    "plugin_errors": str,
    "on_invalid_body": str,
    "state": str,
    "files": dict,
    "params": dict,
}
# Entries of the kinds of records; all other kinds are requests with arguments.
_KINDS: Final[dict[str, dict[str, type[Any]]]] = {
    "command": {"topic": str, "number": int},
    "lost": {"topic": str},
    "state": {"state": str, "bodies": str},
    "end": {"state": str, "bodies": str},
    "result": {"files": dict, "params": dict},
}


class RecordingError(FlatlandError):
    """A recording cannot be written, or is invalid."""

    prefix = "Flatland recording: "


class RecordingWriteError(RecordingError):
    """A recording cannot be written.

    Attributes:
        reason: Why, without the path.
    """

    def __init__(self, what: str, path: str, cause: OSError) -> None:
        """Initializes the error.

        Args:
            what: What was attempted, such as `write`.
            path: The file.
            cause: The error of the operating system.
        """
        self.reason = cause.strerror or str(cause)
        super().__init__(f'cannot {what} "{path}": {self.reason}')


class LogWriter:
    """Appends records to a file."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Creates the file; an existing one is replaced.

        Args:
            path: The file.

        Raises:
            RecordingWriteError: The file cannot be created, or is being written by another process.
        """
        self.path = checked_path("path", path)
        try:
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        except OSError as error:
            raise RecordingWriteError("create", self.path, error) from error
        try:
            self._take()
        except OSError as error:
            self.close()
            raise RecordingWriteError("create", self.path, error) from error

    def _take(self) -> None:
        """Empties a regular file, unless another process is writing to it."""
        if not stat.S_ISREG(os.fstat(self._file).st_mode):
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise OSError(error.errno, "another process is writing to it") from error
        except OSError:
            pass  # The file system has no locks.
        os.ftruncate(self._file, 0)

    def write(self, record: Record) -> None:
        """Appends a record.

        Raises:
            RecordingWriteError: The file cannot be written; the incomplete line is removed.
        """
        text = json.dumps(record, separators=(",", ":")).encode()
        try:
            append(self._file, b"%08x %s\n" % (zlib.crc32(text), text))
        except OSError as error:
            raise RecordingWriteError("write", self.path, error) from error

    def close(self) -> None:
        """Closes the file; idempotent."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording that was read.

    Attributes:
        path: The file.
        records: All complete records, the header first.
        is_cut: Whether an incomplete record follows them.
    """

    path: str
    records: list[Record]
    is_cut: bool

    @property
    def header(self) -> Record:
        """The first record."""
        return self.records[0]

    @property
    def is_complete(self) -> bool:
        """Whether the recording contains the end of the run."""
        return not self.is_cut and self.records[-1].get("kind") == "end"


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Reads a recording.

    Raises:
        RecordingError: The file cannot be read, is not a recording, or a line other than the last
            one is damaged; the text names the line.
    """
    name = checked_path("path", path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise RecordingError(f'cannot read "{name}": {error.strerror}') from error
    records: list[Record] = []
    lines = content.split(b"\n")
    rest = lines.pop()  # empty, if the last line is complete
    for number, line in enumerate(lines, 1):
        record = _decode_line(line)
        if record is None:
            if number == 1:
                break
            raise RecordingError(f'"{name}" is damaged [{name}:{number}]')
        records.append(record)
    if not records or records[0].get("format") != FORMAT:
        raise RecordingError(f'"{name}" is not a recording of flatland ("{FORMAT}")')
    for number, record in enumerate(records, 1):
        if not _is_complete(record, is_header=number == 1):
            raise RecordingError(f'"{name}" has an invalid record [{name}:{number}]')
    return Recording(name, records, bool(rest))


def _is_complete(record: Record, is_header: bool) -> bool:
    """Returns whether a record has the entries of its kind, with values of the right types."""
    if is_header:
        required = _HEADER
    else:
        required = {"step": int, "kind": str}
        required |= _KINDS.get(str(record.get("kind")), {"arguments": dict})
    return all(isinstance(record.get(key), kind) for key, kind in required.items())


def _decode_line(line: bytes) -> Record | None:
    checksum, separator, text = line.partition(b" ")
    if not separator or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        record = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return record if isinstance(record, dict) else None


# -- values of commands --------------------------------------------------------------------


def encode_value(value: Any) -> Any:
    """Converts a value to JSON that `decode_value` converts back exactly.

    Args:
        value: None, a bool, int, float or string, an array of numbers, a dataclass at the top level
            of its module, or a tuple, list or dictionary with string keys of such values.

    Raises:
        TypeError: The value, or a value inside it, has another type.
    """
    match value:
        case None | bool() | int() | float() | str():
            return value
        case np.generic():
            return {"array": encode_value(np.asarray(value)), "scalar": True}
        case np.ndarray() if value.dtype.kind in "biuf":
            data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
            return {"dtype": value.dtype.str, "shape": list(value.shape), "data": data}
        case list():
            return [encode_value(item) for item in value]
        case tuple():
            return {"tuple": [encode_value(item) for item in value]}
        case dict() if all(isinstance(key, str) for key in value):
            return {"dict": {key: encode_value(item) for key, item in value.items()}}
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            kind = type(value)
            fields = {
                f.name: encode_value(getattr(value, f.name)) for f in dataclasses.fields(kind)
            }
            return {"type": f"{kind.__module__}:{kind.__qualname__}", "fields": fields}
    raise TypeError(f"a value of type {type(value).__name__} cannot be recorded")


def decode_value(value: Any) -> Any:
    """Returns the value that `encode_value` converted.

    Raises:
        RecordingError: The module or class of a dataclass does not exist, or the value was not made
            by `encode_value`.
    """
    try:
        return _decode(value)
    except RecordingError:
        raise
    except Exception as error:  # also raised by constructors of dataclasses
        raise RecordingError(f"a value cannot be read: {type(error).__name__}: {error}") from error


def _decode(value: Any) -> Any:
    match value:
        case list():
            return [_decode(item) for item in value]
        case {"array": array, "scalar": True}:
            return _decode(array)[()]
        case {"dtype": str(dtype), "shape": shape, "data": data}:
            return np.frombuffer(base64.b64decode(data), np.dtype(dtype)).reshape(shape)
        case {"tuple": items}:
            return tuple(_decode(item) for item in items)
        case {"dict": items}:
            return {key: _decode(item) for key, item in items.items()}
        case {"type": name, "fields": fields}:
            kind = _find_dataclass(name)
            return kind(**{key: _decode(item) for key, item in fields.items()})
        case _:
            return value


def _find_dataclass(name: str) -> type[Any]:
    module, _, qualified = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), qualified)
    except (ImportError, AttributeError) as error:
        raise RecordingError(
            f'the type "{name}" of a command cannot be imported: {error}'
        ) from error
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise RecordingError(f'the type "{name}" of a command is not a dataclass')
    return found
