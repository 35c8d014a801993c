"""Video files, written by OpenCV."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from flatland.extras import require

_LOG = logging.getLogger("flatland")

VIDEO_FORMATS: Final = (".mp4",)
# H.264, which browsers play; MPEG-4 Part 2 where OpenCV was built without an encoder for it.
_CODECS: Final = ("avc1", "mp4v")
_BOX_HEADER: Final = 8  # bytes: length and kind of a box of an MP4 file
_PROBE: Final = 1 << 20  # bytes


def check_opencv() -> Any:
    """Returns the module `cv2`.

    Raises:
        FlatlandError: OpenCV is missing or broken.
    """
    return require("cv2", "videos need")


class VideoFile:
    """A video file that is open for writing.

    Attributes:
        codec: Four characters of the codec, `avc1` for H.264.
        frames: Number of frames written.
    """

    def __init__(self, path: str | os.PathLike[str], fps: float, size: tuple[int, int]) -> None:
        """Creates the file.

        Args:
            path: The file, overwritten if it exists.
            fps: Frames per second.
            size: Width and height [pixels], even numbers.

        Raises:
            FlatlandError: OpenCV is missing.
            OSError: The file cannot be written.
        """
        cv2 = check_opencv()
        self._path = Path(path)
        with self._path.open("wb"):
            pass  # OpenCV does not say why it cannot write a file
        self.frames = 0
        self._is_closed = False
        for self.codec in _CODECS:
            code = cv2.VideoWriter_fourcc(*self.codec)
            self._writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, fps, size)
            if self._writer.isOpened():
                break
            _LOG.warning('OpenCV has no encoder for the codec "%s"', self.codec)
        else:
            _check_writable(self._path)
            raise OSError(f"OpenCV cannot write {path} with the codecs {', '.join(_CODECS)}")

    def write(self, image: npt.NDArray[np.uint8]) -> None:
        """Appends a frame, an RGB image of shape (height, width, 3)."""
        self._writer.write(np.ascontiguousarray(image[:, :, ::-1]))  # as BGR
        self.frames += 1

    def close(self) -> None:
        """Completes the file.

        Raises:
            OSError: The file is incomplete, for example because the disk is full.
        """
        if self._is_closed:
            return
        self._is_closed = True
        self._writer.release()
        if self.frames and not _is_complete(self._path):
            _check_writable(self._path)
            raise OSError(f"OpenCV did not write all of {self._path}")


def _check_writable(path: Path) -> None:
    """Raises the error that OpenCV does not report: a full disk does not take these bytes either.

    Raises:
        OSError: The file cannot be written.
    """
    with path.open("ab") as file:
        file.write(bytes(_PROBE))


def _is_complete(path: Path) -> bool:
    """Returns whether a file consists of whole boxes, as MP4 files do, with their index."""
    size, place, kinds = path.stat().st_size, 0, set()
    with path.open("rb") as file:
        while place + _BOX_HEADER <= size:
            file.seek(place)
            header = file.read(2 * _BOX_HEADER)
            length = int.from_bytes(header[:4], "big")
            if length == 1:  # The length follows as a number of 64 bits.
                length = int.from_bytes(header[_BOX_HEADER:], "big")
            if length < _BOX_HEADER:
                return False
            kinds.add(header[4:_BOX_HEADER])
            place += length
    return place == size and b"moov" in kinds
