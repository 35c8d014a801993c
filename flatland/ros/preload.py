"""Makes the node's start quick: loads OpenCV while rospy talks to the ROS master."""

from __future__ import annotations

import ctypes
import importlib.util
import threading


def preload_opencv() -> None:
    """Loads OpenCV's libraries in a thread of its own; returns at once.

    Debian's OpenCV brings some 350 libraries, which takes a third of a second. `import cv2` would
    hold up all other threads meanwhile, `dlopen` does not; the import that comes later finds the
    libraries there.
    """
    threading.Thread(target=_load, name="flatland-preload", daemon=True).start()


def _load() -> None:
    try:
        spec = importlib.util.find_spec("cv2")
        if spec is not None and spec.origin is not None and spec.origin.endswith(".so"):
            ctypes.CDLL(spec.origin)
    except (ImportError, OSError):
        return  # Whoever needs it will say what is wrong.
