"""Map images: formats, threshold and simplification."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from flatland.maps.map_image import image_edges, read_grey_image, threshold_in_place
from flatland.physics.boundaries import boundary_edges

Image = npt.NDArray[np.uint8]


def png(width: int, bit_depth: int, color_type: int, row: bytes, palette: bytes = b"") -> bytes:
    """Returns a PNG file of one row, in formats that OpenCV cannot write."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)

    header = struct.pack(">IIBBBBB", width, 1, bit_depth, color_type, 0, 0, 0)
    body = chunk(b"IHDR", header) + (chunk(b"PLTE", palette) if palette else b"")
    body += chunk(b"tRNS", b"\0") if palette else b""
    return (
        b"\x89PNG\r\n\x1a\n"
        + body
        + chunk(b"IDAT", zlib.compress(b"\0" + row))
        + chunk(b"IEND", b"")
    )


def tiff(width: int, row: bytes, extra_samples: int, order: str = "<") -> bytes:
    """Returns a TIFF file of one row of 8-bit RGBA, with the given type of the fourth sample."""
    entry_count, header_size = 10, 8
    bits_offset = header_size + 2 + 12 * entry_count + 4
    entries = [
        (256, 4, 1, width),
        (257, 4, 1, 1),
        (258, 3, 4, bits_offset),  # bits per sample, four values at an offset
        (259, 4, 1, 1),  # no compression
        (262, 4, 1, 2),  # RGB
        (273, 4, 1, bits_offset + 8),  # offset of the row
        (277, 4, 1, 4),
        (278, 4, 1, 1),
        (279, 4, 1, len(row)),
        (338, 3, 1, extra_samples),
    ]
    magic = b"II*\0" if order == "<" else b"MM\0*"
    blob = magic + struct.pack(order + "IH", header_size, entry_count)
    for tag, kind, count, value in entries:
        short_value = kind == 3 and count == 1
        blob += struct.pack(order + ("HHIH2x" if short_value else "HHII"), tag, kind, count, value)
    return blob + struct.pack(order + "I4H", 0, 8, 8, 8, 8) + row


@pytest.fixture
def grey() -> Image:
    return np.arange(256, dtype=np.uint8).reshape(16, 16)


@pytest.mark.parametrize("suffix", ["png", "pgm", "bmp", "tif", "tiff", "webp"])
def test_supported_formats(tmp_path: Path, grey: Image, suffix: str) -> None:
    path = str(tmp_path / f"map.{suffix}")
    cv2.imwrite(path, grey, [cv2.IMWRITE_WEBP_QUALITY, 101])
    image = read_grey_image(path)
    assert image.dtype == np.uint8
    np.testing.assert_allclose(image, grey, atol=1)  # WebP converts grey to colours


def test_jpeg_within_compression_loss(tmp_path: Path) -> None:
    path = str(tmp_path / "map.jpg")
    walls = np.full((40, 60), 255, np.uint8)
    walls[8:16, 16:40] = 0
    cv2.imwrite(path, walls, [cv2.IMWRITE_JPEG_QUALITY, 95])
    np.testing.assert_array_equal(read_grey_image(path) > 127, walls > 127)


@pytest.mark.parametrize("maximum", [255, 65535])
def test_pgm_with_a_comment(tmp_path: Path, maximum: int) -> None:
    path = tmp_path / "map.pgm"
    row = struct.pack(">2H", 0xA5FF, 0xA600) if maximum == 65535 else bytes([0xA5, 0xA6])
    path.write_bytes(b"P5\n# written by hand\n2 1\n%d\n" % maximum + row)
    assert read_grey_image(str(path)).tolist() == [[0xA5, 0xA6]]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (png(3, 8, 4, bytes([200, 0, 100, 128, 50, 255])), [200, 100, 50]),
        (png(2, 8, 6, bytes([200, 200, 200, 0, 90, 90, 90, 128])), [200, 90]),
        (png(2, 16, 4, struct.pack(">4H", 0xC8FF, 0, 0x64FF, 0x8000)), [200, 100]),
        (png(2, 16, 0, struct.pack(">2H", 0xA5FF, 0xA600)), [0xA5, 0xA6]),
        (png(3, 1, 0, b"\x40"), [0, 255, 0]),
        (png(2, 8, 3, bytes([1, 0]), palette=bytes([10] * 3 + [200] * 3)), [200, 10]),
        (png(2, 8, 2, bytes([255, 0, 0, 0, 0, 255])), [76, 29]),
        (tiff(2, bytes([200, 200, 200, 0, 90, 90, 90, 128]), extra_samples=2), [200, 90]),
        (tiff(2, bytes([200, 200, 200, 0, 90, 90, 90, 128]), 2, order=">"), [200, 90]),
        (tiff(2, bytes([200, 200, 200, 0, 90, 90, 90, 128]), extra_samples=1), [200, 90]),
    ],
    ids=[
        "grey+alpha",
        "RGBA",
        "16 bit grey+alpha",
        "16 bit grey",
        "1 bit",
        "palette",
        "RGB",
        "TIFF alpha",
        "TIFF alpha, big-endian",
        "TIFF associated alpha",
    ],
)
def test_alpha_is_ignored_and_colours_become_grey(
    tmp_path: Path, data: bytes, expected: list[int]
) -> None:
    path = tmp_path / "map"
    path.write_bytes(data)
    np.testing.assert_allclose(read_grey_image(str(path)), [expected], atol=1)


@pytest.mark.parametrize("name", ["nothing", "text", "empty", "cut", "huge", "tiff", "folder"])
def test_invalid_images(tmp_path: Path, grey: Image, name: str) -> None:
    whole = cv2.imencode(".png", np.random.default_rng(1).integers(0, 255, (64, 64), np.uint8))[1]
    path = tmp_path / name
    contents = {
        "text": b"no image\n",
        "empty": b"",
        "cut": whole.tobytes()[: len(whole) // 2],
        "huge": b"P5\n200000 200000\n255\n",
        "tiff": b"II*\0\xff\xff\xff\xff",
    }
    if name == "folder":
        path.mkdir()
    elif name in contents:
        path.write_bytes(contents[name])
    with pytest.raises(OSError, match=name):
        read_grey_image(str(path))


@pytest.mark.parametrize(
    "threshold", [0.0, 1e-9, 0.2, 0.4, 0.5, 0.65, 0.196, 102 / 255, 1.0, 1.01, -3.0]
)
def test_the_threshold_applies_to_the_value_divided_by_255(grey: Image, threshold: float) -> None:
    expected = [[int(value) / 255 >= threshold for value in row] for row in grey]
    mask = threshold_in_place(grey, threshold)
    np.testing.assert_array_equal(mask, expected)
    assert mask is grey  # no second large array


def drawn_walls() -> Image:
    """Returns free space (1) with a pillar, a bent wall and a wall with a rough surface."""
    mask = np.ones((120, 160), np.uint8)
    mask[:3] = mask[-3:] = 0
    mask[:, :3] = mask[:, -3:] = 0
    mask[20:30, 20:30] = 0
    for column in range(40, 150):
        row = 20 + abs(column - 95) // 4
        mask[row : row + 4, column] = 0
    mask[90:95, 40:140] = 0
    mask[89, 41:139:4] = 0
    return mask


def test_without_simplification_the_boundary_is_exact() -> None:
    mask = drawn_walls()
    edges, exact = image_edges(mask, 0.05, simplify=0)
    np.testing.assert_array_equal(edges, boundary_edges(mask, 0.05))
    assert exact == len(edges)


def distance_to_edges(points: npt.NDArray[np.floating], edges: npt.NDArray[np.floating]) -> float:
    """Returns the maximum distance of a point from its nearest edge."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    relative = points[:, None] - start[None]
    fraction = np.clip((relative * along).sum(-1) / (along**2).sum(-1), 0, 1)
    nearest = start + fraction[..., None] * along
    return float(np.hypot(*np.moveaxis(points[:, None] - nearest, -1, 0)).min(axis=1).max())


def blobs() -> Image:
    """Returns shapes with curved outlines."""
    noise = np.random.default_rng(5).random((120, 160), np.float32)
    smooth: Image = (cv2.GaussianBlur(noise, (0, 0), 5) > 0.5).astype(np.uint8)
    return smooth


@pytest.mark.parametrize("mask", [drawn_walls(), blobs()], ids=["walls", "blobs"])
def test_the_simplified_boundary_is_closed_and_within_a_pixel(mask: Image) -> None:
    exact_edges = boundary_edges(mask, 1.0)
    edges, exact = image_edges(mask, 1.0, simplify=1)
    assert edges.dtype == np.float32
    assert exact == len(exact_edges)
    assert len(edges) < exact / 2
    # The distance of the corners of the exact boundary from the simplified one is at most a pixel.
    assert distance_to_edges(exact_edges[:, :2].astype(float), edges.astype(float)) <= 1.0 + 1e-6
    # The loops are closed: each point is the start of one edge and the end of another.
    starts = sorted(map(tuple, edges[:, :2].tolist()))
    assert starts == sorted(map(tuple, edges[:, 2:].tolist()))


def test_loops_that_would_be_reduced_to_four_points_stay_exact() -> None:
    mask = np.ones((40, 40), np.uint8)
    mask[5, 5] = 0  # one pixel
    mask[10:20, 10:20] = 0  # a pillar
    mask[9, 14] = 0  # with a burr, whose removal would leave 4 points
    edges, exact = image_edges(mask, 1.0, simplify=1)
    assert exact == len(edges) == 4 + 8
    found = {tuple(sorted(((a, b), (c, d)))) for a, b, c, d in edges.tolist()}
    expected = boundary_edges(mask, 1.0).tolist()
    assert found == {tuple(sorted(((a, b), (c, d)))) for a, b, c, d in expected}


def test_opening_removes_narrow_free_space() -> None:
    mask = drawn_walls()
    mask[60:85, 50:53] = 0  # two walls with a narrow slit between them
    mask[60:85, 56:60] = 0
    edges_1, exact_1 = image_edges(mask, 1.0, simplify=1)
    edges_2, exact_2 = image_edges(mask, 1.0, simplify=2)
    assert exact_1 == exact_2 == len(boundary_edges(mask, 1.0))  # of the original map
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel)
    expected, _ = image_edges(opened, 1.0, simplify=1)
    np.testing.assert_array_equal(edges_2, expected)

    def in_slit(edges: npt.NDArray[np.float32]) -> bool:
        x1, y1, x2, y2 = edges.T
        return bool(((x1 == x2) & (x1 > 51) & (x1 < 58) & (abs(y1 - y2) > 20)).any())

    assert in_slit(edges_1)
    assert not in_slit(edges_2)


@pytest.mark.parametrize("simplify", [0, 1, 2])
def test_a_map_without_off_pixels_has_no_edges(simplify: int) -> None:
    edges, exact = image_edges(np.ones((20, 20), np.uint8), 0.05, simplify)
    assert edges.shape == (0, 4)
    assert edges.dtype == np.float32
    assert exact == 0


class TestPlainGrey:
    """8-bit grey PNG and PGM files are read without OpenCV."""

    @pytest.fixture
    def pixels(self) -> npt.NDArray[np.uint8]:
        return np.random.default_rng(1).integers(0, 256, (37, 53), np.uint8)

    @pytest.mark.parametrize("suffix", ["png", "pgm"])
    def test_opencv_is_not_imported(
        self, tmp_path: Path, pixels: npt.NDArray[np.uint8], suffix: str
    ) -> None:
        pytest.importorskip("PIL")
        path = tmp_path / f"map.{suffix}"
        cv2.imwrite(str(path), pixels)
        script = (
            "import sys; from flatland.maps.map_image import read_grey_image, threshold_in_place;"
            "image = read_grey_image(sys.argv[1]); print(int(image.sum()));"
            "print(int(threshold_in_place(image, 0.65).sum())); print('cv2' in sys.modules)"
        )
        result = subprocess.run(
            [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
        )
        on = (pixels / 255.0 >= 0.65).sum()
        assert result.stdout.split() == [str(pixels.sum()), str(on), "False"]

    def test_a_header_of_map_server(self, tmp_path: Path, pixels: npt.NDArray[np.uint8]) -> None:
        path = tmp_path / "map.pgm"
        header = b"P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n53 37\n255\n"
        path.write_bytes(header + pixels.tobytes())
        np.testing.assert_array_equal(read_grey_image(str(path)), pixels)

    def test_other_depths_are_read_by_opencv(self, tmp_path: Path) -> None:
        path = tmp_path / "map.pgm"
        path.write_bytes(b"P5\n2 1\n100\n" + bytes([50, 100]))
        expected = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(read_grey_image(str(path)), expected)

    @pytest.mark.parametrize("suffix", ["png", "pgm"])
    def test_a_truncated_file_is_an_error(
        self, tmp_path: Path, pixels: npt.NDArray[np.uint8], suffix: str
    ) -> None:
        path = tmp_path / f"map.{suffix}"
        cv2.imwrite(str(path), pixels)
        path.write_bytes(path.read_bytes()[:60])
        with pytest.raises(OSError, match="cannot read"):
            read_grey_image(str(path))

    def test_opencv_is_used_without_pillow(
        self, tmp_path: Path, pixels: npt.NDArray[np.uint8], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = tmp_path / "map.png"
        cv2.imwrite(str(path), pixels)
        monkeypatch.setitem(sys.modules, "PIL.Image", None)
        np.testing.assert_array_equal(read_grey_image(str(path)), pixels)
