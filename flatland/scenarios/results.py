"""The results of a suite, and their files.

- `results.json`: everything, for reports, baselines and to continue an interrupted suite.
- `results.csv`, and with pyarrow `results.parquet`: one row per run.
- `unfinished.jsonl`: results of a suite that is not complete, one line each.
"""

from __future__ import annotations

import csv
import importlib.util
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from flatland.errors import FlatlandError
from flatland.extras import require
from flatland.scenarios.columns import COLUMNS, KEY, Row
from flatland.scenarios.episode import Result
from flatland.scenarios.outline import Line, Outline
from flatland.version import VERSION

FORMAT: Final = 1
_UNFINISHED: Final = "unfinished.jsonl"


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
    """Writes all files of complete or partial results, and returns their paths."""
    written = [folder / "results.json", folder / "results.csv"]
    content = {
        "format": FORMAT,
        "flatland": VERSION,
        "definition": results.definition,
        "missing": results.missing,
        "outlines": results.outlines,
        "runs": [_to_json(results, result) for result in results.results],
    }
    _replace(written[0], json.dumps(content, separators=(",", ":")) + "\n")
    _replace(written[1], _csv(results.rows))
    if importlib.util.find_spec("pyarrow") is not None:
        written.append(folder / "results.parquet")
        write_parquet(results.rows, written[-1])
    if not results.missing:
        (folder / _UNFINISHED).unlink(missing_ok=True)
    return written


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
    writer.writerows(rows)
    return "".join(lines)


def write_parquet(rows: Sequence[Row], path: Path) -> None:
    """Writes the table in the Parquet format.

    Raises:
        MissingPackageError: pyarrow is not installed.
    """
    pa = require("pyarrow", "results in the Parquet format need")
    parquet = require("pyarrow.parquet", "results in the Parquet format need")
    types = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    schema = pa.schema([(name, types[column.type]) for name, column in COLUMNS.items()])
    parquet.write_table(pa.Table.from_pylist(list(rows), schema), path)


def read_results(path: str | os.PathLike[str]) -> SuiteResults:
    """Reads `results.json`.

    Raises:
        ResultsError: The file cannot be read, or is none of this format.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "results.json"
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultsError(f"{file} cannot be read: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ResultsError(f"{file} must be results of `flatland test` in the format {FORMAT}")
    results = SuiteResults(content["definition"], outlines=content["outlines"])
    results.missing = content["missing"]
    for entry in content["runs"]:
        _add_json(results, entry)
    return results


def _add_json(results: SuiteResults, entry: dict[str, Any]) -> None:
    results.keys[key_of(entry["row"])] = entry.pop("outline")
    row = dict.fromkeys(COLUMNS) | entry.pop("row")
    results.results.append(Result(row, **entry))


def _replace(path: Path, text: str) -> None:
    """Writes a file such that it exists completely or not at all."""
    new = path.with_name(f"{path.name}.tmp")
    new.write_text(text, encoding="utf-8")
    new.replace(path)


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
            ResultsError: The folder contains results of something else that cannot be continued.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / _UNFINISHED
        self.results = SuiteResults(definition)
        if continues:
            self._read(definition)
        else:
            self._path.unlink(missing_ok=True)
        self._file = self._path.open("a", encoding="utf-8")
        if not self._file.tell():
            self._write({"format": FORMAT, "definition": definition})

    def _read(self, definition: str) -> None:
        if not self._path.is_file():
            return
        lines = self._path.read_text(encoding="utf-8").splitlines()
        entries = []
        for line in lines:
            try:
                entries.append(json.loads(line))
            except ValueError:  # the last line of a process that was killed
                break
        if entries[:1] != [{"format": FORMAT, "definition": definition}]:
            raise ResultsError(
                f"{self._path} has results of other scenarios, controllers or versions; choose "
                "another --out, or leave out --continue"
            )
        for entry in entries[1:]:
            outline = entry["outline"]
            result = Result(**entry)
            if outline is not None:
                result.outline = Outline(**outline)
            self.results.add(result)
        with self._path.open("w", encoding="utf-8") as file:
            file.writelines(json.dumps(entry) + "\n" for entry in entries)

    def add(self, result: Result) -> None:
        """Writes a result and adds it to the others."""
        self._write(asdict(result))
        self.results.add(result)

    def close(self) -> None:
        """Closes the file; `write_results` removes it when the suite is complete."""
        self._file.close()

    def _write(self, content: dict[str, Any]) -> None:
        self._file.write(json.dumps(content) + "\n")
        self._file.flush()
