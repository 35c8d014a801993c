"""The argument of the programs that draw images."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

_IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"


def picture_folder(description: str, arguments: Sequence[str]) -> Path:
    """Reads the folder of the images from the command line, and creates it.

    Args:
        description: Docstring of the program.
        arguments: Arguments of the command line, without the name of the program.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=_IMAGES,
        help="folder of the images, which overwrite existing ones (default: docs/images)",
    )
    folder: Path = parser.parse_args(arguments).folder
    folder.mkdir(parents=True, exist_ok=True)
    return folder
