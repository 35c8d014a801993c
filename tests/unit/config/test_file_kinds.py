"""The kinds of files."""

from __future__ import annotations

from pathlib import Path

import pytest

import flatland
from flatland.config.file_kinds import kind_of_file
from flatland.config.reader import YamlReader


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"properties: {}", "world"),
        (b"models: []", "world"),
        (b"layers: []\nbodies: []", "world"),
        (b"bodies: []\nplugins: []", "model"),
        (b"joints: []", "model"),
        (b"image: map.png", "map"),
        (b"type: line_segments\ndata: a.dat\nscale: 1", "map"),
        (b"{type: Laser, origin: [0, 0, 0]}", None),
        (b"# walls\n\n0 0 1.5 -2e1\n1 2 3 4\n", "data"),
        (b"0 0 1", None),
        (b"\x89PNG\r\n\x1a\n", "image"),
        (b"\xff\xd8\xff\xe0", "image"),
        (b"P5 20 20 255\n", "image"),
        (b"P5: a", None),
        (b"BMW: 1", None),
        (b"", None),
        (b"[", None),
    ],
)
def test_a_kind_is_recognized_by_the_content(
    tmp_path: Path, content: bytes, kind: str | None
) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    assert kind_of_file(str(path)) == kind


def test_a_file_that_cannot_be_read_has_no_kind(tmp_path: Path) -> None:
    assert kind_of_file(str(tmp_path / "missing")) is None
    assert kind_of_file(str(tmp_path)) is None


def test_a_file_of_an_unknown_kind_is_accepted() -> None:
    YamlReader.from_string("plugins: []").require_kind("world")
    with pytest.raises(flatland.YamlError) as caught:
        YamlReader.from_string("bodies: []").require_kind("world")
    assert str(caught.value) == 'Flatland YAML: Entry "properties" does not exist [line 1]'
    assert caught.value.hint == "this is a model file; a world file is expected here"
