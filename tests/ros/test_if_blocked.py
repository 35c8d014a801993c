"""`~if_blocked` in the real node: responses of spawn_model and move_model at blocked poses."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty
from visualization_msgs.msg import InteractiveMarkerFeedback

# Kinematic, so that other bodies do not push it away from where it was put.
POST = """
bodies: [{name: base, type: kinematic, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base, pub_rate: 50}]
"""
SPAWN = 'model "second" overlaps model "first" at (3.100, 3.000, 0.500)'
MOVE = 'model "second" overlaps model "first" at (2.700, 3.000, 0.000)'


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world("[{name: first, model: ball.model.yaml, pose: [3, 3, 0]}]", post=POST)


def place(ros: Any, topic: str = "/second/odometry/ground_truth") -> tuple[float, float]:
    """Returns the position of a model in a paused world, which publishes in the next step."""
    odometry = ros.topic(topic, Odometry)
    ros.call("/resume", Empty)
    point = odometry.next().pose.pose.position
    return (point.x, point.y)


@pytest.mark.parametrize("choice", [None, "allow", "warn"])
def test_the_model_is_put_at_a_blocked_pose(
    launcher: Any, ros: Any, world: Path, choice: str | None
) -> None:
    parameters = {} if choice is None else {"if_blocked": choice}
    server = launcher.server(world, **parameters)
    ros.call("/pause", Empty)
    answer = ros.spawn("post.model.yaml", "second", "second", (3.1, 3, 0.5))
    assert (answer.success, answer.message) == (True, "")
    assert place(ros) == pytest.approx((3.1, 3), abs=1e-4)
    ros.call("/pause", Empty)
    assert ros.move("first", (3, 3, 0)).success  # It was pushed away.
    answer = ros.move("second", (2.7, 3, 0))
    assert (answer.success, answer.message) == (True, "")
    assert ros.move("second", (0, 0, 0)).success
    assert server.stop() == 0
    found = [line for line in server.lines if 'model "second" overlaps' in line]
    if choice == "allow":
        assert "overlaps" not in server.output
    else:
        assert len(found) == 2
        assert "[WARN]" in found[0]
        assert SPAWN in found[0]
        assert MOVE in found[1]


def test_refused_models_are_not_placed(launcher: Any, ros: Any, world: Path) -> None:
    launcher.server(world, if_blocked="refuse")
    before = ros.registered()
    answer = ros.spawn("post.model.yaml", "second", "second", (3.1, 3, 0.5))
    assert (answer.success, answer.message) == (
        False,
        "Flatland World: failed to spawn "
        + SPAWN.replace('"second" overlaps', '"second", it overlaps'),
    )
    assert ros.registered() == before
    assert ros.spawn("post.model.yaml", "second", "second", (1, 1, 0)).success
    answer = ros.move("second", (2.7, 3, 0))
    assert (answer.success, answer.message) == (
        False,
        "Flatland World: failed to move "
        + MOVE.replace('"second" overlaps', '"second", it overlaps'),
    )
    assert place(ros) == pytest.approx((1, 1), abs=1e-4)


def test_nearest_reports_the_chosen_pose(launcher: Any, ros: Any, world: Path) -> None:
    launcher.server(world, if_blocked="nearest")
    ros.call("/pause", Empty)
    answer = ros.spawn("post.model.yaml", "second", "second", (3.1, 3, 0.5))
    assert answer.success is True
    # Two discs of radius 0.2 m, at first 0.1 m apart, must be 0.4 m apart.
    x, y = place(ros)
    assert math.dist((x, y), (3.1, 3)) == pytest.approx(0.3, abs=0.006)
    assert math.dist((x, y), (3, 3)) == pytest.approx(0.4, abs=0.006)
    away = math.dist((x, y), (3.1, 3))
    assert answer.message == (
        'the requested pose is blocked: model "second" was put at '
        f"({x:.3f}, {y:.3f}, 0.500), {away:.3f} m away"
    )
    answer = ros.move("first", (4.9, 0, 0))
    assert answer.success is True
    assert 'model "first" was put at (4.800, 0.000, 0.000), 0.100 m away' in answer.message
    answer = ros.move("second", (0, 0, 0))
    assert (answer.success, answer.message) == (True, "")


def test_nearest_without_a_free_pose(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    giant = "bodies: [{name: b, footprints: [{type: circle, radius: 5.5, density: 1}]}]"
    launcher.server(write_world(giant=giant), if_blocked="nearest")
    answer = ros.spawn("giant.model.yaml", "giant")
    assert (answer.success, answer.message) == (
        False,
        'Flatland World: failed to spawn model "giant", it overlaps layer "2d" at '
        "(0.000, 0.000, 0.000), and no place within 5 m is free",
    )
    assert not ros.delete("giant").success


@pytest.mark.parametrize("value", ["stop", "Warn", "1"])
def test_invalid_value_is_fatal(launcher: Any, world: Path, value: str) -> None:
    process = launcher.start(world_path=world, if_blocked=value)
    shown = 1 if value == "1" else value
    process.wait_for_line(
        r'\[FATAL\].*Invalid parameter "~if_blocked": it must be one of allow, warn, refuse, '
        f"nearest, got {shown!r}$"
    )
    assert process.wait() == 1


def test_launch_file_passes_the_value(launcher: Any, ros: Any, world: Path) -> None:
    process = launcher.launch(
        "flatland",
        "server.launch",
        f"world_path:={world}",
        "show_viz:=false",
        "if_blocked:=refuse",
    )
    process.wait_for_line("loaded ")
    assert not ros.spawn("ball.model.yaml", "second", "", (3.1, 3, 0.5)).success


def test_dragging_ignores_if_blocked(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    server = launcher.server(world, if_blocked="refuse")
    feedback = ros.publisher("/interactive_model_markers/feedback", InteractiveMarkerFeedback)
    message = InteractiveMarkerFeedback(
        client_id="test",
        marker_name="robot",
        event_type=InteractiveMarkerFeedback.MOUSE_UP,
        pose=Pose(Point(5, 0, 0), Quaternion(0, 0, 0, 1)),
    )
    message.header.frame_id = "map"
    odometry = ros.topic("/odometry/ground_truth", Odometry)
    feedback.publish(message)
    odometry.until(lambda m: abs(m.pose.pose.position.x - 5) < 0.3)
    assert server.stop() == 0
    assert "overlaps" not in server.output
