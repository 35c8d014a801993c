"""A virtual screen: Xvfb with software OpenGL, screenshots, mouse and keyboard."""

from __future__ import annotations

import contextlib
import os
import shutil
import struct
import subprocess

import numpy as np
import numpy.typing as npt

PROGRAMS = ("Xvfb", "xwd", "xdotool")

Image = npt.NDArray[np.uint8]


def missing_programs() -> list[str]:
    """Returns the required programs that are not installed."""
    return [program for program in PROGRAMS if shutil.which(program) is None]


class VirtualScreen:
    """A virtual X server on a free display number."""

    def __init__(self, width: int = 1280, height: int = 800, *more: str) -> None:
        """Starts the server.

        Args:
            width: Width of the screen [px].
            height: Height of the screen [px].
            more: Additional command-line options of Xvfb.

        Raises:
            RuntimeError: Xvfb failed to start.
        """
        reading, writing = os.pipe()
        options = ["-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp", "-noreset", *more]
        self._server = subprocess.Popen(  # noqa: S603 - fixed command
            [PROGRAMS[0], "-displayfd", str(writing), *options],
            pass_fds=[writing],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        if not number:
            raise RuntimeError(f"Xvfb did not start, exit code {self._server.wait()}")
        self.display = f":{number}"

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables of programs that use the screen."""
        return {
            "DISPLAY": self.display,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "QT_X11_NO_MITSHM": "1",
            "QT_QPA_PLATFORM": "xcb",
            "QT_SCALE_FACTOR": "1",
        }

    def close(self) -> None:
        """Stops the server and disconnects its clients."""
        self._server.terminate()
        self._server.wait()

    def picture(self) -> Image:
        """Returns a screenshot: red, green, blue; shape (height, width, 3)."""
        for _ in range(10):
            # xwd fails if a window is closed at the same time.
            with contextlib.suppress(subprocess.CalledProcessError):
                data = self._run("xwd", "-root", "-silent")
                break
        else:
            raise RuntimeError(f"xwd failed on display {self.display}")
        header = struct.unpack(">25I", data[:100])
        size, width, height, pixel_bits, row_bytes, colors = (
            header[index] for index in (0, 4, 5, 11, 12, 19)
        )
        pixel_bytes = pixel_bits // 8
        rows = np.frombuffer(data, np.uint8, offset=size + 12 * colors, count=row_bytes * height)
        pixels = rows.reshape(height, row_bytes)[:, : width * pixel_bytes]
        image: Image = pixels.reshape(height, width, pixel_bytes)[:, :, 2::-1].copy()
        return image

    def area_of(self, title: str) -> tuple[int, int, int, int] | None:
        """Returns left, top, width and height of the window with a title [px], None if not open."""
        search = ("search", "--onlyvisible", "--name", f"^{title}$")
        try:
            output = self._run("xdotool", *search, "getwindowgeometry", "--shell").decode()
        except subprocess.CalledProcessError:
            return None
        fields = dict(line.split("=") for line in output.split())
        left, top, width, height = (int(fields[key]) for key in ("X", "Y", "WIDTH", "HEIGHT"))
        return left, top, width, height

    # -- mouse and keys --------------------------------------------------------------------

    def move(self, x: float, y: float) -> None:
        """Moves the mouse pointer to a pixel."""
        self._run("xdotool", "mousemove", str(round(x)), str(round(y)))

    def click(self, x: float, y: float, button: int = 1) -> None:
        """Clicks a mouse button at a pixel."""
        self.move(x, y)
        self._run("xdotool", "click", str(button))

    def press(self, button: int = 1) -> None:
        """Presses a mouse button and holds it."""
        self._run("xdotool", "mousedown", str(button))

    def release(self, button: int = 1) -> None:
        """Releases a mouse button."""
        self._run("xdotool", "mouseup", str(button))

    def key(self, *keys: str) -> None:
        """Presses and releases keys, such as `Escape` or `ctrl+q`."""
        self._run("xdotool", "key", *keys)

    def resize(self, title: str, width: int, height: int) -> None:
        """Resizes the windows with a title [px]."""
        search = ("search", "--onlyvisible", "--name", f"^{title}$")
        self._run("xdotool", *search, "windowsize", "%@", str(width), str(height))

    def type(self, text: str) -> None:
        """Types a text."""
        self._run("xdotool", "type", "--delay", "1", text)

    def _run(self, *command: str) -> bytes:
        """Runs a program on the screen and returns its output."""
        environment = {**os.environ, "DISPLAY": self.display}
        return subprocess.run(  # noqa: S603 - fixed commands
            command, env=environment, check=True, capture_output=True, timeout=120
        ).stdout
