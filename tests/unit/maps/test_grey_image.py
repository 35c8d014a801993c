"""Reading of map images: formats, the grey values of OpenCV, and errors."""

from __future__ import annotations

import io
import struct
import sys
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image as Pillow
from programs import run_program

from flatland.maps import grey_image
from flatland.maps.grey_image import read_grey_image
from flatland.maps.unreadable_image import why_unreadable

Pixels = npt.NDArray[Any]

SIZE: Final = (53, 37)
RNG: Final = np.random.default_rng(1)
GREY: Final = RNG.integers(0, 256, SIZE[::-1], np.uint8)
COLORS: Final = RNG.integers(0, 256, (*SIZE[::-1], 4), np.uint8)
WIDE: Final = RNG.integers(0, 65536, (*SIZE[::-1], 4), np.uint16)


def png(pixels: Pixels, color_type: int, *chunks: tuple[bytes, bytes], bits: int = 8) -> bytes:
    """Returns a PNG file of any type.

    Args:
        pixels: Bytes or 16-bit values of the rows.
        color_type: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGB and alpha.
        *chunks: Kinds and contents of further chunks.
        bits: Bits per sample; samples of fewer than 8 bits are packed into bytes.
    """

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)

    height, width = len(pixels), pixels.shape[1] * 8 // min(bits, 8)
    rows = b"".join(b"\0" + row.astype(row.dtype.newbyteorder(">")).tobytes() for row in pixels)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, color_type, 0, 0, 0)),
            *(chunk(*each) for each in chunks),
            chunk(b"IDAT", zlib.compress(rows)),
            chunk(b"IEND", b""),
        )
    )


def tiff(pixels: Pixels, photometric: int, extra_samples: int | None, order: str) -> bytes:
    """Returns a TIFF file without compression, with any kind of alpha."""
    height, width = pixels.shape[:2]
    samples = pixels.shape[2] if pixels.ndim == 3 else 1
    bits = 8 * pixels.itemsize
    data = pixels.astype(pixels.dtype.newbyteorder(order)).tobytes()
    entries = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, samples, bits),
        (259, 3, 1, 1),  # no compression
        (262, 3, 1, photometric),
        (273, 4, 1, 0),  # offset of the pixels
        (277, 3, 1, samples),
        (278, 4, 1, height),
        (279, 4, 1, len(data)),
    ]
    if extra_samples is not None:
        entries.append((338, 3, 1, extra_samples))
    end = 8 + 2 + 12 * len(entries) + 4
    blob = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(order + "IH", 8, len(entries))
    for tag, kind, count, value in entries:
        blob += struct.pack(order + "HHI", tag, kind, count)
        if tag == 273:
            blob += struct.pack(order + "I", end + 8)
        elif tag == 258 and count > 2:
            blob += struct.pack(order + "I", end)
        elif kind == 3:
            blob += struct.pack(order + "2H", value, value if count == 2 else 0)
        else:
            blob += struct.pack(order + "I", value)
    return blob + struct.pack(order + "I4H", 0, *[bits] * 4) + data


def bmp(bits: int, compression: int, data: bytes, masks: bytes = b"") -> bytes:
    """Returns a BMP file without a palette."""
    start = 14 + 40 + len(masks)
    header = struct.pack("<IHHI", start + len(data), 0, 0, start)
    info = (40, *SIZE, 1, bits, compression, len(data), 0, 0, 0, 0)
    return b"BM" + header + struct.pack("<IiiHHIIiiII", *info) + masks + data


def pnm(magic: str, maximum: int, pixels: Pixels) -> bytes:
    """Returns a PNM file with a comment."""
    values = pixels.astype(np.uint8 if maximum < 256 else ">u2")
    return f"{magic}\n# by hand\n{SIZE[0]} {SIZE[1]}\n{maximum}\n".encode() + values.tobytes()


def saved(image: Pillow.Image, kind: str, **options: Any) -> bytes:
    """Returns a file written by Pillow."""
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


def oriented(orientation: int) -> Pillow.Exif:
    exif = Pillow.Exif()
    exif[0x0112] = orientation
    return exif


def files() -> dict[str, bytes]:
    """Returns image files of all formats and modes that OpenCV reads."""
    images = {mode: Pillow.fromarray(COLORS).convert(mode) for mode in ("1", "L", "LA", "RGB")}
    images["RGBA"] = Pillow.fromarray(COLORS)
    images["P"] = images["RGB"].quantize(64)
    images["CMYK"] = Pillow.fromarray(COLORS, "CMYK")
    smooth = images["RGB"].resize((8, 6)).resize((64, 40), Pillow.Resampling.BICUBIC)
    supported = {
        "PNG": ("1", "L", "LA", "P", "RGB", "RGBA"),
        "BMP": ("1", "L", "P", "RGB", "RGBA"),
        "PPM": ("1", "L", "RGB"),
        "JPEG": ("L", "CMYK", "RGB"),
        "TIFF": ("1", "L", "LA", "P", "RGB", "RGBA", "CMYK"),
        "WEBP": ("L", "RGB", "RGBA"),
        "JPEG2000": ("L", "LA", "RGB", "RGBA"),
    }
    found = {
        f"{kind} {mode}": saved(images[mode], kind)
        for kind, modes in supported.items()
        for mode in modes
    }
    for compression in ("tiff_lzw", "tiff_adobe_deflate", "packbits"):
        for mode in supported["TIFF"]:
            name = f"TIFF {mode} {compression}"
            found[name] = saved(images[mode], "TIFF", compression=compression)
    found["TIFF group4"] = saved(images["1"], "TIFF", compression="group4")
    found["TIFF jpeg"] = saved(smooth, "TIFF", compression="jpeg")
    found["TIFF pages"] = saved(images["L"], "TIFF", save_all=True, append_images=[smooth])
    found["APNG"] = saved(images["RGB"], "PNG", save_all=True, append_images=[images["RGB"]])
    found["PNG transparent color"] = saved(images["RGB"], "PNG", transparency=(1, 2, 3))
    found["PNG transparent index"] = saved(images["P"], "PNG", transparency=1)
    found["WEBP lossless"] = saved(images["RGBA"], "WEBP", lossless=True, exact=True)
    for subsampling in (0, 1, 2):
        found[f"JPEG {subsampling}"] = saved(smooth, "JPEG", quality=60, subsampling=subsampling)
    found["JPEG progressive"] = saved(smooth, "JPEG", progressive=True)
    for orientation in range(1, 9):
        found[f"JPEG turned {orientation}"] = saved(smooth, "JPEG", exif=oriented(orientation))
    for orientation in range(1, 5):
        tags = {0x0112: orientation}
        found[f"TIFF turned {orientation}"] = saved(images["RGB"], "TIFF", tiffinfo=tags)
    for bits in (1, 2, 4):
        found[f"PNG {bits} bits"] = png(GREY, 0, bits=bits)
    palette = (b"PLTE", COLORS[..., :3].tobytes()[: 3 * 256])
    found["PNG palette of 4 bits"] = png(GREY, 3, (palette[0], palette[1][: 3 * 16]), bits=4)
    for color_type, channels in ((0, 1), (2, 3), (4, 2), (6, 4)):
        found[f"PNG 16 bits {color_type}"] = png(WIDE[..., :channels], color_type, bits=16)
    for name, chunk in {
        "gamma": (b"gAMA", struct.pack(">I", 45455)),
        "linear": (b"gAMA", struct.pack(">I", 100000)),
        "sRGB": (b"sRGB", b"\0"),
    }.items():
        found[f"PNG {name} RGB"] = png(COLORS, 6, chunk)
        found[f"PNG {name} grey"] = png(GREY, 0, chunk)
        found[f"PNG {name} palette"] = png(GREY, 3, chunk, palette)
    for maximum in (255, 65535):
        found[f"PGM {maximum}"] = pnm("P5", maximum, WIDE[..., 0].astype(int) % (maximum + 1))
        found[f"PPM {maximum}"] = pnm("P6", maximum, WIDE[..., :3].astype(int) % (maximum + 1))
    for order in "<>":
        for extra in (0, 1, 2):
            found[f"TIFF RGB + alpha {extra} {order}"] = tiff(COLORS, 2, extra, order)
            found[f"TIFF 16 bits + alpha {extra} {order}"] = tiff(WIDE, 2, extra, order)
            found[f"TIFF grey + alpha {extra} {order}"] = tiff(COLORS[..., :2], 1, extra, order)
        found[f"TIFF 16 bits RGB {order}"] = tiff(WIDE[..., :3], 2, None, order)
        found[f"TIFF 16 bits grey {order}"] = tiff(WIDE[..., 0], 1, None, order)
        found[f"TIFF white is 0 {order}"] = tiff(GREY, 0, None, order)
    words = RNG.integers(0, 65536, (SIZE[1], SIZE[0] + SIZE[0] % 2), np.uint16).tobytes()
    found["BMP 555"] = bmp(16, 0, words)
    found["BMP 565"] = bmp(16, 3, words, struct.pack("<III", 0xF800, 0x7E0, 0x1F))
    return found


FILES: Final = files()


def opencv_grey(cv2: Any, data: bytes) -> Pixels:
    """Returns what OpenCV reads; the alpha of TIFF is hidden, with which it multiplies colours."""
    for order in "<>":
        entry = struct.pack(order + "HHIH", 338, 3, 1, 2)
        data = data.replace(entry, struct.pack(order + "HHIH", 338, 3, 1, 0))
    image: Pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    return image


@pytest.mark.parametrize("name", FILES)
def test_the_grey_values_are_those_of_opencv(tmp_path: Path, name: str) -> None:
    cv2 = pytest.importorskip("cv2")
    path = tmp_path / "map"
    path.write_bytes(FILES[name])
    image = read_grey_image(str(path))
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    np.testing.assert_array_equal(image, opencv_grey(cv2, FILES[name]))


@pytest.mark.parametrize("magic", ["P2", "P3", "P5", "P6"])
@pytest.mark.parametrize("maximum", [1, 15, 100, 254, 1000, 65534])
def test_values_of_pnm_files_are_fractions_of_the_maximum(
    tmp_path: Path, magic: str, maximum: int
) -> None:
    """map_server scales binary values, too, and rounds down; OpenCV reads them as they are."""
    is_color = magic in ("P3", "P6")
    values = WIDE[..., :3].astype(int) % (maximum + 1) if is_color else WIDE[..., 0].astype(int)
    values = values % (maximum + 1)
    data = pnm(magic, maximum, values)
    if magic in ("P2", "P3"):
        header = f"{magic}\n# by hand\n{SIZE[0]} {SIZE[1]}\n{maximum}\n"
        data = (header + " ".join(map(str, values.ravel())) + "\n").encode()
    path = tmp_path / "map.pgm"
    path.write_bytes(data)
    image = read_grey_image(str(path))
    scaled = values * 255 // maximum
    if is_color:
        scaled = np.floor(scaled @ (4899, 9617, 1868) / 2**14 + 0.5)
    if magic == "P3" and maximum > 255:  # Pillow itself reduces these to 8 bits, and rounds.
        np.testing.assert_allclose(image, scaled, atol=1)
    else:
        np.testing.assert_array_equal(image, scaled)
    if magic == "P2" and maximum < 256:  # the ones that OpenCV scales
        cv2 = pytest.importorskip("cv2")
        np.testing.assert_array_equal(image, opencv_grey(cv2, data))


def test_values_above_the_maximum_are_white(tmp_path: Path) -> None:
    path = tmp_path / "map.pgm"
    path.write_bytes(b"P5\n4 1\n100\n" + bytes((0, 50, 100, 255)))
    assert read_grey_image(str(path)).tolist() == [[0, 127, 255, 255]]


def test_a_gif_and_an_animation_are_read(tmp_path: Path) -> None:
    first, second = Pillow.fromarray(GREY), Pillow.fromarray(255 - GREY)
    for kind in ("GIF", "WEBP"):
        path = tmp_path / kind
        first.save(path, kind, save_all=True, append_images=[second], lossless=True)
        np.testing.assert_allclose(read_grey_image(str(path)), GREY, atol=1)


def test_a_large_image_is_read_without_a_warning(tmp_path: Path, monkeypatch: Any) -> None:
    # Pillow warns about images that are larger than this, and refuses twice the size.
    monkeypatch.setattr(Pillow, "MAX_IMAGE_PIXELS", 500)
    monkeypatch.setattr(grey_image, "_STRIP_PIXELS", 500)
    for name in ("PNG L", "TIFF L", "TIFF L tiff_lzw", "PPM L", "BMP L"):
        path = tmp_path / name
        path.write_bytes(FILES[name])
        image = read_grey_image(str(path))
        np.testing.assert_array_equal(image, np.asarray(Pillow.fromarray(COLORS).convert("L")))
    assert Pillow.MAX_IMAGE_PIXELS == 500


def test_neither_opencv_nor_other_formats_are_imported(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    path.write_bytes(FILES["PNG L"])
    script = (
        "import sys; from flatland.maps.grey_image import read_grey_image;"
        "print(int(read_grey_image(sys.argv[1]).sum()));"
        "print([n for n in sys.modules if n == 'cv2' or 'ImagePlugin' in n])"
    )
    result = run_program([sys.executable, "-c", script, str(path)], check=True)
    grey = np.asarray(Pillow.fromarray(COLORS).convert("L"))
    assert result.stdout == f"{grey.sum()}\n['PIL.PngImagePlugin']\n"
    assert result.stderr == ""


DAMAGED = "the image is damaged, or its format is not supported"


@pytest.mark.parametrize(
    ("name", "reason", "hint"),
    [
        ("nothing", "No such file", "the file does not exist"),
        ("folder", "not a regular file", "the file cannot be read: it is not a regular file"),
        ("text", "its format is unknown", "the file is not an image"),
        ("empty", "its format is unknown", "the file is empty"),
        ("cut png", "truncated", "the image is truncated after 600 bytes"),
        ("cut pgm", "truncated", "the image is truncated after 600 bytes"),
        ("cut jpg", "truncated", "the image is truncated after 600 bytes"),
        ("cut tif", "", DAMAGED),
        ("large", "200000 x 200000 pixels", "the image is truncated"),
        ("cut jp2", "", DAMAGED),
        ("png with other line ends", "", DAMAGED),
        ("broad bmp", "2000000 x 1 pixels", f"{DAMAGED} (2000000 x 1 pixels are more"),
        ("broken tif", "", DAMAGED),
        ("float tif", "in mode F", f"{DAMAGED} (TIFF with pixels of (32,) bits in mode F)"),
    ],
)
def test_invalid_images(tmp_path: Path, name: str, reason: str, hint: str) -> None:
    path = tmp_path / name
    contents = {
        "text": b"no image\n",
        "empty": b"",
        "cut png": FILES["PNG L"][:600],
        "cut pgm": FILES["PPM L"][:600],
        "cut jpg": FILES["JPEG L"][:600],
        "cut tif": FILES["TIFF L"][:600],
        "large": b"P5\n200000 200000\n255\n",
        "cut jp2": b"\xff\x4f\xff\x51" + bytes(20),
        "png with other line ends": FILES["PNG L"].replace(b"\r\n", b"\n"),
        "broad bmp": b"BM"
        + struct.pack("<IIIIiiHHIIIIII", 80, 0, 54, 40, 2000000, 1, 1, 24, *[0] * 6),
        "broken tif": b"II*\0\xff\xff\xff\xff",
        "float tif": saved(Pillow.fromarray(GREY.astype(np.float32)), "TIFF"),
    }
    if name == "folder":
        path.mkdir()
    elif name in contents:
        path.write_bytes(contents[name])
    with pytest.raises(OSError, match=rf"(?s){reason}.*{name}|{name}.*{reason}") as caught:
        read_grey_image(str(path))
    assert why_unreadable(str(path), caught.value).startswith(hint)
