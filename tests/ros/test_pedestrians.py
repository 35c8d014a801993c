"""People of a running node: topics, markers and services."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose2D, PoseArray
from visualization_msgs.msg import Marker, MarkerArray
from waiting import wait_until

from flatland.msg import PeopleStates
from flatland.srv import DeleteModel, DirectPeople, RemovePeople, ResetWorld, SpawnPeople

GROUPS = (
    "[{name: a, count: 2, area: [-3, -3, -1, 3], waypoints: [{at: [3, 0]}, {at: [-3, 0]}]},"
    " {name: b, count: 0, area: [-3, -3, 3, 3], waypoints: [{at: [0, 3]}]}]"
)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    plugins = f"[{{name: people, type: Pedestrians, groups: {GROUPS}}}]"
    return module_launcher.server(write_world(plugins=plugins), lockstep=True, seed=1)


def step_until(ros: Any, topic: Any, accept: Callable[[Any], bool]) -> Any:
    """Makes steps until a message is accepted, and returns it."""

    def accepted() -> list[Any]:
        ros.step(0.1)
        return [message for message in topic.rest(0) if accept(message)]

    return wait_until(f"a message on {topic.name}", accepted)[0]


def states(ros: Any) -> Any:
    return ros.topic("/people/states", PeopleStates)


def test_the_topics_carry_the_same_people(ros: Any) -> None:
    topic, poses_topic = states(ros), ros.topic("/people", PoseArray)
    ros.wait_until_ready("/people/states", "/people")
    ros.step(0.1)
    people, poses = topic.next(), poses_topic.next()
    assert people.name == ["a_0", "a_1"]
    assert people.group == ["a", "a"]
    assert people.header.frame_id == "map"
    assert poses.header == people.header
    assert [(pose.position.x, pose.position.y) for pose in poses.poses] == [
        (pose.x, pose.y) for pose in people.pose
    ]
    assert len(people.twist) == len(people.standing) == 2
    step_until(ros, topic, lambda moving: moving.twist[0].linear.x > 0.3)


def test_people_are_spawned_directed_and_removed(ros: Any) -> None:
    answer = ros.call("/spawn_people", SpawnPeople, "b", 0, [Pose2D(0, 0, 0), Pose2D(1, 1, 0)])
    assert (answer.success, answer.names) == (True, ["b_0", "b_1"])
    more = ros.call("/spawn_people", SpawnPeople, "b", 1, [])
    assert (more.success, more.names) == (True, ["b_2"])
    goal = Pose2D(2, -2, 0)
    sent = ros.call("/direct_people", DirectPeople, ["b_0"], DirectPeople._request_class.SEND, goal)
    assert (sent.success, sent.message) == (True, "")

    def has_arrived(people: Any) -> bool:
        pose = people.pose[people.name.index("b_0")]
        return math.hypot(pose.x - 2, pose.y + 2) < 0.4

    topic = states(ros)
    step_until(ros, topic, has_arrived)
    assert ros.call("/delete_model", DeleteModel, "b_1").success
    removed = ros.call("/remove_people", RemovePeople, ["b_0", "b_2"])
    assert (removed.success, removed.message) == (True, "")
    step_until(ros, topic, lambda people: people.name == ["a_0", "a_1"])


def test_markers_show_bodies_velocities_and_names(ros: Any) -> None:
    answer = ros.call("/spawn_people", SpawnPeople, "b", 0, [Pose2D(0, -2, 0), Pose2D(1, -2, 0)])
    assert answer.success
    people_topic, topic = states(ros), ros.topic("/people/markers", MarkerArray)
    ros.wait_until_ready("/people/states", "/people/markers")
    ros.step(0.2)
    first = topic.next().markers
    assert first[0].action == Marker.DELETEALL
    shown = {(marker.ns, marker.id): marker for marker in first[1:]}
    assert len(shown) == len(first) - 1
    people = people_topic.next()
    assert [len(shown["people", group].points) for group in (0, 1)] == [2, 2]
    bodies = shown["people", 1]
    assert (bodies.type, bodies.header.frame_id) == (Marker.SPHERE_LIST, "map")
    assert (bodies.scale.x, bodies.scale.z) == (0.4, 1.7)
    assert bodies.points[1].x == pytest.approx(people.pose[3].x, abs=0.5)
    assert bodies.points[1].y == pytest.approx(people.pose[3].y, abs=0.5)
    names = {marker.text: marker for (space, _), marker in shown.items() if space == "names"}
    assert set(names) == set(people.name)
    lines = shown["velocities", 0].points
    assert len(lines) == 8
    step_until(ros, topic, lambda array: _speed_of_first(array) > 0.3)
    assert ros.call("/remove_people", RemovePeople, answer.names).success

    def is_removal(array: Any) -> bool:
        deleted = {(m.ns, m.id) for m in array.markers if m.action == Marker.DELETE}
        return deleted == {("people", 1), *(("names", names[n].id) for n in answer.names)}

    removed = step_until(ros, topic, is_removal)
    assert len([m for m in removed.markers if m.ns == "names" and m.action == Marker.ADD]) == 2
    assert ros.call("/reset_world", ResetWorld, False, -1).success
    step_until(ros, topic, lambda array: array.markers[0].action == Marker.DELETEALL)


def _speed_of_first(array: Any) -> float:
    (lines,) = (marker for marker in array.markers if marker.ns == "velocities")
    start, end = lines.points[:2]
    return math.hypot(end.x - start.x, end.y - start.y)
