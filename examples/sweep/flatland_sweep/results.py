"""The folder of a sweep, in which results survive the end of any process.

- `sweep.json`: the settings, and the worlds and controllers. Another sweep is refused.
- `parts/000001.parquet`, ...: rows that were completed together. Each file appears complete.
- `results.parquet`: all rows, written when the sweep is complete, which removes the parts.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from flatland_sweep.cells import Cell, Row, SweepError
from flatland_sweep.columns import COLUMNS, KEY

_FORMAT: Final = 1
_DEFINITION: Final = "sweep.json"
_RESULTS: Final = "results.parquet"
_LOCK: Final = ".lock"

_ARROW: Final = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
_SCHEMA: Final = pa.schema([(name, _ARROW[kind]) for name, kind in COLUMNS.items()])
# Integers stay integers if some are missing.
_PANDAS: Final = {pa.int64(): pd.Int64Dtype(), pa.string(): pd.StringDtype()}


def read_results(folder: str | os.PathLike[str]) -> pd.DataFrame:
    """Returns all rows of a sweep, complete or not, sorted by world, controller and seed.

    Raises:
        SweepError: The folder does not exist or a file is invalid.
    """
    path = Path(folder)
    if not (path / _DEFINITION).is_file():
        raise SweepError(f"{path} is not the folder of a sweep: it has no {_DEFINITION}")
    return _rows(path).to_pandas(types_mapper=_PANDAS.get)


def _rows(folder: Path) -> pa.Table:
    """Returns one row of each cell, sorted."""
    tables = [_read_table(file) for file in _files(folder)]
    table = pa.concat_tables([_SCHEMA.empty_table(), *tables])
    keys = table.select(list(KEY)).to_pandas()
    # The last row of a cell counts: it was run again because of an error.
    keys = keys.drop_duplicates(keep="last").sort_values(list(KEY))
    return table.take(pa.array(keys.index))


def _files(folder: Path) -> list[Path]:
    results = folder / _RESULTS
    parts = sorted((folder / "parts").glob("*.parquet"))
    return [results, *parts] if results.exists() else parts


def _read_table(path: Path) -> pa.Table:
    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise SweepError(f"{path} cannot be read: {error}") from error
    if table.schema.names != _SCHEMA.names:
        raise SweepError(
            f"{path} must have the columns {', '.join(_SCHEMA.names)}, got "
            f"{', '.join(table.schema.names)}"
        )
    return table.cast(_SCHEMA)


class Results:
    """The results of a sweep in a folder that one process writes.

    Attributes:
        folder: The folder.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any]) -> None:
        """Opens the folder of a sweep, or creates it.

        Args:
            folder: The folder; must not exist, be empty, or contain a sweep of the same settings.
            settings: What all cells have in common, as values of JSON.

        Raises:
            SweepError: The folder contains something else, or another process writes it.
        """
        self.folder = folder
        self._settings = json.loads(json.dumps(settings, default=str))
        self._pending: list[Row] = []
        definition = folder / _DEFINITION
        self._is_new = not definition.exists()
        try:
            if self._is_new:
                if folder.exists() and any(entry.name != _LOCK for entry in folder.iterdir()):
                    raise SweepError(f"{folder} contains other files; choose another --out")
                folder.mkdir(parents=True, exist_ok=True)
            self._lock = self._lock_folder()
        except OSError as error:
            raise SweepError(f"{folder} cannot be used as --out: {error.strerror}") from error
        try:
            known = {} if self._is_new else self._read_definition()
            self._check(known)
            (folder / "parts").mkdir(exist_ok=True)
            for leftover in folder.rglob("*.tmp"):
                leftover.unlink()
            self._names: dict[str, dict[str, str]] = known.get("names", {})
            self._part = max((int(path.stem) for path in folder.glob("parts/*.parquet")), default=0)
        except BaseException:
            self.close()
            raise

    def _lock_folder(self) -> int:
        lock = os.open(self.folder / _LOCK, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise SweepError(f"another process is writing to {self.folder}") from None
        return lock

    def _read_definition(self) -> dict[str, Any]:
        path = self.folder / _DEFINITION
        try:
            known = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise SweepError(f"{path} cannot be read: {error}") from error
        if not isinstance(known, dict) or known.get("format") != _FORMAT:
            raise SweepError(f"{path} is not the description of a sweep of format {_FORMAT}")
        if not all(isinstance(known.get(key), dict) for key in ("settings", "names")):
            raise SweepError(f"{path} must have the maps settings and names")
        return known

    def _check(self, known: Mapping[str, Any]) -> None:
        if not known:
            return
        for name, value in self._settings.items():
            other = known["settings"].get(name)
            if other != value:
                raise SweepError(
                    f"{self.folder} contains another sweep: {name} is {other!r} there and "
                    f"{value!r} here; choose another --out"
                )

    def define(self, kind: str, names: Mapping[str, str]) -> None:
        """Records what the names of worlds or controllers stand for.

        Args:
            kind: `worlds` or `controllers`.
            names: Absolute path or hash by name.

        Raises:
            SweepError: A name stood for something else in a previous run.
        """
        known = self._names.setdefault(kind, {})
        for name, value in names.items():
            if known.setdefault(name, value) != value:
                raise SweepError(
                    f"{self.folder} contains results of another {name!r} ({kind}): "
                    f"{known[name]} there and {value} here; choose another --out"
                )
        definition = {"format": _FORMAT, "settings": self._settings, "names": self._names}
        text = json.dumps(definition, indent=2) + "\n"
        _replace(self.folder / _DEFINITION, lambda path: path.write_text(text, encoding="utf-8"))

    def frame(self) -> pd.DataFrame:
        """Returns all rows in files."""
        return read_results(self.folder)

    def missing(self, cells: Iterable[Cell], retry_errors: bool = False) -> list[Cell]:
        """Returns the cells without a result.

        Args:
            cells: All cells.
            retry_errors: Whether an error counts as no result.
        """
        frame = self.frame()
        if retry_errors:
            frame = frame[frame["outcome"] != "error"]
        done = set(zip(*(frame[name] for name in KEY), strict=True))
        return [cell for cell in cells if (cell.world, cell.controller, cell.seed) not in done]

    @property
    def pending(self) -> int:
        """Number of rows that are not yet in a file."""
        return len(self._pending)

    def add(self, row: Row) -> None:
        """Adds a row, which `flush` writes."""
        self._pending.append(row)

    def flush(self) -> None:
        """Writes all pending rows to one file."""
        if not self._pending:
            return
        table = pa.Table.from_pylist(self._pending, _SCHEMA)
        path = self.folder / "parts" / f"{self._part + 1:06d}.parquet"
        _replace(path, lambda new: pq.write_table(table, new))
        self._part += 1
        self._pending.clear()

    def complete(self) -> pd.DataFrame:
        """Merges all parts into one file, and returns its rows."""
        self.flush()
        table = _rows(self.folder)
        _replace(self.folder / _RESULTS, lambda new: pq.write_table(table, new))
        for part in self.folder.glob("parts/*.parquet"):
            part.unlink()
        return self.frame()

    def close(self) -> None:
        """Lets other processes write to the folder; further calls have no effect.

        Removes the folder of a new sweep if it contains no rows, because it could not be started.
        """
        if self._lock < 0:
            return
        if self._is_new and not _files(self.folder):
            for name in (_DEFINITION, _LOCK):
                (self.folder / name).unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                (self.folder / "parts").rmdir()
                self.folder.rmdir()
        os.close(self._lock)
        self._lock = -1


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    """Writes a file such that it exists completely or not at all, also after a power failure."""
    new = path.with_name(f"{path.name}.tmp")
    write(new)
    _sync(new)
    new.replace(path)
    _sync(path.parent)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
