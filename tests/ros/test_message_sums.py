"""MD5 sums of the messages and services, which identify types in ROS.

The expected sums are computed from lists of fields by the rules of ROS: one field per line, without
comments and with single spaces; a field of another message type is replaced by the sum of that type
and the name of the field, without brackets; a service is the text of its request followed by that
of its response.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
from pathlib import Path

import pytest
import rosmsg

# Including the types of `std_msgs`, `geometry_msgs` and `nav_msgs` that are used.
FIELDS = {
    "Header": "uint32 seq, time stamp, string frame_id",
    "Pose2D": "float64 x, float64 y, float64 theta",
    "Vector3": "float64 x, float64 y, float64 z",
    "Twist": "Vector3 linear, Vector3 angular",
    "Point": "float64 x, float64 y, float64 z",
    "Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "Pose": "Point position, Quaternion orientation",
    "MapMetaData": "time map_load_time, float32 resolution, uint32 width, uint32 height, "
    "Pose origin",
    "OccupancyGrid": "Header header, MapMetaData info, int8[] data",
    "Vector2": "float64 x, float64 y",
    "Collision": "string entity_A, string body_A, string entity_B, string body_B, "
    "float64[] magnitude_forces, Vector2[] contact_positions, Vector2[] contact_normals",
    "Collisions": "Header header, Collision[] collisions",
    "DebugTopicList": "string[] topics",
    "ModelPose": "string name, Pose2D pose",
    "ModelSpec": "string yaml_path, string name, string ns, Pose2D pose",
    "ModelStates": "Header header, string[] name, string[] ns, Pose2D[] pose, Twist[] twist",
    "PeopleStates": "Header header, string[] name, string[] group, Pose2D[] pose, Twist[] twist, "
    "bool[] standing",
    "SemanticLabel": "string name, string body, string[] layers, string class_name",
    "SemanticScan": "Header header, float32 angle_min, float32 angle_max, float32 angle_increment, "
    "float32 range_min, float32 range_max, float32[] ranges, uint32[] labels, "
    "SemanticLabel[] table",
}
ANSWER = "bool success, string message"
MANY = f"{ANSWER}, int32 index"
# Request and response; constants precede the fields.
SERVICES = {
    "SpawnModel": (FIELDS["ModelSpec"], ANSWER),
    "DeleteModel": ("string name", ANSWER),
    "MoveModel": (FIELDS["ModelPose"], ANSWER),
    "SpawnModels": ("ModelSpec[] models", f"{MANY}, Pose2D[] poses"),
    "DeleteModels": ("string[] names", MANY),
    "MoveModels": ("ModelPose[] models", f"{MANY}, Pose2D[] poses"),
    "GetModelStates": ("string[] names", f"{ANSWER}, ModelStates states"),
    "ResetWorld": ("bool keep_time, int64 seed", ANSWER),
    "SetAppearance": (
        "int8 KEEP=0, int8 SHOW=1, int8 HIDE=-1, "
        "string model, string body, float64[] color, string[] layers, int8 visible",
        ANSWER,
    ),
    "SetLayerMap": ("string layer, string map_path, OccupancyGrid grid", ANSWER),
    "SetRate": ("float64 update_rate", ANSWER),
    "StepWorld": ("float64 duration", f"{ANSWER}, time stamp"),
    "WaitUntilReady": ("string[] topics, float64 timeout", ANSWER),
    "SpawnPeople": (
        "string group, int32 count, Pose2D[] poses",
        f"{ANSWER}, string[] names",
    ),
    "RemovePeople": ("string[] names", ANSWER),
    "DirectPeople": (
        "uint8 STOP=0, uint8 RESUME=1, uint8 SEND=2, string[] names, uint8 action, Pose2D goal",
        ANSWER,
    ),
}
# Known output of `rosmsg md5` and `rossrv md5` for the `flatland_msgs` of the reference.
OF_THE_REFERENCE = {
    "SpawnModel": "952237af09cbedc354d376afc6d2fc71",
    "DeleteModel": "d82dc6474dd88dad5e1615ab1b2ca74c",
    "MoveModel": "47b5f16cf15e326c7400f4504d3a0f75",
    "DebugTopicList": "b0eef9a05d4e829092fc2f2c3c2aad3d",
}
ROOT = Path(__file__).parents[2]
MESSAGES = tuple(sorted(path.stem for path in (ROOT / "msg").glob("*.msg")))


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
    if name in SERVICES:
        request, response = SERVICES[name]
        return sum_of(text_of(request) + text_of(response))
    return sum_of(text_of(FIELDS[name]))


@pytest.mark.parametrize("name", OF_THE_REFERENCE)
def test_field_lists_have_the_sums_of_the_reference(name: str) -> None:
    assert expected_sum(name) == OF_THE_REFERENCE[name]


@pytest.mark.parametrize("package", ["flatland", "flatland_msgs"])
@pytest.mark.parametrize("name", [*MESSAGES, *SERVICES])
def test_sums_of_the_classes(name: str, package: str) -> None:
    module = importlib.import_module(f"{package}.{'msg' if name in MESSAGES else 'srv'}")
    generated = getattr(module, name)
    assert generated._md5sum == expected_sum(name)
    assert generated._type == f"{package}/{name}"


def test_all_services_have_expected_sums() -> None:
    assert set(SERVICES) == {path.stem for path in (ROOT / "srv").glob("*.srv")}


def test_types_of_fields_are_of_the_package() -> None:
    collisions = importlib.import_module("flatland_msgs.msg").Collisions
    assert collisions._slot_types == ["std_msgs/Header", "flatland_msgs/Collision[]"]


# Those with nested types, types of other packages and constants.
@pytest.mark.parametrize(
    ("tool", "names"),
    [
        ("rosmsg", ("Collisions", "PeopleStates", "SemanticScan")),
        ("rossrv", ("SpawnModel", "GetModelStates", "SetAppearance", "SetLayerMap")),
    ],
    ids=["msg", "srv"],
)
def test_sums_printed_by_the_tools(
    ros_environment: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tool: str,
    names: tuple[str, ...],
) -> None:
    """The tools run in this process, because each start takes longer than the result."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", ros_environment["ROS_PACKAGE_PATH"])
    for name in names:
        monkeypatch.setattr(sys, "argv", [tool, "md5", f"flatland/{name}"])
        rosmsg.rosmsgmain(rosmsg.MODE_MSG if tool == "rosmsg" else rosmsg.MODE_SRV)
        assert capsys.readouterr().out.split() == [expected_sum(name)]
