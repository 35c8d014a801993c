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
from flatland.srv import DeleteModel, DirectPeople, RemovePeople, SpawnPeople

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


def test_markers_show_bodies_and_names(ros: Any) -> None:
    people_topic, topic = states(ros), ros.topic("/people/markers", MarkerArray)
    ros.wait_until_ready("/people/states", "/people/markers")
    ros.step(0.2)
    people, (first, *others) = people_topic.next(), topic.next().markers
    assert first.action == Marker.DELETEALL
    shown = {(marker.ns, marker.id): marker for marker in others}
    bodies = shown["people", 0]
    assert (bodies.type, bodies.header.frame_id) == (Marker.SPHERE_LIST, "map")
    assert (bodies.scale.x, bodies.scale.z) == (0.4, 1.7)
    assert [(point.x, point.y) for point in bodies.points] == [
        pytest.approx((pose.x, pose.y), abs=0.5) for pose in people.pose
    ]
    names = [marker.text for (space, _), marker in shown.items() if space == "names"]
    assert sorted(names) == sorted(people.name)
