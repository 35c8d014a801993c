"""People of a running node: topics, markers and services."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose2D, PoseArray
from waiting import wait_until

from flatland.msg import PeopleStates
from flatland.srv import DeleteModel, DirectPeople, RemovePeople, SpawnPeople

GROUPS = (
    "[{name: a, count: 2, area: [-3, -3, -1, 3], waypoints: [{at: [3, 0]}, {at: [-3, 0]}]},"
    " {name: b, count: 0, area: [-3, -3, 3, 3], waypoints: [{at: [0, 3]}]}]"
)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[]")
    text = world.read_text()
    world.write_text(
        f"{text}\nplugins: [{{name: people, type: Pedestrians, groups: {GROUPS}}}]\n"
    )
    return module_launcher.server(world)


def states(ros: Any) -> Any:
    return ros.topic("/people/states", PeopleStates)


def test_the_topics_carry_the_same_people(ros: Any) -> None:
    people = states(ros)
    assert people.name == ["a_0", "a_1"]
    assert people.group == ["a", "a"]
    assert people.header.frame_id == "map"
    poses = ros.topic("/people", PoseArray)
    assert poses.header.frame_id == "map"
    assert len(poses.poses) == len(people.pose) == len(people.twist) == len(people.standing) == 2
    wait_until(lambda: math.hypot(states(ros).twist[0].linear.x, 0.0) > 0.3)


def test_people_are_spawned_directed_and_removed(ros: Any) -> None:
    answer = ros.call("/spawn_people", SpawnPeople, "b", 0, [Pose2D(0, 0, 0), Pose2D(1, 1, 0)])
    assert (answer.success, answer.names) == (True, ["b_0", "b_1"])
    more = ros.call("/spawn_people", SpawnPeople, "b", 1, [])
    assert (more.success, more.names) == (True, ["b_2"])
    goal = Pose2D(2, -2, 0)
    sent = ros.call("/direct_people", DirectPeople, ["b_0"], DirectPeople._request_class.SEND, goal)
    assert (sent.success, sent.message) == (True, "")

    def has_arrived() -> bool:
        people = states(ros)
        pose = people.pose[people.name.index("b_0")]
        return math.hypot(pose.x - 2, pose.y + 2) < 0.4

    wait_until(has_arrived)
    assert ros.call("/delete_model", DeleteModel, "b_1").success
    removed = ros.call("/remove_people", RemovePeople, ["b_0", "b_2"])
    assert (removed.success, removed.message) == (True, "")
    wait_until(lambda: states(ros).name == ["a_0", "a_1"])


def test_failed_calls_report_a_reason_and_change_nothing(ros: Any) -> None:
    answer = ros.call("/spawn_people", SpawnPeople, "x", 1, [])
    assert not answer.success
    assert 'group "x" does not exist' in answer.message
    answer = ros.call("/spawn_people", SpawnPeople, "a", 0, [Pose2D(math.nan, 0, 0)])
    assert not answer.success
    assert "finite" in answer.message
    answer = ros.call("/remove_people", RemovePeople, ["a_0", "nobody"])
    assert (answer.success, "nobody" in answer.message) == (False, True)
    answer = ros.call("/direct_people", DirectPeople, ["a_0"], 7, Pose2D())
    assert "action must be from 0 to 2" in answer.message
    assert states(ros).name == ["a_0", "a_1"]
