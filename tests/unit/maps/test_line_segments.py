"""Reading of line segment files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flatland.errors import MapFileError
from flatland.maps.line_segments import read_line_segments


def read(tmp_path: Path, text: str | bytes) -> list[list[float]]:
    path = tmp_path / "lines.dat"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    segments = read_line_segments(str(path))
    assert segments.shape == (len(segments), 4)
    return segments.tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    "text",
    [
        "1 2 3 4\n5 -6 7.5 8e-1\n",
        "1 2 3 4\n5 -6 7.5 8e-1",
        "\n  1\t2   3 4  \r\n\r\n5 -6 7.5 .8\r\n",
        "# a comment\n1 2 3 4 9 9 and more # words\n  # another\n\n5 -6 7.5 0.8 1\n\n",
        "\ufeff1 2 3 4\n5 -6 7.5 0.8\n",
    ],
)
def test_accepted_formats(tmp_path: Path, text: str) -> None:
    assert read(tmp_path, text) == [[1, 2, 3, 4], [5, -6, 7.5, 0.8]]


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n"])
def test_a_file_without_segments(tmp_path: Path, text: str) -> None:
    assert read(tmp_path, text) == []


@pytest.mark.parametrize(
    "bad",
    ["1 2 3", "1", "1 2 3 x", "1,2,3,4", "1 2 nan 4", "inf 2 3 4", "1 2 # 3 4", "1 2 3 1e999"],
)
@pytest.mark.parametrize("before", [0, 1, 7])
def test_an_error_contains_the_line_number(tmp_path: Path, bad: str, before: int) -> None:
    text = "# head\n\n" + "1 2 3 4\n" * before + bad + "\n1 2 3 4\n1 2\n"
    line = 3 + before  # of the first of two invalid lines
    with pytest.raises(MapFileError) as caught:
        read(tmp_path, text)
    assert str(caught.value) == (
        f'Flatland File: Failed to read line segment from line {line}, in file "lines.dat"'
        f" [{tmp_path / 'lines.dat'}:{line}]"
    )


def test_a_binary_file_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(MapFileError, match="line segment from line 1,"):
        read(tmp_path, b"\x89PNG\xff\xfe\x00\x01\n")


@pytest.mark.parametrize("name", ["missing.dat", "."])
def test_unreadable_files(tmp_path: Path, name: str) -> None:
    with pytest.raises(OSError, match=r"No such file|not a regular file"):
        read_line_segments(str(tmp_path / name))


def test_numbers_are_read_exactly(tmp_path: Path) -> None:
    segments = np.random.default_rng(3).normal(0, 100, (1000, 4))
    text = "\n".join(" ".join(map(repr, row)) for row in segments.tolist())
    np.testing.assert_array_equal(read(tmp_path, text), segments)
