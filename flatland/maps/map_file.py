"""Map files, which define the geometry of a layer by an image or by line segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flatland.config.file_kinds import missing_file
from flatland.config.inputs import Inputs
from flatland.config.reader import ReadYaml, YamlReader, read_yaml
from flatland.errors import MapFileError, Place
from flatland.geometry import FloatArray, Pose
from flatland.maps.grey_image import read_image
from flatland.maps.image_problems import image_problem, threshold_problem
from flatland.maps.line_segments import read_line_segments
from flatland.maps.map_image import image_edges, threshold_in_place
from flatland.maps.unreadable_image import why_unreadable

# Keys of map_server and similar programs, ignored silently. Other unknown keys are logged and
# ignored, because map files are shared between programs.
_IGNORED_IMAGE_KEYS = ("negate", "free_thresh", "mode", "frame_id")

_MAX_USUAL_RESOLUTION = 1.0  # m per pixel


@dataclass(frozen=True, eq=False)
class LayerMap:
    """Static geometry of one layer.

    Attributes:
        origin: Pose of the body of the layer in the world frame [m, m, rad].
        edges: Edges (x1, y1, x2, y2) in the frame of the body of the layer [m], shape (n, 4).
        exact_edge_count: Number of edges without simplification.
        path: The map file.
        unknown_keys: Keys of the map file that flatland does not use, sorted.
        scale_place: Position of the size of a pixel, or of the unit of the line segments.
    """

    origin: Pose
    edges: npt.NDArray[np.float32]
    exact_edge_count: int
    path: str
    unknown_keys: tuple[str, ...]
    scale_place: Place


def load_map(
    path: str,
    layer_name: str,
    *,
    inputs: Inputs,
    simplify: int = 0,
    read: ReadYaml = read_yaml,
) -> LayerMap:
    """Reads a map file and its image or data file.

    Args:
        path: Map file (YAML).
        layer_name: First name of the layer, for errors and the log.
        inputs: Reads all files, and parameters.
        simplify: 0 exact boundary of the image; 1 boundary simplified with a tolerance of one
            pixel; 2 the same after the removal of small features of the free space. Line segments
            are not simplified.
        read: Loads the map file.

    Returns:
        The geometry of the layer.

    Raises:
        YamlError: The map file is invalid, or its image cannot be read.
        MapFileError: The data file of line segments cannot be read.
    """
    reader = read(path, inputs).with_location(f'layer "{layer_name}"')
    reader.require_kind("map")
    if reader.get("type", "string", None) == "line_segments":
        layer_map = _load_line_segments(reader, inputs, layer_name)
    else:
        layer_map = _load_image(reader, inputs, layer_name, simplify)
    edge_count = len(layer_map.edges)
    if edge_count == layer_map.exact_edge_count:
        inputs.log.info('Layer "%s": %d edges from %s', layer_name, edge_count, path)
    else:
        inputs.log.info(
            'Layer "%s": %d edges from %s, simplified (exact: %d)',
            layer_name,
            edge_count,
            path,
            layer_map.exact_edge_count,
        )
    if layer_map.unknown_keys:
        inputs.log.info(
            'Layer "%s": unknown keys {%s} of %s ignored',
            layer_name,
            ", ".join(layer_map.unknown_keys),
            path,
        )
    return layer_map


def _load_image(reader: YamlReader, inputs: Inputs, layer_name: str, simplify: int) -> LayerMap:
    reader = reader.without("type", *_IGNORED_IMAGE_KEYS)
    image_path = reader.resolve_path(reader.get("image", "string"))
    resolution = reader.get("resolution", "float", finite=True)
    origin = reader.get("origin", "pose", finite=True)
    occupied_thresh = reader.get("occupied_thresh", "float", finite=True)
    unknown_keys = tuple(sorted(reader.unread_keys()))
    if resolution <= 0:
        reader.report(reader.invalid("resolution", f"must be positive, got {resolution}"))
        resolution = 1.0
    resolution_place = reader.subnode("resolution").place
    if resolution > _MAX_USUAL_RESOLUTION:
        reader.warn("resolution", f"{resolution:g} m per pixel; 0.05 is usual")

    def make_edges() -> tuple[FloatArray, int, str, str]:
        image = read_image(image_path)
        wrong_threshold = threshold_problem(image, occupied_thresh)
        problem = "" if wrong_threshold else image_problem(image, occupied_thresh)
        mask = threshold_in_place(image.grey, occupied_thresh)
        return *image_edges(mask, resolution, simplify), wrong_threshold, problem

    try:
        edges, exact_edge_count, wrong_threshold, problem = inputs.parsed(
            image_path, ("edges", occupied_thresh, resolution, simplify), make_edges
        )
    except OSError as error:
        node = reader.subnode("image")
        raise node.error(
            f'Failed to load "{image_path}" in layer "{layer_name}"',
            why_unreadable(image_path, error),
        ) from error
    except ValueError as error:
        raise reader.invalid("resolution", str(error)) from error
    if wrong_threshold and reader.is_complete:
        place = reader.subnode("occupied_thresh").place
        inputs.warn(place, 'Layer "%s": %s (%s)', layer_name, wrong_threshold, image_path)
    elif problem and reader.is_complete:
        place = reader.subnode("image").place
        inputs.warn(place, 'Layer "%s", image "%s": %s', layer_name, image_path, problem)
    return LayerMap(origin, edges, exact_edge_count, reader.path, unknown_keys, resolution_place)


def _load_line_segments(reader: YamlReader, inputs: Inputs, layer_name: str) -> LayerMap:
    reader = reader.without("type")
    data_path = reader.resolve_path(reader.get("data", "string"))
    scale = reader.get("scale", "float", finite=True)
    origin = reader.get("origin", "pose", finite=True)
    unknown_keys = tuple(sorted(reader.unread_keys()))
    if scale == 0:
        reader.report(reader.invalid("scale", "must not be 0"))
    try:
        segments = inputs.parsed(data_path, "segments", lambda: read_line_segments(data_path))
    except OSError as error:
        located = reader.subnode("data").error(f'Failed to load "{data_path}"')
        # A file outside of the allowed folders is not compared with those beside it.
        hint = "" if isinstance(error, PermissionError) else missing_file(data_path, "data")
        raise MapFileError(located.message, place=located.place, hint=hint) from error
    if not len(segments):
        inputs.warn(
            reader.subnode("data").place,
            'Layer "%s": no line segments in %s, so that the layer has no walls',
            layer_name,
            data_path,
        )
    with np.errstate(over="ignore"):
        edges = (segments * scale).astype(np.float32)
    if not np.isfinite(edges).all():
        raise reader.invalid("scale", "a coordinate does not fit a 32-bit float")
    has_length = (edges[:, :2] != edges[:, 2:]).any(axis=1)
    if not has_length.all():
        inputs.log.warning(
            'Layer "%s": %d line segments of length 0 in %s ignored',
            layer_name,
            np.count_nonzero(~has_length),
            data_path,
        )
        edges = edges[has_length]
    scale_place = reader.subnode("scale").place
    return LayerMap(origin, edges, len(edges), reader.path, unknown_keys, scale_place)
