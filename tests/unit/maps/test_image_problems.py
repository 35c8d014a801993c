"""Warnings about map images whose walls or free space are missing."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from flatland.config.collecting_reader import ErrorCollector
from flatland.config.inputs import Inputs
from flatland.maps.map_file import load_map

Pixels = npt.NDArray[Any]

ROOM: Final = np.zeros((20, 30), np.uint8)
ROOM[2:18, 2:28] = 255
FREE: Final = ROOM == 255


def with_alpha(grey: Pixels | int, alpha: Pixels) -> Pixels:
    """Returns grey values with alpha."""
    return np.stack([np.broadcast_to(np.uint8(grey), alpha.shape), alpha.astype(np.uint8)], axis=-1)


def pgm(magic: str, maximum: int, pixels: Pixels) -> bytes:
    header = f"{magic}\n{pixels.shape[1]} {pixels.shape[0]}\n{maximum}\n"
    if magic == "P2":
        return (header + " ".join(map(str, pixels.ravel())) + "\n").encode()
    return header.encode() + pixels.astype(np.uint8 if maximum < 256 else ">u2").tobytes()


def warnings(
    folder: Path, caplog: pytest.LogCaptureFixture, image: Pixels | bytes, threshold: float = 0.65
) -> list[str]:
    """Loads a map and returns the warnings without the layer and the path of the image."""
    path = folder / "room.png"
    if isinstance(image, bytes):
        path.write_bytes(image)
    else:
        Image.fromarray(image).save(path)
    text = f"image: room.png\nresolution: 0.1\norigin: [0, 0, 0]\noccupied_thresh: {threshold}\n"
    (folder / "map.yaml").write_text(text)
    caplog.clear()
    load_map(str(folder / "map.yaml"), "walls", inputs=Inputs())
    found = []
    for record in caplog.records:
        if record.levelno >= logging.WARNING:
            assert record.getMessage().startswith('Layer "walls"')
            assert str(path) in record.getMessage()
            assert record.place.line == (4 if "occupied_thresh" in record.getMessage()[:32] else 1)
            found.append(record.getMessage().split(": ", 1)[1])
    return found


PROBLEMS: dict[str, tuple[Pixels | bytes, float, str]] = {
    "ink on a transparent background": (
        with_alpha(0, 255 * ~FREE),
        0.65,
        "none of the 600 pixels is free, so that the layer is a solid block; 416 of 600 pixels are "
        "transparent, but alpha is ignored, as in the reference simulator: by the colors that are "
        "stored for them, 0 are free and 416 occupied; save the image without an alpha channel",
    ),
    "walls that are transparent": (
        with_alpha(255, 255 * FREE),
        0.65,
        "all 600 pixels are free, so that the layer has no walls; 184 of 600 pixels are ",
    ),
    "one part that is transparent": (
        with_alpha(ROOM, 255 - 200 * (np.arange(30) < 9)[np.newaxis] * FREE),
        0.65,
        "112 of 600 pixels are transparent, but alpha is ignored, as in the reference simulator: "
        "by the colors that are stored for them, 112 are free and 0 occupied",
    ),
    "16 bits with values up to 254": (
        FREE.astype(np.uint16) * 254,
        0.65,
        "none of the 600 pixels is free, so that the layer is a solid block; its values have 16 "
        'bits, and are at most 254 of 65535, where "occupied_thresh" is 42597.8; save it with 8',
    ),
    "12 bits in 16": (FREE.astype(np.uint16) * 4095, 0.3, "none of the 600 pixels is free"),
    "occupancy in percent": (
        FREE.astype(np.uint8) * 100,
        0.65,
        "none of the 600 pixels is free, so that the layer is a solid block; its values are from 0 "
        'to 100 of 255, where "occupied_thresh" is 165.75; scale them to the range 0 to 255',
    ),
    "a low part of the range": (
        ROOM // 8,
        0.1,
        "its values are from 0 to 31 of 255, only a low part of their range, and 416 of 600 pixels "
        "are free; scale the values to the whole range",
    ),
    "a low part of 16 bits": (
        FREE.astype(np.uint16) * 4095,
        0.05,
        "its values are at most 4095 of 65535, only a low part of their range, and 416 of 600",
    ),
    "only an outline": (
        np.where(np.arange(30) < 29, ROOM, 0) // 2,
        0.65,
        "none of the 600 pixels is free, so that the layer is a solid block; its values are from 0",
    ),
    "black": (0 * ROOM, 0.65, "none of the 600 pixels is free, so that the layer is a solid block"),
    "white": (
        np.full_like(ROOM, 255),
        0.65,
        "all 600 pixels are free, so that the layer has no walls; its values are 255 of 255, where "
        '"occupied_thresh" is 165.75; draw walls dark and free space bright',
    ),
    "grey walls": (
        np.where(FREE, np.uint8(255), np.uint8(180)),
        0.65,
        "all 600 pixels are free, so that the layer has no walls; its values are from 180 to 255 "
        'of 255, where "occupied_thresh" is 165.75; draw walls darker, or raise "occupied_thresh"',
    ),
    "a low value of a PGM": (
        pgm("P5", 1000, FREE * 3),
        0.65,
        "none of the 600 pixels is free, so that the layer is a solid block; its values have 16 "
        'bits, and are at most 3 of 1000, where "occupied_thresh" is 650; save it with 8 bits',
    ),
    "threshold 0": (
        ROOM,
        0,
        '"occupied_thresh" is 0: all 600 pixels are free, and there are no walls; a value such as '
        "0.65 is required",
    ),
    "threshold 1": (
        ROOM,
        1,
        '"occupied_thresh" is 1: only pixels of the value 255 are free, 416 of 600; a value such',
    ),
    "threshold in percent": (
        ROOM,
        65,
        '"occupied_thresh" is 65, outside the range of pixel values, 0 to 1: none of the 600 '
        "pixels is free; a value such as 0.65 is required",
    ),
    "threshold as a grey value": (ROOM, 165.75, '"occupied_thresh" is 165.75, outside the range'),
    "negative threshold": (
        ROOM,
        -0.5,
        '"occupied_thresh" is -0.5, outside the range of pixel values, 0 to 1: all 600 pixels',
    ),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_suspicious_image(tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str) -> None:
    image, threshold, text = PROBLEMS[name]
    (found,) = warnings(tmp_path, caplog, image, threshold)
    assert found.startswith(text)


GOOD: dict[str, Pixels | bytes] = {
    "8 bits": ROOM,
    "16 bits": FREE.astype(np.uint16) * 65535,
    "the colors of map_server": np.choose(ROOM // 255 + (np.arange(30) > 20), (0, 205, 254)).astype(
        np.uint8
    ),
    "opaque": with_alpha(ROOM, np.full_like(ROOM, 255)),
    # The walls are the same on any background.
    "almost opaque": with_alpha(ROOM, np.full_like(ROOM, 250)),
    **{
        f"{magic} {maximum}": pgm(magic, maximum, FREE * maximum)
        for magic in ("P2", "P5")
        for maximum in (1, 15, 100, 1000)
    },
}


@pytest.mark.parametrize("name", GOOD)
def test_a_usual_image_has_no_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    assert warnings(tmp_path, caplog, GOOD[name]) == []


def test_the_included_maps_have_no_warnings(
    checkout: Path, caplog: pytest.LogCaptureFixture
) -> None:
    maps = [path for path in checkout.glob("worlds/*/*.yaml") if "image:" in path.read_text()]
    assert maps
    for path in maps:
        load_map(str(path), "walls", inputs=Inputs())
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []


def test_no_warning_about_a_value_in_place_of_a_missing_one(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """`flatland check` continues without the threshold."""
    Image.fromarray(ROOM).save(tmp_path / "room.png")
    path = tmp_path / "map.yaml"
    path.write_text("image: room.png\nresolution: 0.1\norigin: [0, 0, 0]\n")
    collector = ErrorCollector()
    load_map(str(path), "walls", inputs=Inputs(), read=collector.read)
    assert len(collector.errors) == 1
    assert [one for one in caplog.records if one.levelno >= logging.WARNING] == []


def test_a_data_file_without_segments(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "lines.dat").write_text("# x1 y1 x2 y2\n")
    path = tmp_path / "map.yaml"
    path.write_text("type: line_segments\ndata: lines.dat\nscale: 1\norigin: [0, 0, 0]\n")
    load_map(str(path), "walls", inputs=Inputs())
    (record,) = (one for one in caplog.records if one.levelno >= logging.WARNING)
    assert record.getMessage().startswith('Layer "walls": no line segments in ')
