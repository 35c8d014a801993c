"""`PeopleMarkers` as `visualization_msgs/MarkerArray`."""

from collections.abc import Sequence
from typing import Any, Final

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from flatland.ros.adapters import convert, register_built_in
from flatland.values import PeopleMarkers

HEIGHT: Final = 1.7  # of a person [m]
_LINE_WIDTH: Final = 0.05  # [m]
_TEXT_HEIGHT: Final = 0.25  # [m]
_DARK: Final = (0.2, 0.2, 0.2, 1.0)


def to_message(value: PeopleMarkers) -> MarkerArray:
    """Converts a value to markers, in namespaces that RViz can hide.

    The bodies of a group are one marker of the namespace `people`. The velocities of all people are
    one in `velocities`, as the distances in one second. Each name is one in `names`.
    """
    header = convert.header(value.stamp, value.frame_id)
    markers = _removals(value)
    poses = value.poses.tolist()
    for number, group in enumerate(value.group_names):
        width = 2.0 * value.radii[number]
        bodies = _marker(header, "people", number, Marker.SPHERE_LIST, value.colors[number])
        bodies.scale = Vector3(width, width, HEIGHT)
        bodies.points = [
            Point(x, y, HEIGHT / 2)
            for (x, y, _), own_group in zip(poses, value.groups, strict=True)
            if own_group == group
        ]
        markers.append(bodies if bodies.points else _deletion("people", number))
    lines = _marker(header, "velocities", 0, Marker.LINE_LIST, _DARK)
    lines.scale.x = _LINE_WIDTH
    for (x, y, _), (vx, vy, _) in zip(poses, value.velocities.tolist(), strict=True):
        lines.points += [Point(x, y, HEIGHT), Point(x + vx, y + vy, HEIGHT)]
    markers.append(lines if lines.points else _deletion("velocities", 0))
    for number, name, (x, y, _) in zip(value.ids, value.names, poses, strict=True):
        text = _marker(header, "names", number, Marker.TEXT_VIEW_FACING, _DARK)
        text.pose.position = Point(x, y, HEIGHT + _TEXT_HEIGHT)
        text.scale.z = _TEXT_HEIGHT
        text.text = name
        markers.append(text)
    return MarkerArray(markers)


def _removals(value: PeopleMarkers) -> list[Any]:
    if value.removed is None:
        return [Marker(action=Marker.DELETEALL)]
    return [_deletion("names", number) for number in value.removed]


def _deletion(namespace: str, number: int) -> Marker:
    return Marker(ns=namespace, id=number, action=Marker.DELETE)


def _marker(
    header: Header, namespace: str, number: int, kind: int, color: Sequence[float]
) -> Marker:
    pose = Pose(Point(), Quaternion(0.0, 0.0, 0.0, 1.0))
    return Marker(
        header=header, ns=namespace, id=number, type=kind, pose=pose, color=ColorRGBA(*color)
    )


register_built_in(PeopleMarkers, MarkerArray, to_message=to_message)
