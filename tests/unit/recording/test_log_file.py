"""The file format of recordings."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flatland import Twist
from flatland.recording.log_file import (
    FORMAT,
    LogWriter,
    RecordingError,
    decode_value,
    encode_value,
    read_recording,
)

HEADER = {
    "format": FORMAT,
    "world": "world.yaml",
    "seed": 1,
    "step_size_ns": 5_000_000,
    "simplify_map": 0,
    "plugin_errors": "raise",
    "on_invalid_body": "raise",
    "state": "0",
    "files": {},
    "params": {},
}
RECORDS = [
    HEADER,
    {"step": 1, "kind": "lost", "topic": "/a"},
    {"step": 2, "kind": "delete_model", "arguments": {"name": "ä\n"}},
]


def nested(depth: int) -> Any:
    """Tuples in tuples, which the reader cannot descend into."""
    value: Any = 1
    for _ in range(depth):
        value = {"tuple": [value]}
    return value


def write(file: Path, records: Iterable[dict[str, Any]]) -> None:
    writer = LogWriter(file)
    for record in records:
        writer.write(record)
    writer.close()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A complete recording."""
    file = tmp_path / "run.flog"
    write(file, RECORDS)
    return file


def test_the_records_are_read_in_order(path: Path) -> None:
    recording = read_recording(path)
    assert recording.records == RECORDS
    assert recording.header == HEADER
    assert not recording.is_cut


def test_records_are_in_the_file_before_it_is_closed(tmp_path: Path) -> None:
    writer = LogWriter(tmp_path / "run.flog")
    for count, record in enumerate(RECORDS, 1):
        writer.write(record)
        assert read_recording(tmp_path / "run.flog").records == RECORDS[:count]
    writer.close()
    writer.close()


def test_a_recording_can_be_cut_at_every_byte_of_its_last_record(path: Path) -> None:
    content = path.read_bytes()
    start = content[:-1].rindex(b"\n") + 1
    assert len(content) - start > 30
    for end in range(start, len(content)):
        path.write_bytes(content[:end])
        recording = read_recording(path)
        assert recording.records == RECORDS[:-1]
        assert recording.is_cut == (end > start)


def test_an_existing_file_is_replaced(path: Path) -> None:
    write(path, [HEADER])
    assert read_recording(path).records == [HEADER]


def test_a_changed_byte_is_an_error_with_the_line(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[content.index(b"\n") + 15] ^= 1
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=rf"is damaged \[{path}:2\]"):
        read_recording(path)


@pytest.mark.parametrize("content", [b"", b"\n", b"image: a.png\n", bytes(100), b"00000000 {}\n"])
def test_another_file_is_not_a_recording(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "other"
    file.write_bytes(content)
    with pytest.raises(RecordingError, match="is not a recording of flatland"):
        read_recording(file)


def test_a_recording_of_another_format_is_refused(path: Path) -> None:
    write(path, [{"format": "flatland recording 2"}])
    with pytest.raises(RecordingError, match="flatland recording 1"):
        read_recording(path)


@pytest.mark.parametrize(
    ("record", "change"),
    [(0, {key: None}) for key in HEADER if key != "format"]
    + [(1, {"step": "1"}), (1, {"kind": None}), (1, {"topic": 1}), (2, {"arguments": []})],
)
def test_a_record_without_its_entries_is_an_error_with_the_line(
    path: Path, record: int, change: dict[str, object]
) -> None:
    write(path, [*RECORDS[:record], {**RECORDS[record], **change}, *RECORDS[record + 1 :]])
    with pytest.raises(RecordingError, match=rf"has an invalid record \[{path}:{record + 1}\]"):
        read_recording(path)


@pytest.mark.parametrize("name", ["missing/run.flog", "."])
def test_a_path_that_cannot_be_opened_is_an_error(tmp_path: Path, name: str) -> None:
    with pytest.raises(RecordingError, match="cannot create"):
        LogWriter(tmp_path / name)
    with pytest.raises(RecordingError, match="cannot read"):
        read_recording(tmp_path / name)


# -- values --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        3,
        -(1 << 70),
        0.1,
        -0.0,
        5e-324,
        math.inf,
        math.nan,
        np.float32(0.1),
        np.arange(6, dtype=np.float32).reshape(2, 3),
        np.zeros(0),
        np.array([True, False]),
        "a ä \ud800",
        [1, (2.0, "b"), {"c": None}],
        {"tuple": [1], "type": "x", "array": 2},
        Twist(0.1, -0.2, 1e-300),
        (Twist(), [Twist(1.0)]),
    ],
)
def test_values_are_unchanged(value: Any) -> None:
    result = decode_value(json.loads(json.dumps(encode_value(value))))
    np.testing.assert_equal(result, value)
    assert (type(result), repr(result)) == (type(value), repr(value))


@pytest.mark.parametrize("value", [object(), {1: 2}, len, np.array([None]), [set()]])
def test_other_values_cannot_be_recorded(value: Any) -> None:
    with pytest.raises(TypeError, match="cannot be recorded"):
        encode_value(value)


@pytest.mark.parametrize("name", ["missing_module:A", "flatland:Missing", "os:system"])
def test_a_type_that_is_not_there_is_an_error(name: str) -> None:
    with pytest.raises(RecordingError, match=f'the type "{name}" of a command'):
        decode_value({"type": name, "fields": {}})


@pytest.mark.parametrize(
    "value",
    [
        {"array": {"tuple": [1]}, "scalar": True},
        {"array": {"dict": {}}, "scalar": True},
        {"dtype": "x", "shape": [1], "data": "AA=="},
        {"dtype": "O", "shape": [1], "data": "AAAAAAAAAAA="},
        {"dtype": "<f8", "shape": [1], "data": "AA=="},
        {"dtype": "<f8", "shape": [3], "data": "AAAAAAAAAAA="},
        {"dtype": "<f8", "shape": "x", "data": 1},
        {"tuple": 1},
        {"dict": [1]},
        {"type": 1, "fields": {}},
        {"type": "", "fields": {}},
        {"type": ".x:y", "fields": {}},
        {"type": "flatland:Twist", "fields": {"other": 1}},
        {"type": "flatland:Twist", "fields": 1},
        nested(900),
    ],
)
def test_a_value_that_was_not_recorded_is_an_error(value: Any) -> None:
    with pytest.raises(RecordingError, match=r"^Flatland recording: (a value|the type)"):
        decode_value(value)


@pytest.mark.parametrize("text", [b"", b"{", b"\x94", b"[" * 100_000, b"1" * 5000])
def test_a_line_with_the_right_checksum_that_is_not_json_is_damaged(
    path: Path, text: bytes
) -> None:
    with path.open("ab") as file:
        file.write(b"%08x %s\n" % (zlib.crc32(text), text))
    with pytest.raises(RecordingError, match=rf"is damaged \[{path}:4\]"):
        read_recording(path)
