"""`PeopleMarkers` as `visualization_msgs/MarkerArray`."""

from __future__ import annotations

from typing import Final

import numpy as np

from flatland.node.adapters.marker import Marker, write_markers
from flatland.node.adapters.writer import Writer
from flatland.values import PeopleMarkers

HEIGHT: Final = 1.7  # of a person [m]
_LINE_WIDTH: Final = 0.05  # [m]
_TEXT_HEIGHT: Final = 0.25  # [m]
_DARK: Final = (0.2, 0.2, 0.2, 1.0)


def people_markers(value: PeopleMarkers, to: Writer) -> None:
    """Writes markers in namespaces that RViz can hide.

    The bodies of a group are one marker of the namespace `people`. The velocities of all people are
    one in `velocities`, as the distances in one second. Each name is one in `names`.
    """
    write_markers(_markers(value), to)


def _markers(value: PeopleMarkers) -> list[Marker]:
    if value.removed is None:
        markers = [Marker(action=Marker.DELETEALL)]
    else:
        markers = [_deletion("names", number) for number in value.removed]
    at = (value.stamp, value.frame_id)
    poses = value.poses.tolist()
    for number, group in enumerate(value.group_names):
        width = 2.0 * value.radii[number]
        centers = [
            (x, y, HEIGHT / 2)
            for (x, y, _), own_group in zip(poses, value.groups, strict=True)
            if own_group == group
        ]
        bodies = Marker("people", number, Marker.SPHERE_LIST, *at, color=value.colors[number])
        bodies.scale = (width, width, HEIGHT)
        bodies.points = np.array(centers).reshape(-1, 3)
        markers.append(bodies if centers else _deletion("people", number))
    ends = []
    for (x, y, _), (vx, vy, _) in zip(poses, value.velocities.tolist(), strict=True):
        ends += [(x, y, HEIGHT), (x + vx, y + vy, HEIGHT)]
    lines = Marker("velocities", 0, Marker.LINE_LIST, *at, color=_DARK)
    lines.scale = (_LINE_WIDTH, 0.0, 0.0)
    lines.points = np.array(ends).reshape(-1, 3)
    markers.append(lines if ends else _deletion("velocities", 0))
    for number, name, (x, y, _) in zip(value.ids, value.names, poses, strict=True):
        text = Marker("names", number, Marker.TEXT_VIEW_FACING, *at, color=_DARK)
        text.position = (x, y, HEIGHT + _TEXT_HEIGHT)
        text.scale = (0.0, 0.0, _TEXT_HEIGHT)
        text.text = name
        markers.append(text)
    return markers


def _deletion(namespace: str, number: int) -> Marker:
    return Marker(namespace, number, action=Marker.DELETE)
