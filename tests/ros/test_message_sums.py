"""MD5 sums of the messages and services, which identify types in ROS.

The expected sums are computed from lists of fields by the rules of ROS: one field per line, without
comments and with single spaces; a field of another message type is replaced by the sum of that type
and the name of the field, without brackets; a service is the text of its request followed by that
of its response.
"""

from __future__ import annotations

import hashlib
import importlib
import subprocess

import pytest

# Including the types of `std_msgs` and `geometry_msgs` that are used.
FIELDS = {
    "Header": "uint32 seq, time stamp, string frame_id",
    "Pose2D": "float64 x, float64 y, float64 theta",
    "Vector2": "float64 x, float64 y",
    "Collision": "string entity_A, string body_A, string entity_B, string body_B, "
    "float64[] magnitude_forces, Vector2[] contact_positions, Vector2[] contact_normals",
    "Collisions": "Header header, Collision[] collisions",
    "DebugTopicList": "string[] topics",
    "ModelPose": "string name, Pose2D pose",
    "ModelSpec": "string yaml_path, string name, string ns, Pose2D pose",
}
ANSWER = "bool success, string message"
REQUESTS = {
    "SpawnModel": "string yaml_path, string name, string ns, Pose2D pose",
    "DeleteModel": "string name",
    "MoveModel": "string name, Pose2D pose",
}
# Known output of `rosmsg md5` and `rossrv md5` for the `flatland_msgs` of the reference.
OF_THE_REFERENCE = {
    "SpawnModel": "952237af09cbedc354d376afc6d2fc71",
    "DeleteModel": "d82dc6474dd88dad5e1615ab1b2ca74c",
    "MoveModel": "47b5f16cf15e326c7400f4504d3a0f75",
    "DebugTopicList": "b0eef9a05d4e829092fc2f2c3c2aad3d",
}
MESSAGES = ("Vector2", "Collision", "Collisions", "DebugTopicList", "ModelPose", "ModelSpec")


def text_of(fields: str) -> str:
    lines = []
    for field in fields.split(", "):
        kind, name = field.split(" ")
        bare = kind.removesuffix("[]")
        lines.append(f"{sum_of(text_of(FIELDS[bare]))} {name}" if bare in FIELDS else field)
    return "\n".join(lines)


def sum_of(text: str) -> str:
    return hashlib.md5(text.encode()).hexdigest()


def expected_sum(name: str) -> str:
    if name in REQUESTS:
        return sum_of(text_of(REQUESTS[name]) + text_of(ANSWER))
    return sum_of(text_of(FIELDS[name]))


@pytest.mark.parametrize("name", OF_THE_REFERENCE)
def test_field_lists_have_the_sums_of_the_reference(name: str) -> None:
    assert expected_sum(name) == OF_THE_REFERENCE[name]


@pytest.mark.parametrize("package", ["flatland", "flatland_msgs"])
@pytest.mark.parametrize("name", [*MESSAGES, *REQUESTS])
def test_sums_of_the_classes(name: str, package: str) -> None:
    module = importlib.import_module(f"{package}.{'msg' if name in MESSAGES else 'srv'}")
    generated = getattr(module, name)
    assert generated._md5sum == expected_sum(name)
    assert generated._type == f"{package}/{name}"


def test_types_of_fields_are_of_the_package() -> None:
    collisions = importlib.import_module("flatland_msgs.msg").Collisions
    assert collisions._slot_types == ["std_msgs/Header", "flatland_msgs/Collision[]"]


@pytest.mark.parametrize(
    ("tool", "names"), [("rosmsg", MESSAGES), ("rossrv", tuple(REQUESTS))], ids=["msg", "srv"]
)
def test_sums_printed_by_the_tools(
    ros_environment: dict[str, str], tool: str, names: tuple[str, ...]
) -> None:
    for name in names:
        done = subprocess.run(
            [tool, "md5", f"flatland/{name}"],
            env=ros_environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.split() == [expected_sum(name)], done.stderr
