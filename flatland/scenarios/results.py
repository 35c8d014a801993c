"""The results of a suite, and their files.

- `results.json`: everything, for reports, baselines and to continue an interrupted suite.
- `results.csv`, and with pyarrow `results.parquet`: one row per run.
- `unfinished.jsonl`: results of a suite that is not complete, one line each.
"""

from __future__ import annotations

import csv
import fcntl
import importlib.util
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from flatland.errors import FlatlandError
from flatland.extras import require
from flatland.foreign_texts import clean_text
from flatland.output_files import append, replaced, write_text
from flatland.scenarios.columns import COLUMNS, KEY, Row
from flatland.scenarios.episode import Result
from flatland.scenarios.outline import Line, Outline
from flatland.version import VERSION

T = TypeVar("T")

FORMAT: Final = 1
_UNFINISHED: Final = "unfinished.jsonl"
_LOCK: Final = ".lock"
_REQUIRED: Final = (*KEY, "passed", "outcome", "success")
_MAX_SHOWN: Final = 80  # characters of a wrong value
_FORMULAS: Final = ("=", "+", "-", "@", "\t", "\r")  # start of formulas in spreadsheets


class ResultsError(FlatlandError):
    """A file of results cannot be used."""

    prefix = "Flatland results: "


@dataclass(slots=True)
class SuiteResults:
    """The results of a suite.

    Attributes:
        definition: Hash of what was run; empty if unknown.
        results: Results in the order of the runs.
        outlines: Walls by the key of an `Outline`.
        keys: Key of the outline of each result, empty without one.
        missing: Number of runs without a result, because of an interruption.
    """

    definition: str
    results: list[Result] = field(default_factory=list)
    outlines: dict[str, list[Line]] = field(default_factory=dict)
    keys: dict[tuple[str, str, int], str] = field(default_factory=dict)
    missing: int = 0

    def add(self, result: Result) -> None:
        """Adds a result; walls that are known are kept once."""
        if result.outline is not None:
            self.outlines.setdefault(result.outline.key, result.outline.lines)
            self.keys[key_of(result.row)] = result.outline.key
            result.outline = None
        self.results.append(result)

    @property
    def rows(self) -> list[Row]:
        """The rows of the table."""
        return [result.row for result in self.results]

    def lines_of(self, result: Result) -> list[Line]:
        """Returns the walls of the world of a result."""
        return self.outlines.get(self.keys.get(key_of(result.row), ""), [])


def key_of(row: Row) -> tuple[str, str, int]:
    """Returns the values of the key of a row."""
    scenario, controller, seed = (row[name] for name in KEY)
    return (scenario, controller, seed)


# -- files ---------------------------------------------------------------------------------


def write_results(results: SuiteResults, folder: Path) -> list[Path]:
    """Writes all files of complete or partial results, and returns their paths.

    Raises:
        OSError: Files cannot be written; the text names all of them.
    """
    content = {
        "format": FORMAT,
        "flatland": VERSION,
        "definition": results.definition,
        "missing": results.missing,
        "outlines": results.outlines,
        "runs": [_to_json(results, result) for result in results.results],
    }
    writers: dict[Path, Callable[[Path], None]] = {
        folder / "results.json": lambda path: write_text(path, _compact_json(content)),
        folder / "results.csv": lambda path: write_text(path, _csv(results.rows)),
    }
    if importlib.util.find_spec("pyarrow") is not None:
        writers[folder / "results.parquet"] = lambda path: write_parquet(results.rows, path)
    errors = []
    for path, write in writers.items():
        try:
            write(path)
        except OSError as error:
            errors.append(str(error))
    if errors:
        raise OSError("; ".join(errors))
    if not results.missing:
        (folder / _UNFINISHED).unlink(missing_ok=True)
    return list(writers)


def _compact_json(content: object) -> str:
    return json.dumps(content, separators=(",", ":")) + "\n"


def _to_json(results: SuiteResults, result: Result) -> dict[str, Any]:
    content = asdict(result)
    content["outline"] = results.keys.get(key_of(result.row), "")
    return content


def _csv(rows: Iterable[Row]) -> str:
    class Lines(list[str]):
        write = list.append

    lines = Lines()
    writer = csv.DictWriter(lines, list(COLUMNS), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return "".join(lines)


def _cell(value: object) -> object:
    """Returns a value of the table such that no spreadsheet takes a text for a formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULAS) else value


def write_parquet(rows: Sequence[Row], path: Path) -> None:
    """Writes the table in the Parquet format.

    Raises:
        MissingPackageError: pyarrow is not installed.
    """
    pa = require("pyarrow", "results in the Parquet format need")
    parquet = require("pyarrow.parquet", "results in the Parquet format need")
    types = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    schema = pa.schema([(name, types[column.type]) for name, column in COLUMNS.items()])
    with replaced(path) as part:
        parquet.write_table(pa.Table.from_pylist(list(rows), schema), part)


def read_results(path: str | os.PathLike[str]) -> SuiteResults:
    """Reads `results.json`.

    Raises:
        ResultsError: The file cannot be read, or is not a file of results in this format.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "results.json"
    try:
        content = _parsed(file.read_bytes())
    except (OSError, ValueError) as error:
        raise ResultsError(f"{file} cannot be read: {error}") from error
    known = content.get("format") if isinstance(content, dict) else None
    if known != FORMAT:
        got = "" if known is None else f", got {_shown(known)}"
        raise ResultsError(f"{file} must be results of `flatland test` in the format {FORMAT}{got}")
    where = f"{file}: "
    results = SuiteResults(_entry(content, "definition", str, where))
    results.missing = _entry(content, "missing", int, where)
    for key, lines in _entry(content, "outlines", dict, where).items():
        results.outlines[key] = _lines(lines, f"{where}outlines.{key}")
    for index, entry in enumerate(_entry(content, "runs", list, where)):
        result = _to_result(entry, f"{where}runs[{index}]")
        results.keys[key_of(result.row)] = _entry(entry, "outline", str, f"{where}runs[{index}].")
        results.results.append(result)
    return results


def _parsed(text: bytes) -> Any:
    """Returns the value of a text of JSON.

    Raises:
        ValueError: It is not JSON, or a number is not finite.
    """

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is not a number")

    try:
        return json.loads(text, parse_constant=refuse)
    except RecursionError as error:
        raise ValueError("lists or maps are nested too deeply") from error


_KINDS: Final[dict[type, str]] = {
    str: "a text",
    int: "an integer",
    float: "a number",
    bool: "true or false",
    list: "a list",
    dict: "a map",
}


def _entry(content: Any, key: str, kind: type[T], where: str) -> T:
    """Returns an entry of a map.

    Args:
        content: The map.
        key: Its key.
        kind: Type of the value.
        where: File and path of the map, with a separator.

    Raises:
        ResultsError: It is missing or has another type.
    """
    if key not in content:
        raise ResultsError(f"{where}{key} is missing")
    return _checked(content[key], kind, f"{where}{key}")


def _checked(value: Any, kind: type[T], where: str) -> T:
    kinds = (int, float) if kind is float else kind
    if not isinstance(value, kinds) or (isinstance(value, bool) and kind is not bool):
        raise ResultsError(f"{where} must be {_KINDS[kind]}, got {_shown(value)}")
    return cast("T", value)  # An integer is a number.


def _shown(value: object) -> str:
    return clean_text(json.dumps(value))[:_MAX_SHOWN]


def _to_result(entry: Any, where: str) -> Result:
    """Returns a result without its walls.

    Raises:
        ResultsError: The entry is not that of a result.
    """
    fields = _checked(entry, dict, where)
    known = _entry(fields, "row", dict, f"{where}.")
    row: Row = dict.fromkeys(COLUMNS)
    for name, column in COLUMNS.items():
        if name in _REQUIRED or known.get(name) is not None:
            row[name] = _entry(known, name, column.type, f"{where}.row.")
    result = Result(row)
    for name, size in (("path", 3), ("goals", 2), ("events", 4), ("jumps", 5), ("models", 3)):
        points = _checked(fields.get(name, []), list, f"{where}.{name}")
        if not all(isinstance(point, list) and len(point) == size for point in points):
            raise ResultsError(f"{where}.{name} must be a list of lists of {size} values")
        setattr(result, name, [tuple(point) for point in points])
    for name in ("recording", "recording_error"):
        setattr(result, name, _checked(fields.get(name, ""), str, f"{where}.{name}"))
    return result


def _lines(lines: Any, where: str) -> list[Line]:
    for line in _checked(lines, list, where):
        if not all(isinstance(p, list) and len(p) == 2 for p in _checked(line, list, where)):
            raise ResultsError(f"{where} must be a list of lines, which are lists of points")
    return lines  # type: ignore[no-any-return]


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keeps other processes from writing results to a folder, until the end of this process.

    Args:
        folder: The folder; created if it does not exist.

    Raises:
        ResultsError: Another process writes results to it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    file = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ResultsError(
                f"another `flatland test` writes to {folder}; wait for its end, or choose another "
                "--out"
            ) from error
        except OSError:
            pass  # The file system has no locks.
        yield
    finally:
        os.close(file)


# -- results of an incomplete suite --------------------------------------------------------


class Journal:
    """Keeps each result as soon as it is there, so that a killed suite can be continued.

    Attributes:
        results: The results so far.
    """

    def __init__(self, folder: Path, definition: str, *, continues: bool) -> None:
        """Opens the file.

        Args:
            folder: Folder of the results; created if it does not exist.
            definition: Hash of what is run.
            continues: Whether to keep the results of an interrupted suite.

        Raises:
            ResultsError: The folder contains results of something else that cannot be continued, or
                that are damaged.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / _UNFINISHED
        self.results = SuiteResults(definition)
        if continues:
            self._read(definition)
        else:
            self._path.unlink(missing_ok=True)
        self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        if not os.fstat(self._file).st_size:
            self._write({"format": FORMAT, "definition": definition})

    def _read(self, definition: str) -> None:
        if not self._path.exists():
            return
        lines = self._path.read_bytes().split(b"\n")
        entries = []
        for number, line in enumerate(lines, 1):
            try:
                entries.append(_parsed(line))
            except ValueError as error:
                if number < len(lines):
                    raise ResultsError(f"{self._path}:{number} cannot be read: {error}") from error
                # Empty, or cut because the process was killed.
        if entries and entries[0] != {"format": FORMAT, "definition": definition}:
            raise ResultsError(
                f"{self._path} has results of other scenarios, controllers or versions; choose "
                "another --out, or leave out --continue"
            )
        known = set()
        for number, entry in enumerate(entries[1:], 2):
            where = f"{self._path}:{number}"
            result = _to_result(entry, where)
            if entry.get("outline") is not None:
                outline = _entry(entry, "outline", dict, f"{where}.")
                walls = _entry(outline, "lines", list, f"{where}.outline.")
                key = _entry(outline, "key", str, f"{where}.outline.")
                result.outline = Outline(key, _lines(walls, f"{where}.outline.lines"))
            if key_of(result.row) not in known:
                known.add(key_of(result.row))
                self.results.add(result)
        write_text(self._path, "".join(json.dumps(entry) + "\n" for entry in entries))

    def add(self, result: Result) -> None:
        """Writes a result and adds it to the others.

        Raises:
            ResultsError: The file cannot be written.
        """
        self._write(asdict(result))
        self.results.add(result)

    def close(self) -> None:
        """Closes the file; `write_results` removes it when the suite is complete."""
        os.close(self._file)

    def _write(self, content: dict[str, Any]) -> None:
        try:
            append(self._file, json.dumps(content).encode() + b"\n")
        except OSError as error:
            raise ResultsError(
                f"{self._path} cannot be written: {error.strerror}",
                hint="it contains the runs before; --continue makes the others",
            ) from error
