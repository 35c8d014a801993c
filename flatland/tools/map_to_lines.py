"""Convert an image map to a map of line segments.

For noisy maps whose exact pixel boundary has too many edges for a simulation.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from flatland.config.reader import YamlReader
from flatland.errors import FlatlandError, MapFileError
from flatland.extras import require
from flatland.geometry import DoubleArray, Pose
from flatland.maps.grey_image import GreyImage, read_grey_image
from flatland.maps.map_image import threshold_in_place
from flatland.output_files import replaced
from flatland.streams import accept_any_text
from flatland.tools.wall_segments import find_wall_segments

IMAGE_SCALES = {"low": 1.05, "med": 1.5, "high": 2.0}

_LINE_COLOR = (0, 0, 255)  # BGR
_SUBPIXEL_BITS = 4


@dataclass(frozen=True)
class ImageMap:
    """Contents of a map file of map_server.

    Attributes:
        image_path: Path of the image.
        image: Grey values, shape (rows, columns).
        resolution: Size of a pixel [m].
        origin: Pose of the lower left corner of the image in the layer frame.
        occupied_thresh: Occupancy above which a pixel is occupied.
    """

    image_path: str
    image: GreyImage
    resolution: float
    origin: Pose
    occupied_thresh: float


def read_image_map(path: str) -> ImageMap:
    """Reads a map file of map_server and its image.

    Args:
        path: Path of the map file.

    Raises:
        FlatlandError: The file or the image cannot be read, or a key is missing or invalid.
    """
    reader = YamlReader.from_file(path)
    if reader.get("type", "string", None) == "line_segments":
        raise reader.subnode("type").error("The map must be an image map, not line segments")
    image_path = reader.resolve_path(reader.get("image", "string"))
    resolution = reader.get("resolution", "float")
    origin = reader.get("origin", "pose")
    occupied_thresh = reader.get("occupied_thresh", "float")
    if not (math.isfinite(resolution) and resolution > 0):
        raise reader.subnode("resolution").error(
            f'Invalid "resolution", must be greater than 0, got {resolution}'
        )
    for key, values in (("origin", origin), ("occupied_thresh", [occupied_thresh])):
        if not all(map(math.isfinite, values)):
            raise reader.subnode(key).error(f'Invalid "{key}", must be finite')
    try:
        image = read_grey_image(image_path)
    except OSError as error:
        raise reader.subnode("image").error(f'Failed to load "{image_path}"') from error
    return ImageMap(image_path, image, resolution, origin, occupied_thresh)


def find_segments(image_map: ImageMap, detail: str) -> DoubleArray:
    """Detects the line segments of a map.

    Args:
        image_map: The map.
        detail: Key of `IMAGE_SCALES`.

    Returns:
        Segments (x1, y1, x2, y2) in pixels from the lower left corner of the image, shape (n, 4).
    """
    mask = threshold_in_place(image_map.image.copy(), image_map.occupied_thresh).astype(bool)
    segments = find_wall_segments(mask, IMAGE_SCALES[detail])
    segments[:, 1::2] = len(mask) - segments[:, 1::2]
    return segments


def write_data(path: Path, segments: DoubleArray) -> None:
    """Writes the data file, one segment per line."""
    with path.open("wb") as file:
        np.savetxt(file, segments, fmt="%.3f")


def write_map(path: Path, data_name: str, image_map: ImageMap) -> None:
    """Writes the map file that refers to the data file."""
    entries = {
        "type": "line_segments",
        "data": data_name,
        "scale": image_map.resolution,
        "origin": list(image_map.origin),
    }
    path.write_text(yaml.safe_dump(entries, sort_keys=False, default_flow_style=None))


def write_overlay(path: Path, segments: DoubleArray, image: GreyImage) -> None:
    """Writes an image of the map with the segments on top.

    Raises:
        OSError: The image cannot be written.
    """
    cv2 = require("cv2", "images of line segments need")
    overlay = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    for x1, y1, x2, y2 in segments:
        # The origin of OpenCV is the centre of the top left pixel.
        ends = np.array([[x1, len(image) - y1], [x2, len(image) - y2]]) - 0.5
        start, end = np.rint(ends * 2**_SUBPIXEL_BITS).astype(int).tolist()
        cv2.line(overlay, start, end, _LINE_COLOR, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
    is_encoded, data = cv2.imencode(path.suffix, overlay)
    if not is_encoded:
        raise OSError(f"OpenCV cannot write {path}")
    path.write_bytes(data.tobytes())


def convert(
    map_path: str, folder: Path, name: str, *, detail: str, overlay: bool, force: bool
) -> None:
    """Converts a map and prints the names of the files read and written.

    Args:
        map_path: Path of a map file of map_server.
        folder: Output folder.
        name: Name of the output files, without extension.
        detail: Key of `IMAGE_SCALES`.
        overlay: Whether to write an image of the segments.
        force: Whether to overwrite existing files.

    Raises:
        FlatlandError: The map, the folder or the name is invalid, or a file already exists.
        OSError: A file cannot be written.
    """
    if not folder.is_dir():
        raise MapFileError(f'Folder does not exist, path="{folder}"')
    if name != Path(name).name:
        raise MapFileError(f'The name of the output files must not contain a folder, got "{name}"')
    map_file, data_file, overlay_file = (folder / f"{name}.{e}" for e in ("yaml", "dat", "png"))
    outputs = [map_file, data_file, *([overlay_file] if overlay else [])]
    existing = [str(path) for path in outputs if path.exists()]
    if existing and not force:
        raise MapFileError(f"File exists (use --force to overwrite): {', '.join(existing)}")

    image_map = read_image_map(map_path)
    rows, columns = image_map.image.shape
    print(f"Read {map_path}: {image_map.image_path}, {columns} x {rows} pixels")
    segments = find_segments(image_map, detail)
    if not len(segments):
        raise MapFileError(f'No line segments found in "{image_map.image_path}"')
    with ExitStack() as files:
        map_part, data_part, *overlay_parts = (files.enter_context(replaced(p)) for p in outputs)
        write_data(data_part, segments)
        write_map(map_part, data_file.name, image_map)
        for part in overlay_parts:
            write_overlay(part, segments, image_map.image)
    print(f"Wrote {', '.join(map(str, outputs))}: {len(segments)} line segments")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the tool.

    Returns:
        Exit code: 0, or 1 after an error, which is printed to the standard error.
    """
    accept_any_text()
    parser = argparse.ArgumentParser(prog="map_to_lines.py", description=__doc__)
    parser.add_argument("map", metavar="MAP_YAML", help="map file of map_server")
    parser.add_argument("folder", metavar="OUTPUT_DIR", type=Path, help="output folder")
    parser.add_argument(
        "-f",
        "--file",
        default="map_lines",
        metavar="NAME",
        help="name of the output files (map_lines)",
    )
    parser.add_argument(
        "-i", "--image", action="store_true", help="also write NAME.png, the map with the segments"
    )
    parser.add_argument(
        "-d", "--detail", choices=IMAGE_SCALES, default="med", help="level of detail (med)"
    )
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    options = parser.parse_args(arguments)
    try:
        convert(
            options.map,
            options.folder,
            options.file,
            detail=options.detail,
            overlay=options.image,
            force=options.force,
        )
    except (FlatlandError, OSError) as error:
        print(f"map_to_lines.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
