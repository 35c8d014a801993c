"""Map files of both kinds, and their error messages."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from flatland.config.inputs import Inputs, Params
from flatland.errors import YamlError
from flatland.maps import map_file
from flatland.maps.map_file import LayerMap
from flatland.physics import boundary_edges

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


def load_map(path: str, layer_name: str, *, params: Params = None, simplify: int = 0) -> LayerMap:
    return map_file.load_map(path, layer_name, inputs=Inputs(params), simplify=simplify)


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


def test_map_server_keys_are_ignored(write: Write) -> None:
    expected = load_map(write(IMAGE_MAP), "2d").edges
    text = IMAGE_MAP + "negate: 1\nfree_thresh: 0.196\nmode: trinary\nframe_id: map\n"
    layer_map = load_map(write(text), "2d")
    np.testing.assert_array_equal(layer_map.edges, expected)
    assert layer_map.unknown_keys == ()


def test_the_reason_of_an_unreadable_image_is_the_hint(write: Write, tmp_path: Path) -> None:
    path = write(IMAGE_MAP)
    image = tmp_path / "map.png"
    image.write_text("version https://git-lfs.github.com/spec/v1\n")
    with pytest.raises(YamlError) as caught:
        load_map(path, "2d")
    assert "pointer of Git LFS" in caught.value.hint


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


@pytest.mark.parametrize("simplify", [0, 2])
@pytest.mark.parametrize("scale", [0.1, -0.1])
def test_line_segment_map(write: Write, scale: float, simplify: int) -> None:
    """A negative scale mirrors the segments; they are never simplified."""
    text = LINE_MAP.replace("[0, 0, 0]", "[-1.2, -5, 1.23]").replace("0.1", str(scale))
    layer_map = load_map(write(text), "lines", simplify=simplify)
    assert layer_map.origin == (-1.2, -5.0, 1.23)
    expected = scale * np.array([[0, 0, 10, 0], [10, 0, 10.5, 20.25]])
    np.testing.assert_allclose(layer_map.edges, expected, atol=1e-7)
    assert layer_map.edges.dtype == np.float32
    assert layer_map.exact_edge_count == 2


def test_segments_of_length_zero_are_ignored(
    write: Write, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "lines.dat").write_text("1 1 1 1\n0 0 10 0\n1 2 1 2.000000000001\n")
    assert len(load_map(write(LINE_MAP), "lines").edges) == 1
    assert f"2 line segments of length 0 in {tmp_path / 'lines.dat'} ignored" in caplog.text


def test_an_empty_data_file_has_no_edges(write: Write, tmp_path: Path) -> None:
    (tmp_path / "lines.dat").write_text("")
    assert load_map(write(LINE_MAP), "lines").edges.shape == (0, 4)


def test_a_threshold_outside_the_range_of_pixels_is_logged(
    write: Write, caplog: pytest.LogCaptureFixture
) -> None:
    load_map(write(IMAGE_MAP.replace("0.65", "65")), "2d")
    assert (
        'Layer "2d": "occupied_thresh" is 65, outside the range of pixel values, 0 to 1'
        in caplog.text
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


@pytest.mark.parametrize("map_type", ["indoor", "outdoor", "Line_Segments", '""', "", "3"])
def test_a_map_of_another_type_is_an_image_map(write: Write, map_type: str) -> None:
    layer_map = load_map(write(f"{IMAGE_MAP}type: {map_type}\n"), "Walls")
    np.testing.assert_array_equal(layer_map.edges, load_map(write(IMAGE_MAP), "Walls").edges)
    assert layer_map.unknown_keys == ()
