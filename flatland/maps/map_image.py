"""Reading of map images and extraction of the edges of a layer."""

from __future__ import annotations

import importlib
import mmap
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from flatland.config.documents import open_regular
from flatland.geometry import FloatArray
from flatland.physics.boundaries import boundary_edges, boundary_loops

GreyImage = npt.NDArray[np.uint8]

# A loop that simplification would reduce to fewer points than this stays exact: a small loop, such
# as a pillar or a table leg, would lose its corners or vanish.
_MIN_LOOP_POINTS = 5
_TOLERANCE_PIXELS = 1.0
_OPENING_KERNEL = (7, 7)
# Images with 8-bit grey pixels, as written by map_server, need no conversion. They are read with
# Pillow, whose import takes a tenth of the time and memory of that of OpenCV.
_GREY_PNG = re.compile(rb"\x89PNG\r\n\x1a\n\0\0\0\rIHDR(?P<width>.{4})(?P<height>.{4})\x08\0", re.S)
_GREY_PGM = re.compile(rb"P5\s(?:#[^\n]*\n|\s)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+255\s")
_HEADER_SIZE = 512
_MAX_PILLOW_PIXELS = 80_000_000  # Pillow warns about larger images


def read_grey_image(path: str) -> GreyImage:
    """Reads an image as 8-bit grey; an alpha channel is ignored, not blended.

    Args:
        path: Image in a format that OpenCV supports, such as PNG, PGM, JPEG, BMP or TIFF.

    Returns:
        Pixels from the top row to the bottom row, shape (rows, columns).

    Raises:
        OSError: The file does not exist or is not an image.
    """
    # OpenCV prints a warning for a file that it cannot open.
    with open_regular(path) as file:
        header = file.read(_HEADER_SIZE)
    if _is_plain_grey(header):
        plain = _read_plain_grey(path)
        if plain is not None:
            return plain
    cv2 = _opencv()
    is_tiff = header[:4] in (b"II*\0", b"MM\0*")
    try:
        image = _decode_tiff(path) if is_tiff else cv2.imread(path, cv2.IMREAD_GRAYSCALE)
    except cv2.error as error:
        raise OSError(f"OpenCV cannot read {path}: {error}") from error
    if image is None:
        raise OSError(f"OpenCV cannot read {path} as an image")
    grey: GreyImage = image
    return grey


def _opencv() -> Any:
    """Imports OpenCV on first use: the import is slow, and most maps do not need it."""
    return importlib.import_module("cv2")


def _is_plain_grey(header: bytes) -> bool:
    """Returns whether a file header is that of an image whose bytes are the grey values."""
    png = _GREY_PNG.match(header)
    if png:
        width, height = (int.from_bytes(png[key], "big") for key in ("width", "height"))
    else:
        pgm = _GREY_PGM.match(header)
        if not pgm:
            return False
        width, height = int(pgm[1]), int(pgm[2])
    return 0 < width * height <= _MAX_PILLOW_PIXELS


def _read_plain_grey(path: str) -> GreyImage | None:
    """Reads 8-bit grey with Pillow; None if Pillow is not installed or rejects the file."""
    try:
        with importlib.import_module("PIL.Image").open(path) as image:
            return np.array(image) if image.mode == "L" else None
    except (ImportError, OSError, SyntaxError, ValueError):
        return None  # OpenCV reads the file, or reports the error.


def _decode_tiff(path: str) -> npt.NDArray[np.uint8] | None:
    """Decodes a TIFF file and ignores its alpha channel.

    libtiff multiplies the colours by an unassociated alpha channel, so that a transparent white
    pixel becomes black. Therefore the channel is marked as unspecified before decoding.
    """
    cv2 = _opencv()
    with (
        Path(path).open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY) as data,
    ):
        _mark_tiff_alpha_unspecified(data)
        buffer = np.frombuffer(data, np.uint8)
        try:
            image: npt.NDArray[np.uint8] | None = cv2.imdecode(buffer, cv2.IMREAD_GRAYSCALE)
        finally:
            del buffer  # A memory map cannot be closed while a buffer refers to it.
    return image


def _mark_tiff_alpha_unspecified(data: mmap.mmap) -> None:
    """Changes the tag ExtraSamples of the first page from unassociated alpha to unspecified."""
    extra_samples_tag, short_type, unassociated, unspecified = 338, 3, 2, 0
    order = "<" if data[:2] == b"II" else ">"
    entry = struct.Struct(order + "HHIH2x")
    try:
        (directory,) = struct.unpack_from(order + "I", data, 4)
        (count,) = struct.unpack_from(order + "H", data, directory)
        for offset in range(directory + 2, directory + 2 + count * entry.size, entry.size):
            if entry.unpack_from(data, offset) == (extra_samples_tag, short_type, 1, unassociated):
                entry.pack_into(data, offset, extra_samples_tag, short_type, 1, unspecified)
    except struct.error:
        return  # The file is damaged, and the decoder reports the error.


def threshold_in_place(image: GreyImage, occupied_thresh: float) -> GreyImage:
    """Sets each pixel to on (1) where value / 255 >= `occupied_thresh`, otherwise to off (0).

    Args:
        image: Grey pixels; overwritten to save the memory of a second large array.
        occupied_thresh: Threshold, 0 to 1.

    Returns:
        The same array.
    """
    # The smallest grey value that is on, 256 if no value is.
    lowest = int(np.searchsorted(np.arange(256) / 255.0, occupied_thresh))
    np.greater_equal(image, lowest, out=image.view(np.bool_))
    return image


def image_edges(mask: GreyImage, resolution: float, simplify: int) -> tuple[FloatArray, int]:
    """Returns the edges of a layer.

    Args:
        mask: On (1) and off (0) pixels from the top row to the bottom row, shape (rows, columns).
        resolution: Size of a pixel [m].
        simplify: 0 exact boundary; 1 simplified boundary loops; 2 simplified boundary loops after a
            morphological opening of the on pixels.

    Returns:
        Edges (x1, y1, x2, y2) relative to the lower left corner of the image [m], shape (n, 4), and
        the number of edges without simplification.

    Raises:
        ValueError: The size of the map in metres does not fit a 32-bit float.
    """
    exact = boundary_edges(mask, resolution)
    if simplify == 0:
        return exact, len(exact)
    if simplify == 2:
        cv2 = _opencv()
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, _OPENING_KERNEL)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel)
    return _simplified_edges(mask, resolution), len(exact)


def _simplified_edges(mask: GreyImage, resolution: float) -> FloatArray:
    loops = [_simplified_loop(loop) for loop in boundary_loops(mask)]
    if not loops:
        return np.empty((0, 4), np.float32)
    points = np.concatenate(loops)
    ends = np.cumsum([len(loop) for loop in loops])
    successor = np.arange(1, len(points) + 1)
    successor[ends - 1] = np.concatenate(([0], ends[:-1]))
    return (np.hstack((points, points[successor])) * resolution).astype(np.float32)


def _simplified_loop(loop: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    if len(loop) < _MIN_LOOP_POINTS:
        return loop
    cv2 = _opencv()
    kept: npt.NDArray[np.int32] = cv2.approxPolyDP(loop, _TOLERANCE_PIXELS, closed=True)[:, 0]
    return loop if len(kept) < _MIN_LOOP_POINTS else kept
