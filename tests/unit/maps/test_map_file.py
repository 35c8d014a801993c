"""Map files of both kinds, and their error messages."""

from __future__ import annotations

import logging
import math
import os
import re
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from flatland.errors import FlatlandError, MapFileError, YamlError
from flatland.maps.map_file import load_map
from flatland.physics.boundaries import boundary_edges

IMAGE_MAP = """\
image: map.png
resolution: 0.05
origin: [1.5, -2, 0.3]
occupied_thresh: 0.65
"""
LINE_MAP = """\
type: line_segments
data: lines.dat
scale: 0.1
origin: [0, 0, 0]
"""

Write = Callable[[str], str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Returns a function that writes a map file next to an image and a data file."""
    grey = np.full((30, 40), 254, np.uint8)
    grey[5:20, 10:12] = 0
    for column in range(12, 30):
        grey[column // 2, column] = 100  # a diagonal wall, which can be simplified
    cv2.imwrite(str(tmp_path / "map.png"), grey)
    (tmp_path / "lines.dat").write_text("# x1 y1 x2 y2\n\n0 0 10 0\n10 0 10.5 20.25\n")

    def write_map(text: str) -> str:
        path = tmp_path / "map.yaml"
        path.write_text(text)
        return str(path)

    return write_map


def position(path: str, line: int) -> str:
    return f" [{path}:{line}]"


def test_image_map(write: Write, tmp_path: Path) -> None:
    path = write(IMAGE_MAP)
    layer_map = load_map(path, "2d")
    assert layer_map.origin == (1.5, -2.0, 0.3)
    assert layer_map.path == path
    grey = cv2.imread(str(tmp_path / "map.png"), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(layer_map.edges, boundary_edges(grey / 255 >= 0.65, 0.05))
    assert layer_map.exact_edge_count == len(layer_map.edges) > 0


def test_edges_do_not_depend_on_the_origin(write: Write) -> None:
    turned = load_map(write(IMAGE_MAP), "2d")
    level = load_map(write(IMAGE_MAP.replace("[1.5, -2, 0.3]", "[0, 0, 0]")), "2d")
    np.testing.assert_array_equal(turned.edges, level.edges)
    assert level.origin == (0.0, 0.0, 0.0)


def test_map_server_keys_are_ignored(write: Write) -> None:
    text = IMAGE_MAP + "negate: 0\nfree_thresh: 0.196\nmode: trinary\nframe_id: map\n"
    np.testing.assert_array_equal(
        load_map(write(text), "2d").edges, load_map(write(IMAGE_MAP), "2d").edges
    )
    inverted = text.replace("negate: 0", "negate: 1")
    np.testing.assert_array_equal(
        load_map(write(inverted), "2d").edges, load_map(write(IMAGE_MAP), "2d").edges
    )


def test_image_paths_are_relative_to_the_map_file(write: Write, tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    folder.mkdir()
    path = folder / "other.yaml"
    path.write_text(IMAGE_MAP.replace("map.png", "../map.png"))
    assert len(load_map(str(path), "2d").edges) > 0
    path.write_text(IMAGE_MAP.replace("map.png", str(tmp_path / "map.png")))
    assert len(load_map(str(path), "2d").edges) > 0


def test_values_can_be_expressions(write: Write) -> None:
    text = IMAGE_MAP.replace("0.05", '$eval param("resolution", 0.1)')
    coarse = load_map(write(text), "2d").edges
    fine = load_map(write(text), "2d", params={"resolution": 0.05}).edges
    np.testing.assert_allclose(coarse, 2 * fine, rtol=1e-6)


@pytest.mark.parametrize("simplify", [1, 2])
def test_simplification_reduces_the_number_of_edges(
    write: Write, caplog: pytest.LogCaptureFixture, simplify: int
) -> None:
    caplog.set_level(logging.INFO, logger="flatland")
    path = write(IMAGE_MAP)
    exact = load_map(path, "2d")
    simple = load_map(path, "2d", simplify=simplify)
    assert simple.exact_edge_count == len(exact.edges) != len(simple.edges)
    message = f'Layer "2d": {len(simple.edges)} edges from {path}, simplified'
    assert caplog.messages == [
        f'Layer "2d": {len(exact.edges)} edges from {path}',
        f"{message} (exact: {len(exact.edges)})",
    ]


def test_line_segment_map(write: Write) -> None:
    layer_map = load_map(write(LINE_MAP.replace("[0, 0, 0]", "[-1.2, -5, 1.23]")), "lines")
    assert layer_map.origin == (-1.2, -5.0, 1.23)
    np.testing.assert_allclose(layer_map.edges, [[0, 0, 1, 0], [1, 0, 1.05, 2.025]], atol=1e-7)
    assert layer_map.edges.dtype == np.float32
    assert layer_map.exact_edge_count == 2


@pytest.mark.parametrize("simplify", [0, 1, 2])
def test_line_segments_are_never_simplified(write: Write, simplify: int) -> None:
    assert len(load_map(write(LINE_MAP), "lines", simplify=simplify).edges) == 2


def test_segments_of_length_zero_are_ignored(
    write: Write, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "lines.dat").write_text("1 1 1 1\n0 0 10 0\n1 2 1 2.000000000001\n")
    assert len(load_map(write(LINE_MAP), "lines").edges) == 1
    assert f"2 line segments of length 0 in {tmp_path / 'lines.dat'} ignored" in caplog.text


def test_an_empty_data_file_has_no_edges(write: Write, tmp_path: Path) -> None:
    (tmp_path / "lines.dat").write_text("")
    edges = load_map(write(LINE_MAP), "lines").edges
    assert edges.shape == (0, 4)
    assert edges.dtype == np.float32


def test_a_threshold_outside_the_range_of_pixels_is_logged(
    write: Write, caplog: pytest.LogCaptureFixture
) -> None:
    load_map(write(IMAGE_MAP.replace("0.65", "65")), "2d")
    assert (
        'Layer "2d": "occupied_thresh" is 65, outside the range of pixel values, 0 to 1'
        in caplog.text
    )


@pytest.mark.parametrize("simplify", [-1, 3])
def test_simplify_out_of_range_is_rejected(write: Write, simplify: int) -> None:
    with pytest.raises(ValueError, match=f"simplify must be 0, 1 or 2, got {simplify}"):
        load_map(write(IMAGE_MAP), "2d", simplify=simplify)


def assert_fails(path: str, error: type[FlatlandError], text: str) -> None:
    """Asserts that loading the map of layer "Walls" raises an error with exactly this text."""
    with pytest.raises(error) as caught:
        load_map(path, "Walls")
    assert str(caught.value) == error.prefix + text


def test_a_map_file_that_does_not_exist(tmp_path: Path) -> None:
    path = str(tmp_path / "nowhere.yaml")
    with pytest.raises(YamlError, match=re.escape(f'File does not exist, path="{path}"')):
        load_map(path, "Walls")


@pytest.mark.parametrize("key", ["image", "resolution", "origin", "occupied_thresh"])
def test_missing_key_of_an_image(write: Write, key: str) -> None:
    text = "".join(line for line in IMAGE_MAP.splitlines(True) if not line.startswith(key))
    path = write(text)
    assert_fails(
        path, YamlError, f'Entry "{key}" does not exist (in layer "walls"){position(path, 1)}'
    )


@pytest.mark.parametrize("key", ["data", "scale", "origin"])
def test_missing_key_of_line_segments(write: Write, key: str) -> None:
    text = "".join(line for line in LINE_MAP.splitlines(True) if not line.startswith(key))
    path = write(text)
    assert_fails(
        path, YamlError, f'Entry "{key}" does not exist (in layer "walls"){position(path, 1)}'
    )


@pytest.mark.parametrize("text", [IMAGE_MAP, LINE_MAP])
def test_unknown_keys_are_ignored_and_logged(
    write: Write, caplog: pytest.LogCaptureFixture, text: str
) -> None:
    caplog.set_level(logging.INFO)
    path = write(text + "zoom: 2\nbright: [1, {a: b}]\nnegate: 0\n")
    layer_map = load_map(path, "Walls")
    np.testing.assert_array_equal(layer_map.edges, load_map(write(text), "Walls").edges)
    # Keys of map_server are known in maps of images, but not in maps of line segments.
    unknown = ("bright", "negate", "zoom") if text == LINE_MAP else ("bright", "zoom")
    assert layer_map.unknown_keys == unknown
    message = f'Layer "Walls": unknown keys {{{", ".join(unknown)}}} of {path} ignored'
    assert caplog.text.count(message) == 1


def test_an_origin_of_a_wrong_size(write: Write) -> None:
    path = write(IMAGE_MAP.replace("[1.5, -2, 0.3]", "[1.5, -2]"))
    text = 'Entry "origin" must have size of exactly 3 (in layer "walls")'
    assert_fails(path, YamlError, text + position(path, 3))


@pytest.mark.parametrize(
    ("text", "old", "new", "key", "why", "line"),
    [
        (IMAGE_MAP, "0.05", "0", "resolution", "must be positive, got 0.0", 2),
        (IMAGE_MAP, "0.05", "-0.05", "resolution", "must be positive, got -0.05", 2),
        (IMAGE_MAP, "0.05", ".nan", "resolution", "must be finite, got nan", 2),
        (IMAGE_MAP, "0.05", ".inf", "resolution", "must be finite, got inf", 2),
        (IMAGE_MAP, "-2", ".nan", "origin", "must be finite, got [1.5, nan, 0.3]", 3),
        (IMAGE_MAP, "0.3", "-.inf", "origin", "must be finite, got [1.5, -2.0, -inf]", 3),
        (IMAGE_MAP, "0.65", ".nan", "occupied_thresh", "must be finite, got nan", 4),
        (LINE_MAP, "0.1", "0", "scale", "must not be 0", 3),
        (LINE_MAP, "0.1", ".inf", "scale", "must be finite, got inf", 3),
        (LINE_MAP, "0.1", "1e38", "scale", "a coordinate does not fit a 32-bit float", 3),
        (LINE_MAP, "[0, 0, 0]", "[0, .nan, 0]", "origin", "must be finite, got [0.0, nan, 0.0]", 4),
    ],
)
def test_numbers_out_of_range(
    write: Write, text: str, old: str, new: str, key: str, why: str, line: int
) -> None:
    path = write(text.replace(old, new))
    error = f'Invalid "{key}", {why} (in layer "walls")'
    assert_fails(path, YamlError, error + position(path, line))


def test_a_resolution_outside_the_32_bit_range(write: Write) -> None:
    path = write(IMAGE_MAP.replace("0.05", "1e38"))
    why = (
        "resolution must be positive and the size of the map in the range of a 32-bit float, "
        "got 1e+38"
    )
    text = f'Invalid "resolution", {why} (in layer "walls")'
    assert_fails(path, YamlError, text + position(path, 2))


def test_a_negative_scale_mirrors_the_segments(write: Write) -> None:
    edges = load_map(write(LINE_MAP.replace("0.1", "-0.1")), "lines").edges
    np.testing.assert_allclose(edges, [[0, 0, -1, 0], [-1, 0, -1.05, -2.025]], atol=1e-7)


@pytest.mark.parametrize("map_type", ["indoor", "outdoor", "Line_Segments", '""', "", "3"])
def test_a_map_of_another_type_is_an_image_map(write: Write, map_type: str) -> None:
    layer_map = load_map(write(f"{IMAGE_MAP}type: {map_type}\n"), "Walls")
    np.testing.assert_array_equal(layer_map.edges, load_map(write(IMAGE_MAP), "Walls").edges)
    assert layer_map.unknown_keys == ()


def test_the_type_must_be_a_string(write: Write) -> None:
    path = write(IMAGE_MAP + "type: [indoor]\n")
    text = 'Error converting entry "type" to string (in layer "walls")'
    assert_fails(path, YamlError, text + position(path, 5))


@pytest.mark.parametrize("image", ["random_path/map.png", "lines.dat", "."])
def test_unreadable_image(write: Write, tmp_path: Path, image: str) -> None:
    path = write(IMAGE_MAP.replace("map.png", image))
    full = tmp_path if image == "." else tmp_path / image
    text = f'Failed to load "{full}" in layer "Walls"'
    assert_fails(path, YamlError, text + position(path, 1))


@pytest.mark.parametrize("file", ["pipe", "/dev/zero", '"zero\\0byte"'])
@pytest.mark.parametrize(
    ("text", "name", "error", "message", "line"),
    [
        (IMAGE_MAP, "map.png", YamlError, r'Failed to load ".*" in layer "Walls"', 1),
        (LINE_MAP, "lines.dat", MapFileError, r'Failed to load ".*"', 2),
    ],
    ids=["image", "data"],
)
def test_files_that_are_not_regular_are_rejected(
    write: Write,
    tmp_path: Path,
    text: str,
    name: str,
    error: type[Exception],
    message: str,
    line: int,
    file: str,
) -> None:
    """Opening a pipe would block."""
    os.mkfifo(tmp_path / "pipe")
    path = write(text.replace(name, file))
    with pytest.raises(error, match=message) as caught:
        load_map(path, "Walls")
    assert str(caught.value).endswith(position(path, line))


def test_missing_data_file(write: Write, tmp_path: Path) -> None:
    path = write(LINE_MAP.replace("lines.dat", "random_path/lines.dat"))
    text = f'Failed to load "{tmp_path / "random_path/lines.dat"}"'
    assert_fails(path, MapFileError, text + position(path, 2))


def test_an_invalid_line_of_a_data_file(write: Write, tmp_path: Path) -> None:
    data = tmp_path / "lines.dat"
    data.write_text("1 2 3 4\n" * 5 + "1 2 3 ~\n")
    text = 'Failed to read line segment from line 6, in file "lines.dat"'
    assert_fails(write(LINE_MAP), MapFileError, text + position(str(data), 6))


def test_a_map_file_must_contain_a_map(write: Write) -> None:
    path = write("- image: map.png\n")
    assert_fails(path, YamlError, 'Entry must be a map (in layer "walls")' + position(path, 1))


def test_the_origin_rotates_and_moves_the_edges(write: Write) -> None:
    layer_map = load_map(write(IMAGE_MAP), "2d")
    x, _, theta = layer_map.origin
    left = layer_map.edges[:, 0].min(), layer_map.edges[:, 1].min()
    assert left == (np.float32(0.5), np.float32(0.5))
    world_x = x + math.cos(theta) * left[0] - math.sin(theta) * left[1]
    assert world_x == pytest.approx(1.5 + 0.5 * (math.cos(0.3) - math.sin(0.3)))
