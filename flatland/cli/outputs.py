"""Files that commands write."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from flatland.errors import FlatlandError

if TYPE_CHECKING:
    from flatland.ros.bag import BagRecorder


def path_with(suffixes: Sequence[str]) -> Callable[[str], Path]:
    """Returns a conversion of paths with certain suffixes, such as `.bag`."""

    def path(text: str) -> Path:
        if Path(text).suffix.lower() not in suffixes:
            raise argparse.ArgumentTypeError(f"must end with {' or '.join(suffixes)}, got {text!r}")
        return Path(text)

    return path


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Yields a temporary path; the file becomes `path` at the end, and is removed on an error."""
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)  # noqa: PTH105
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def open_bag(path: Path, files: ExitStack) -> BagRecorder:
    """Creates a bag, which is closed at the end of `files`.

    Raises:
        FlatlandError: ROS is not installed.
        OSError: The file cannot be written.
    """
    try:
        from flatland.ros.bag import BagRecorder
    except ImportError as error:
        raise FlatlandError(
            f"bags need the messages of ROS and rosbag ({error}): "
            "apt-get install python3-rosbag python3-tf2-msgs python3-nav-msgs python3-sensor-msgs"
        ) from error
    recorder = BagRecorder(path)
    files.callback(recorder.close)
    return recorder
