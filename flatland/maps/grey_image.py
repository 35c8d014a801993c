"""Reading of images as 8-bit grey, by Pillow.

The grey values are those that OpenCV 4 reads with `IMREAD_GRAYSCALE`, whose formulas for colours
depend on the format of the file. Unlike in OpenCV, values of PGM and PPM files are fractions of the
maximum value in the header, as in `map_server`.
"""

from __future__ import annotations

import contextlib
import importlib
import mmap
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, BinaryIO, Final

import numpy as np
import numpy.typing as npt

from flatland.config.files import SIGNATURE_SIZE, image_format, open_regular

GreyImage = npt.NDArray[np.uint8]
Pixels = npt.NDArray[Any]

MAX_SIDE: Final = 2**20  # pixels
MAX_PIXELS = 2**30
_STRIP_PIXELS: Final = 2**20
# Weights of red, green and blue; the sums are powers of two.
_OF_GREY: Final = (4899, 9617, 1868)  # in decoders of OpenCV that return grey
_OF_COLORS: Final = (9798, 19235, 3735)  # in its conversion of colours
_OF_PNG: Final = (9797, 19234, 3737)
# The bits of red, green and blue in a file of 16 bits per pixel; OpenCV sets the others to 0.
_FEW_BITS: Final = {"BGR;15": (0xF8, 0xF8, 0xF8), "BGR;16": (0xF8, 0xFC, 0xF8)}
_SRGB_GAMMA: Final = 0.45455
_ORIENTATION_TAG: Final = 0x0112
_BITS_TAG: Final = 258
_PHOTOMETRIC_TAG: Final = 262
_ALPHA_MODES: Final = ("LA", "PA", "RGBA")
_MAXIMUM: Final = "maximum"  # key of the information about an image of Pillow

_pillow_limit = threading.Lock()


@dataclass(frozen=True, eq=False)
class ImageContent:
    """The pixels of an image, from the top row to the bottom row.

    Attributes:
        grey: Grey values, shape (rows, columns). The alpha channel is ignored.
        alpha: Opacities, shape (rows, columns); None if all pixels are opaque.
        peak: Largest value of the file, of `scale`; None for a file of 8 bits per value or less.
        scale: Value of the file that is white.
    """

    grey: GreyImage
    alpha: GreyImage | None
    peak: int | None
    scale: int


def read_grey_image(path: str) -> GreyImage:
    """Reads an image as 8-bit grey; see `read_image`."""
    return read_image(path).grey


def read_image(path: str) -> ImageContent:
    """Reads an image as 8-bit grey; an alpha channel is ignored, not blended.

    Args:
        path: Image in one of the formats PNG, PGM, PPM, PBM, JPEG, BMP, TIFF, WebP, JPEG 2000, GIF
            and Sun raster. Of several images in a file, the first one is read.

    Raises:
        OSError: The file does not exist or is not an image.
    """
    with open_regular(path) as file:
        try:
            return _read(file)
        except Exception as error:  # Damaged files result in errors of many classes.
            reason = str(error) or type(error).__name__
            raise OSError(f"cannot read {path} as an image: {reason}") from error


def _read(file: BinaryIO) -> ImageContent:
    # `PIL.Image.open` would import the modules of all formats for some of them, and warn about
    # images of more than 90 million pixels.
    kind = image_format(file.read(SIGNATURE_SIZE))
    if kind is None:
        raise ValueError("its format is unknown")
    if kind != "Tiff":
        return _decode(file, kind)
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY) as data:
        _mark_tiff_alpha_unassociated(data)
        return _decode(data, kind)


def _decode(file: BinaryIO | mmap.mmap, kind: str) -> ImageContent:
    image = _open(file, kind)
    width, height = image.size
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise ValueError(f"{width} x {height} pixels are more than supported")
    stored = _raw_mode(image.tile[0]) if image.tile else image.mode
    images = [image]
    maximum = _maximum(image)
    if _has_wide_colors(stored) and (kind in ("Png", "Tiff") or maximum is not None):
        images.append(_open(file, kind, low_bytes=True))
    orientation = _orientation(image) if kind == "Jpeg" else 1  # Pillow turns TIFF images.
    for each in images:
        _load(each)
    matrix = _matrix(image, kind, stored)
    formula: Callable[..., Pixels] = lambda pixels: pixels  # noqa: E731
    if matrix is None:
        formula = _formula(image, kind, stored)
    if maximum is not None:
        formula = _scaled(formula, image.mode, maximum)
    width, height = image.size
    grey = np.empty((height, width), np.uint8)
    has_alpha = image.mode in _ALPHA_MODES or "transparency" in image.info
    alpha: GreyImage | None = None
    is_wide = image.mode.startswith("I") or len(images) > 1
    peak = 0
    # Strips save the memory of intermediate results.
    rows = max(1, _STRIP_PIXELS // width)
    for top in range(0, height, rows):
        box = (0, top, width, min(top + rows, height))
        strips = [each.crop(box) for each in images]
        if has_alpha:
            opacity = _opacity(strips[0])
            if alpha is None and opacity.getextrema()[0] < 255:
                alpha = np.full_like(grey, 255)
            if alpha is not None:
                alpha[top : box[3]] = opacity
        if matrix is not None:
            colors = strips[0] if image.mode == "RGB" else strips[0].convert("RGB")
            strips = [colors.convert("L", matrix)]
        pixels = [np.asarray(strip) for strip in strips]
        if is_wide:
            values = pixels[0] if len(pixels) == 1 else _wide(*pixels)[..., :3]
            peak = max(peak, int(values.max()))
        grey[top : box[3]] = formula(*pixels)
    scale = maximum or (65535 if is_wide else 255)
    return ImageContent(_turned(grey, orientation), alpha, peak if is_wide else None, scale)


def _opacity(image: Any) -> Any:
    """Returns the alpha channel of an image with alpha, or with transparent colours."""
    if image.mode not in ("LA", "RGBA"):
        image = image.convert("RGBA")
    return image.getchannel("A")


def _open(file: BinaryIO | mmap.mmap, kind: str, *, low_bytes: bool = False) -> Any:
    """Returns an image of which only the header has been read.

    Args:
        file: The file.
        kind: Name of the format in Pillow.
        low_bytes: Whether the image gets the low bytes of 16-bit colours instead of the high ones,
            of which the colours of Pillow consist.
    """
    file.seek(0)
    image = getattr(importlib.import_module(f"PIL.{kind}ImagePlugin"), f"{kind}ImageFile")(file)
    image.draft("L", None)  # JPEG: the luminance of the file
    if kind == "Ppm":
        image.info[_MAXIMUM] = _stored_maximum(image)
        image.tile = [_unscaled(tile, image.mode) for tile in image.tile]
    if kind == "Tiff":
        bits = image.tag_v2.get(_BITS_TAG, (1,))
        if image.mode in ("I", "F", "LAB") or (
            max(bits) > 8 and len(_raw_mode(image.tile[0])) == 1
        ):
            raise ValueError(f"TIFF with pixels of {bits} bits in mode {image.mode}")
    if low_bytes:
        image.tile = [_of_low_bytes(tile) for tile in image.tile]
    return image


def _raw_mode(tile: Any) -> str:
    """Returns how pixels are stored in a part of an image, in the notation of Pillow."""
    arguments = tile[3]
    return str(arguments if isinstance(arguments, str) else arguments[0])


def _stored_maximum(image: Any) -> int | None:
    """Returns the largest value of a PNM file by its header, None if values need no scaling.

    Pillow reduces 16-bit colours in plain text to 8 bits itself.
    """
    decoder, arguments = image.tile[0][0], image.tile[0][3]
    if decoder not in ("ppm", "ppm_plain") or image.mode == "1":
        return None
    maximum = int(arguments[1])
    is_scaled = decoder == "ppm_plain" and image.mode == "RGB" and maximum > 255
    return None if is_scaled or maximum in (255, 65535) else maximum


def _maximum(image: Any) -> int | None:
    maximum: int | None = image.info.get(_MAXIMUM)
    return maximum


def _unscaled(tile: Any, mode: str) -> Any:
    """Returns a part of a PNM file whose values are not scaled to the range of the mode."""
    if tile[0] == "ppm_plain" and mode != "1":
        stored, maximum = tile[3]
        if mode == "I" or maximum < 256:
            return _changed(tile, tile[0], (stored, 65535 if mode == "I" else 255))
    if tile[0] != "ppm":
        return tile
    stored = {"I": "I;16B"}.get(mode, mode if tile[3][1] < 256 else f"{mode};16B")
    return _changed(tile, "raw", (stored, 0, 1))


def _of_low_bytes(tile: Any) -> Any:
    stored = _raw_mode(tile)
    # The letter is the order of the bytes: big-endian, little-endian, or that of the machine.
    other = stored[:-1] + ("L" if stored.endswith("B") else "B")
    return _changed(tile, tile[0], other if tile[3] == stored else (other, *tile[3][1:]))


def _changed(tile: Any, decoder: str, arguments: Any) -> Any:
    parts = (decoder, tile[1], tile[2], arguments)
    return type(tile)(*parts) if hasattr(tile, "_fields") else parts  # recent versions of Pillow


def _load(image: Any) -> None:
    """Decodes the pixels. Pillow has a lower limit for the size of TIFF images."""
    pillow: Any = importlib.import_module("PIL.Image")
    with _pillow_limit:
        limit = pillow.MAX_IMAGE_PIXELS
        pillow.MAX_IMAGE_PIXELS = None
        try:
            image.load()
        finally:
            pillow.MAX_IMAGE_PIXELS = limit


def _orientation(image: Any) -> int:
    """Returns the orientation in the EXIF data of an image, 1 if there is none."""
    with contextlib.suppress(Exception):  # Data that are damaged are ignored.
        return int(image.getexif().get(_ORIENTATION_TAG, 1))
    return 1


def _turned(image: GreyImage, orientation: int) -> GreyImage:
    """Returns an image the way up that its EXIF orientation describes."""
    if orientation in (2, 3, 6, 7):
        image = image[:, ::-1] if orientation < 5 else image[::-1]
    if orientation in (3, 4, 7, 8):
        image = image[::-1] if orientation < 5 else image[:, ::-1]
    return np.ascontiguousarray(image.T if 5 <= orientation <= 8 else image)


def _mark_tiff_alpha_unassociated(data: mmap.mmap) -> None:
    """Changes the kind of the alpha channel of the first page, so that Pillow keeps the colours.

    It divides colours by associated alpha, and refuses grey with alpha that is not unassociated.
    """
    extra_samples_tag, short_type, unassociated = 338, 3, 2
    order = "<" if data[:2] == b"II" else ">"
    entry = struct.Struct(order + "HHIH2x")
    with contextlib.suppress(
        struct.error
    ):  # A damaged file, of which the decoder reports the error.
        (directory,) = struct.unpack_from(order + "I", data, 4)
        (count,) = struct.unpack_from(order + "H", data, directory)
        for offset in range(directory + 2, directory + 2 + count * entry.size, entry.size):
            if entry.unpack_from(data, offset)[:3] == (extra_samples_tag, short_type, 1):
                entry.pack_into(data, offset, extra_samples_tag, short_type, 1, unassociated)


# -- grey values ---------------------------------------------------------------------------


def _formula(image: Any, kind: str, stored: str) -> Callable[..., Pixels]:
    """Returns the function from pixels to grey values.

    Args:
        image: The image.
        kind: Name of the format in Pillow.
        stored: How the pixels are stored in the file, in the notation of Pillow.

    Returns:
        A function of pixels, and of their low bytes if they are 16-bit colours.
    """
    mode: str = image.mode
    if mode in ("P", "PA"):
        palette = np.zeros((256, 3), np.uint8)
        colors = np.array(image.getpalette("RGB"), np.uint8).reshape(-1, 3)
        palette[: len(colors)] = colors
        table = _color_formula(image, kind)(palette).astype(np.uint8)
        return lambda pixels: table[pixels if mode == "P" else pixels[..., 0]]
    if mode == "1":
        return lambda pixels: pixels * np.uint8(255)
    if mode == "L":
        return lambda pixels: pixels
    if mode == "LA":
        return lambda pixels: pixels[..., 0]
    if mode.startswith("I"):
        is_white = kind == "Tiff" and image.tag_v2.get(_PHOTOMETRIC_TAG) == 0
        return lambda pixels: (pixels >> 8) ^ (255 if is_white else 0)
    if mode == "CMYK":
        return lambda pixels: _grey(_from_cmyk(pixels.astype(np.int32), kind), _OF_GREY)
    if stored in _FEW_BITS:
        used = np.array(_FEW_BITS[stored], np.uint8)
        return lambda pixels: _grey(pixels & used, _OF_GREY)
    if mode in ("RGB", "RGBA", "RGBX"):
        return _color_formula(image, kind)
    raise ValueError(f"colours of mode {mode} are not supported")


def _matrix(image: Any, kind: str, stored: str) -> tuple[float, float, float, float] | None:
    """Returns the matrix by which Pillow itself converts colours, None if it cannot.

    It computes in single precision, in which the sums are exact, and rounds half up.
    """
    if image.mode not in ("RGB", "RGBA", "RGBX") or not _has_plain_colors(image, kind, stored):
        return None
    weights = _OF_PNG if kind == "Png" else _weights(kind)
    red, green, blue = (weight / sum(weights) for weight in weights)
    return red, green, blue, -0.5 if kind == "Png" else 0.0


def _has_plain_colors(image: Any, kind: str, stored: str) -> bool:
    """Returns whether colours have 8 bits, and no gamma is applied."""
    if kind == "Png" and _gamma(image) is not None:
        return False
    if _maximum(image) is not None:
        return False
    return stored not in _FEW_BITS and not (kind in ("Png", "Tiff") and ";16" in stored)


def _has_wide_colors(stored: str) -> bool:
    """Returns whether colours have 16 bits, by how they are stored."""
    return stored.startswith("RGB") and ";16" in stored


def _scaled(formula: Callable[..., Pixels], mode: str, maximum: int) -> Callable[..., Pixels]:
    """Returns a function of values from 0 to a maximum, which are scaled to 255.

    Unlike the reference, whose OpenCV scales values in plain text but not binary ones. `map_server`
    scales both, rounded down; it refuses maxima above 255, which that of ROS 2 scales as well.

    Args:
        formula: Function of values from 0 to 255.
        mode: Mode of the image.
        maximum: Largest value by the header.
    """

    def grey(pixels: Pixels, low: Pixels | None = None) -> Pixels:
        values = pixels.astype(np.int64) if low is None else _wide(pixels, low).astype(np.int64)
        scaled = np.minimum(values * 255 // maximum, 255)
        return scaled if mode == "I" else formula(scaled.astype(np.uint8))

    return grey


def _weights(kind: str) -> tuple[int, int, int]:
    return _OF_COLORS if kind in ("WebP", "Jpeg2K", "Gif") else _OF_GREY


def _gamma(image: Any) -> float | None:
    """Returns the gamma of a PNG file, None if there is none that libpng applies."""
    gamma: float = _SRGB_GAMMA if "srgb" in image.info else image.info.get("gamma", 1.0)
    return gamma if abs(gamma - 1.0) > 0.05 else None


def _color_formula(image: Any, kind: str) -> Callable[..., Pixels]:
    """Returns the function from red, green and blue to grey values."""
    if kind == "Png":
        gamma = _gamma(image)
        return lambda pixels, low=None: _png_grey(pixels, low, gamma)
    weights = _weights(kind)
    # libtiff rounds values of 16 bits to 8 bits.
    return lambda pixels, low=None: _grey(
        pixels if low is None else (_wide(pixels, low) + 128) // 257, weights
    )


def _png_grey(pixels: Pixels, low: Pixels | None, gamma: float | None) -> Pixels:
    """Returns grey values by the formula of libpng: in linear light if the file has a gamma."""
    colors, greatest = (pixels, 255) if low is None else (_wide(pixels, low), 65535)
    if gamma is not None:
        linear = np.floor(greatest * (colors / greatest) ** (1.0 / gamma) + 0.5)
        mixed = _grey(linear, _OF_PNG) / greatest
        grey = np.floor(greatest * mixed**gamma + 0.5).astype(np.int64)
        is_grey = (colors[..., :3] == colors[..., :1]).all(axis=-1)
        grey = np.where(is_grey, colors[..., 0], grey)
    else:
        grey = _grey(colors, _OF_PNG, 0.0 if low is None else 0.5)
    return grey if low is None else grey >> 8


def _from_cmyk(pixels: Pixels, kind: str) -> Pixels:
    inks, rest = pixels[..., :3], 255 - pixels[..., 3:]
    return rest * (255 - inks) // 255 if kind == "Tiff" else rest - (inks * rest >> 8)


def _wide(high: Pixels, low: Pixels) -> Pixels:
    """Returns 16-bit values, of which the bytes are given."""
    return high.astype(np.int32) << 8 | low


def _grey(colors: Pixels, weights: tuple[int, int, int], rounding: float = 0.5) -> Pixels:
    """Returns the weighted sum of red, green and blue."""
    # Sums of 8-bit values are exact in single precision.
    precision = np.float32 if colors.dtype == np.uint8 else np.float64
    total = colors[..., :3].astype(precision) @ np.array(weights, precision)
    grey: Pixels = np.floor(total / sum(weights) + rounding).astype(np.int64)
    return grey
