"""Drawings of messages of other nodes, with their real classes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("visualization_msgs", reason="ROS is not installed")

import genpy.dynamic
from geometry_msgs.msg import (
    Point,
    Point32,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    Vector3,
)
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from flatland.errors import MapFileError
from flatland.geometry import quaternion_from_yaw
from flatland.node.foreign_topics import poses
from flatland.node.foreign_topics.drawers import LatestDrawer
from flatland.node.foreign_topics.grids import MAX_LENGTH, GridDrawer
from flatland.node.foreign_topics.markers import MarkerDrawer
from flatland.node.foreign_topics.trees import MAX_VALUES, tree_of
from flatland.node.frame_tree import FrameTree, NoTransformError, transform
from flatland.web.foreign_topics import Grid, Marks

SECOND = 10**9
RED = (255, 0, 0, 255)


@pytest.fixture
def frames() -> FrameTree:
    """The frame `odom` at (10, 0) in `map`, turned by 90 degrees."""
    frames = FrameTree("map")
    frames.set("map", "odom", transform((10, 0, 0), quaternion_from_yaw(math.pi / 2)))
    return frames


def pose(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Pose:
    return Pose(Point(x, y, 0), Quaternion(*quaternion_from_yaw(yaw)))


def stamped(message: Any, frame: str = "map") -> Any:
    message.header.frame_id = frame
    return message


def drawn(convert: Any, message: Any, frames: FrameTree) -> Marks:
    drawer = LatestDrawer(convert)
    drawer.receive(message, 0)
    drawing = drawer.draw(frames, 0, again=False)
    assert isinstance(drawing, Marks)
    return drawing


def area(triangles: np.ndarray) -> float:
    """Returns the sum of the areas of triangles, which must not overlap."""
    a, b, c = triangles[:, 0:2], triangles[:, 2:4], triangles[:, 4:6]
    u, v = b - a, c - a
    return float(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() / 2)


class TestPosesAndPaths:
    def test_a_path_is_transformed_to_the_world_frame(self, frames):
        path = Path(poses=[PoseStamped(pose=pose(x)) for x in (0.0, 1.0, 3.0)])
        marks = drawn(poses.path, stamped(path, "odom"), frames)
        np.testing.assert_allclose(marks.lines, [[10, 0, 10, 1, 0], [10, 1, 10, 3, 0]], atol=1e-6)
        assert marks.line_colors[:, 3].tolist() == [0, 0]  # that of the topic

    @pytest.mark.parametrize("count", [0, 1])
    def test_a_short_path_has_no_lines(self, frames, count):
        path = Path(poses=[PoseStamped(pose=pose())] * count)
        assert len(drawn(poses.path, stamped(path), frames).lines) == 0

    def test_a_long_path_keeps_its_ends(self, frames, monkeypatch):
        monkeypatch.setattr(poses, "MAX_LINES", 100)
        all_poses = [PoseStamped(pose=pose(0.01 * i)) for i in range(200)]
        marks = drawn(poses.path, stamped(Path(poses=all_poses)), frames)
        assert 50 < len(marks.lines) <= 100
        assert marks.lines[0, 0] == 0
        assert marks.lines[-1, 2] == pytest.approx(1.99)

    def test_poses_are_arrows(self, frames):
        array = PoseArray(poses=[pose(1, 2, math.pi / 2), pose(3, 4, math.pi)])
        marks = drawn(poses.poses, stamped(array), frames)
        np.testing.assert_allclose(marks.triangles[:, 4:], [[1, 2.3], [2.7, 4]], atol=1e-6)
        np.testing.assert_allclose(marks.lines[:, :2], [[1, 2], [3, 4]], atol=1e-6)

    def test_poses_with_and_without_covariance(self, frames):
        plain = PoseStamped(pose=pose(1, 2))
        full = PoseWithCovarianceStamped()
        odometry = Odometry()
        full.pose.pose = odometry.pose.pose = pose(1, 2)
        tips = [drawn(poses.pose, stamped(m), frames).triangles for m in (plain, full, odometry)]
        np.testing.assert_allclose(tips[0], tips[1])
        np.testing.assert_allclose(tips[0], tips[2])
        np.testing.assert_allclose(tips[0][:, 4:], [[1.7, 2]], atol=1e-6)

    def test_a_polygon_is_closed(self, frames):
        polygon = PolygonStamped()
        polygon.polygon.points = [Point32(0, 0, 0), Point32(1, 0, 0), Point32(0, 1, 0)]
        marks = drawn(poses.polygon, stamped(polygon), frames)
        assert marks.lines[:, :4].tolist() == [[0, 0, 1, 0], [1, 0, 0, 1], [0, 1, 0, 0]]

    def test_numbers_that_are_not_finite_are_omitted(self, frames):
        points = [(0, 0), (1, 0), (math.nan, 0), (2, 0), (3, 0), (math.inf, 0)]
        path = Path(poses=[PoseStamped(pose=pose(x, y)) for x, y in points])
        marks = drawn(poses.path, stamped(path), frames)
        assert marks.lines[:, :4].tolist() == [[0, 0, 1, 0], [2, 0, 3, 0]]

    def test_rotations_that_are_not_finite_are_omitted(self, frames):
        broken = Pose(Point(), Quaternion(math.inf, 0, 0, 1))
        marks = drawn(poses.poses, stamped(PoseArray(poses=[broken, pose(1)])), frames)
        assert marks.lines[:, 0].tolist() == [1]

    def test_a_drawing_is_repeated_only_if_it_has_changed(self, frames):
        drawer = LatestDrawer(poses.pose)
        assert drawer.draw(frames, 0, again=False) is None
        drawer.receive(stamped(PoseStamped(pose=pose()), "odom"), 0)
        assert drawer.draw(frames, 0, again=False) is not None
        assert drawer.draw(frames, 0, again=False) is None
        assert drawer.draw(frames, 0, again=True) is not None
        frames.set("map", "odom", transform((11, 0, 0)))
        assert drawer.draw(frames, 0, again=False) is not None

    def test_a_frame_without_a_transform_is_an_error(self, frames):
        drawer = LatestDrawer(poses.pose)
        drawer.receive(stamped(PoseStamped(pose=pose()), "lost"), 0)
        with pytest.raises(NoTransformError, match='from "lost" to "map"'):
            drawer.draw(frames, 0, again=False)


def grid_message(cells: Any, frame: str = "map", resolution: float = 0.5) -> OccupancyGrid:
    message = stamped(OccupancyGrid(), frame)
    cells = np.asarray(cells, np.int8)
    message.info.height, message.info.width = cells.shape
    message.info.resolution = resolution
    message.info.origin = pose(1, 2)
    message.data = cells.ravel().tolist()
    return message


class TestGrids:
    def draw(self, drawer: GridDrawer, frames: FrameTree) -> Grid | None:
        drawing = drawer.draw(frames, 0, again=False)
        assert drawing is None or isinstance(drawing, Grid)
        return drawing

    def test_a_grid_has_its_pose_in_the_world(self, frames):
        drawer = GridDrawer()
        assert self.draw(drawer, frames) is None
        drawer.receive(grid_message([[0, 100, -1], [1, 2, 3]], "odom"), 0)
        grid = self.draw(drawer, frames)
        assert grid.pose == pytest.approx((8, 1, math.pi / 2))
        assert (grid.resolution, grid.cells.tolist()) == (0.5, [[0, 100, -1], [1, 2, 3]])
        assert drawer.note == ""
        assert self.draw(drawer, frames) is None
        # Moved cells need not be compressed again, which the server detects by their identity.
        frames.set("map", "odom", transform((0, 0, 0)))
        moved = self.draw(drawer, frames)
        assert moved.pose == (1, 2, 0)
        assert moved.cells is grid.cells

    def test_a_large_grid_is_reduced_and_keeps_its_obstacles(self, frames):
        cells = np.zeros((3, 2 * MAX_LENGTH + 1), np.int8)
        cells[1, 5] = 100
        cells[:, 6:9] = -1
        drawer = GridDrawer()
        drawer.receive(grid_message(cells, resolution=0.25), 0)
        grid = self.draw(drawer, frames)
        assert grid.resolution == 0.75
        assert grid.cells.shape == (1, math.ceil((2 * MAX_LENGTH + 1) / 3))
        assert grid.cells[0, :4].tolist() == [0, 100, -1, 0]
        assert drawer.note == "3 x 3 cells are shown as one"

    def test_updates_change_a_part(self, frames):
        drawer = GridDrawer()
        drawer.receive(update(0, 0, [[1]]), 0)
        drawer.receive(grid_message(np.zeros((2, 3))), 0)
        before = self.draw(drawer, frames)
        drawer.receive(update(1, 0, [[7, 8], [9, 10]]), 0)
        after = self.draw(drawer, frames)
        assert after.cells.tolist() == [[0, 7, 8], [0, 9, 10]]
        assert before.cells.tolist() == [[0, 0, 0], [0, 0, 0]]
        with pytest.raises(MapFileError, match="outside"):
            drawer.receive(update(2, 0, [[7, 8]]), 0)

    def test_a_wrong_number_of_cells_is_an_error(self, frames):
        drawer = GridDrawer()
        message = grid_message(np.zeros((2, 3)))
        message.data.pop()
        with pytest.raises(
            MapFileError, match="3 x 2 cells must have that number of values, got 5"
        ):
            drawer.receive(message, 0)
        assert self.draw(drawer, frames) is None


# The definition of the message, whose package is not installed everywhere.
_UPDATE = """std_msgs/Header header
int32 x
int32 y
uint32 width
uint32 height
int8[] data
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""


def update(x: int, y: int, cells: Any) -> Any:
    message = genpy.dynamic.generate_dynamic("map_msgs/OccupancyGridUpdate", _UPDATE)[
        "map_msgs/OccupancyGridUpdate"
    ]()
    cells = np.asarray(cells, np.int8)
    message.x, message.y = x, y
    message.height, message.width = cells.shape
    message.data = cells.ravel().tolist()
    return message


def marker(kind: int, number: int = 0, **fields: Any) -> Marker:
    defaults = {
        "ns": "n",
        "id": number,
        "type": kind,
        "pose": pose(1, 2),
        "scale": Vector3(1, 1, 1),
        "color": ColorRGBA(1, 0, 0, 1),
    }
    return stamped(Marker(**{**defaults, **fields}))


def points(*flat: tuple[float, float]) -> list[Point]:
    return [Point(x, y, 0) for x, y in flat]


class TestMarkers:
    def draw(self, frames: FrameTree, *markers: Marker, now: int = 0) -> Marks:
        drawer = MarkerDrawer()
        drawer.receive(MarkerArray(markers=list(markers)), 0)
        drawing = drawer.draw(frames, now, again=False)
        assert isinstance(drawing, Marks)
        return drawing

    @pytest.mark.parametrize("tilt", [0.0, math.pi / 2])
    def test_a_cube_covers_its_outline_once(self, frames, tilt):
        rotation = Quaternion(math.sin(tilt / 2), 0, 0, math.cos(tilt / 2))
        cube = marker(Marker.CUBE, pose=Pose(Point(1, 2, 0), rotation), scale=Vector3(1, 2, 3))
        marks = self.draw(frames, cube)
        assert area(marks.triangles) == pytest.approx(1 * (2 if tilt == 0 else 3))
        corners = marks.triangles.reshape(-1, 2)
        np.testing.assert_allclose((corners.min(0) + corners.max(0)) / 2, (1, 2), atol=1e-6)
        assert {tuple(color) for color in marks.triangle_colors.tolist()} == {RED}

    def test_a_cylinder_and_spheres(self, frames):
        marks = self.draw(frames, marker(Marker.CYLINDER, scale=Vector3(2, 2, 1)))
        assert area(marks.triangles) == pytest.approx(math.pi, rel=0.02)
        marks = self.draw(frames, marker(Marker.SPHERE, scale=Vector3(0.5, 0.5, 9)))
        assert marks.lines.tolist() == [[1, 2, 1, 2, 0.5]]
        marks = self.draw(frames, marker(Marker.SPHERE, scale=Vector3(2, 4, 1)))
        assert area(marks.triangles) == pytest.approx(2 * math.pi, rel=0.02)

    @pytest.mark.parametrize("kind", [Marker.POINTS, Marker.SPHERE_LIST])
    def test_points_have_a_size_and_colours(self, frames, kind):
        colors = [ColorRGBA(0, 1, 0, 1), ColorRGBA(0, 0, 1, 0.5)]
        dots = marker(
            kind, points=points((0, 0), (1, 0)), colors=colors, scale=Vector3(0.25, 0.25, 0.25)
        )
        marks = self.draw(frames, dots)
        assert marks.lines.tolist() == [[1, 2, 1, 2, 0.25], [2, 2, 2, 2, 0.25]]
        assert marks.line_colors.tolist() == [[0, 255, 0, 255], [0, 0, 255, 128]]

    def test_lines(self, frames):
        corners = points((0, 0), (1, 0), (1, 1), (5, 5))
        strip = self.draw(frames, marker(Marker.LINE_STRIP, points=corners[:3]))
        assert strip.lines.tolist() == [[1, 2, 2, 2, 1], [2, 2, 2, 3, 1]]
        pairs = self.draw(frames, marker(Marker.LINE_LIST, points=[*corners, Point()]))
        assert pairs.lines.tolist() == [[1, 2, 2, 2, 1], [2, 3, 6, 7, 1]]

    def test_arrows_by_pose_and_by_points(self, frames):
        by_pose = marker(Marker.ARROW, pose=pose(1, 2, math.pi / 2), scale=Vector3(2, 0.2, 0.2))
        by_points = marker(
            Marker.ARROW, points=points((0, 0), (0, 2)), scale=Vector3(0.1, 0.2, 0.46)
        )
        for each in (by_pose, by_points):
            marks = self.draw(frames, each)
            np.testing.assert_allclose(marks.lines, [[1, 2, 1, 3.54, 0.1]], atol=1e-5)
            np.testing.assert_allclose(marks.triangles[0, 4:], (1, 4), atol=1e-5)
            assert area(marks.triangles) == pytest.approx(0.5 * 0.2 * 0.46, rel=1e-3)

    def test_cubes_triangles_and_texts(self, frames):
        cubes = self.draw(frames, marker(Marker.CUBE_LIST, points=points((0, 0), (3, 0))))
        assert area(cubes.triangles) == pytest.approx(2)
        triangle = points((0, 0), (1, 0), (0, 1))
        for corners in (triangle, triangle[::-1]):  # both sides are visible
            marks = self.draw(frames, marker(Marker.TRIANGLE_LIST, points=corners))
            assert area(marks.triangles) == pytest.approx(0.5)
        text = self.draw(frames, marker(Marker.TEXT_VIEW_FACING, text=" two\nlines "))
        assert text.texts == [(1, 2, "two lines")]

    @pytest.mark.parametrize("kind", [Marker.LINE_LIST, Marker.TRIANGLE_LIST])
    def test_the_number_of_shapes_is_limited(self, frames, kind):
        per_shape = 2 if kind == Marker.LINE_LIST else 3
        corners = [Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)][:per_shape] * 50_001
        marks = self.draw(frames, marker(kind, points=corners))
        assert len(marks.lines) + len(marks.triangles) == 50_000
        assert len(marks.line_colors) + len(marks.triangle_colors) == 50_000

    def test_a_marker_without_a_lifetime_stays(self, frames):
        drawer = MarkerDrawer()
        drawer.receive(marker(Marker.CUBE), 0)
        for now in (0, SECOND, 10**6 * SECOND):
            drawing = drawer.draw(frames, now, again=True)
            assert isinstance(drawing, Marks)
            assert area(drawing.triangles) == pytest.approx(1)

    def test_add_modify_delete_and_delete_all(self, frames):
        drawer = MarkerDrawer()

        def xs() -> list[float]:
            drawing = drawer.draw(frames, 0, again=True)
            assert isinstance(drawing, Marks)
            return sorted(drawing.lines[:, 0].tolist())

        for number in range(3):
            drawer.receive(marker(Marker.SPHERE, number, pose=pose(number)), 0)
        drawer.receive(marker(Marker.SPHERE, 0, ns="other", pose=pose(7)), 0)
        assert xs() == [0, 1, 2, 7]
        drawer.receive(marker(Marker.SPHERE, 1, pose=pose(5)), 0)
        assert xs() == [0, 2, 5, 7]
        drawer.receive(marker(Marker.SPHERE, 0, action=Marker.DELETE), 0)
        assert xs() == [2, 5, 7]
        both = [Marker(action=Marker.DELETEALL), marker(Marker.SPHERE, pose=pose(9))]
        drawer.receive(MarkerArray(markers=both), 0)
        assert xs() == [9]
        drawer.receive(MarkerArray(), 0)
        assert xs() == [9]

    def test_a_lifetime_ends_in_ros_time(self, frames):
        drawer = MarkerDrawer()
        short = marker(Marker.SPHERE, lifetime=genpy.Duration(1, 0))
        drawer.receive(short, 5 * SECOND)
        assert len(drawer.draw(frames, 5 * SECOND, again=False).lines) == 1
        assert drawer.draw(frames, 6 * SECOND, again=False) is None
        assert len(drawer.draw(frames, 6 * SECOND + 1, again=False).lines) == 0
        # A reset of the world sets the time back, after which the marker would remain for long.
        drawer.receive(short, 60 * SECOND)
        assert len(drawer.draw(frames, 60 * SECOND, again=False).lines) == 1
        assert len(drawer.draw(frames, SECOND, again=False).lines) == 0

    def test_markers_of_several_frames(self, frames):
        moved = marker(Marker.SPHERE, 1)
        lost = marker(Marker.SPHERE, 2)
        moved.header.frame_id, lost.header.frame_id = "odom", "lost"
        drawer = MarkerDrawer()
        array = [marker(Marker.SPHERE), moved, lost, marker(Marker.MESH_RESOURCE, 3)]
        array.append(marker(Marker.CUBE, 4, color=ColorRGBA(1, 1, 1, 0)))
        drawer.receive(MarkerArray(markers=array), 0)
        marks = drawer.draw(frames, 0, again=False)
        np.testing.assert_allclose(sorted(marks.lines[:, 0]), (1, 8), atol=1e-6)
        assert drawer.note == (
            '1 marker not shown: mesh; 1 marker not shown: no transform from "lost" to "map"; '
            "1 marker not shown: opacity 0"
        )
        alone = MarkerDrawer()
        alone.receive(lost, 0)
        with pytest.raises(NoTransformError):
            alone.draw(frames, 0, again=False)

    @pytest.mark.parametrize("kind", [*range(10), Marker.TRIANGLE_LIST])
    @pytest.mark.parametrize("number", [math.nan, math.inf, 1e300])
    def test_invalid_numbers_draw_nothing(self, frames, kind, number):
        corners = [Point(number, 0, 0)] * 3
        size = Vector3(number, number, number)
        one = marker(kind, pose=pose(number, 0), points=corners, scale=size, text="x")
        marks = self.draw(frames, one)
        assert (len(marks.lines), len(marks.triangles), len(marks.texts)) == (0, 0, 0)

    def test_the_number_of_markers_is_limited(self, frames, monkeypatch):
        monkeypatch.setattr("flatland.node.foreign_topics.markers.MAX_MARKERS", 20)
        drawer = MarkerDrawer()
        assert drawer.note == ""
        shared = [marker(Marker.SPHERE, number) for number in range(25)]
        drawer.receive(MarkerArray(markers=shared), 0)
        assert len(drawer.draw(frames, 0, again=False).lines) == 20


class TestTrees:
    def test_a_message_becomes_a_tree(self):
        message = stamped(PoseStamped(pose=pose(1.5, 2)))
        message.header.stamp = genpy.Time(3, 500_000_000)
        tree = tree_of(message)
        assert tree["header"] == {"seq": 0, "stamp": 3.5, "frame_id": "map"}
        assert tree["pose"]["position"] == {"x": 1.5, "y": 2, "z": 0}

    def test_long_arrays_and_large_messages_are_shortened(self):
        grid = grid_message(np.zeros((10, 10)))
        assert tree_of(grid)["data"] == [*[0] * 16, "… 100 items"]
        wide = MarkerArray(markers=[marker(Marker.POINTS, points=points(*[(0, 0)] * 99))] * 99)
        tree = tree_of(wide)
        assert len(tree["markers"]) == 17
        assert str(tree).count("'…'") > 0
        assert str(tree).count(": ") < 3 * MAX_VALUES

    def test_values_beyond_the_limit_are_omitted(self):
        values = [[[0] * 10] * 10] * (MAX_VALUES // 100)
        assert tree_of(values) == values
        assert tree_of([*values, [1, 2]]) == [*values, ["…", "…"]]

    def test_numbers_that_are_not_finite_are_texts(self):
        assert tree_of(Point(math.nan, math.inf, 1)) == {"x": "nan", "y": "inf", "z": 1}
