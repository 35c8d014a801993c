"""MD5 sums of the messages and services, which identify types in ROS.

A client with another sum cannot connect: a sum changes only with a new version of a message.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest
import rosmsg

MESSAGES = {
    "Collision": "e6959bf91b31e42582e1328efe4e2953",
    "Collisions": "6fa318801c160db40a30b49b9efb9f00",
    "DebugTopicList": "b0eef9a05d4e829092fc2f2c3c2aad3d",
    "ModelPose": "aae4d25923daba9de87a1ff045b66b7d",
    "ModelSpec": "80a53491758229753f499a612e2e7065",
    "ModelStates": "f5f2e9fbbf0d026fead656d147f42d2a",
    "PeopleStates": "5f09f38a229a778abb3d2bce0903d60c",
    "SemanticLabel": "241e55b7f027e449230ab22e6b97cbf2",
    "SemanticScan": "576dbcddd6c806c6216a5b411538ff32",
    "Vector2": "209f516d3eb691f0663e25cb750d67c1",
}
SERVICES = {
    "DeleteModel": "d82dc6474dd88dad5e1615ab1b2ca74c",
    "DeleteModels": "e3cefc5532f90de212167b778ea4b368",
    "DirectPeople": "a5ec68cb50efeb20c075ef93180eb69d",
    "GetModelStates": "df49d2546c511438b5e03511155bb423",
    "MoveModel": "47b5f16cf15e326c7400f4504d3a0f75",
    "MoveModels": "51daf59a3d8786481dae543d92727ce2",
    "RemovePeople": "1d75d28f75342da069eaff28c344184c",
    "ResetWorld": "e3eeb02b9beb597cf20200549e61f020",
    "SetAppearance": "1134a23497051857adade45943388bdb",
    "SetLayerMap": "10fb558d5b43a335bf79348187634eee",
    "SetRate": "8d3b8df36543bf83292cb652946f147c",
    "SpawnModel": "952237af09cbedc354d376afc6d2fc71",
    "SpawnModels": "452ce09eb87bf05e5e6343ab3a680d80",
    "SpawnPeople": "1d3a1bf5679bb38bf0edb9f5236f9d8e",
    "StepWorld": "fe278299c3ec18fcdb18a6f4dbc99f5b",
    "WaitUntilReady": "dc223ad52216a3cbb72f601d2892f495",
}
# Known output of `rosmsg md5` and `rossrv md5` for the `flatland_msgs` of the reference.
OF_THE_REFERENCE = {
    "SpawnModel": "952237af09cbedc354d376afc6d2fc71",
    "DeleteModel": "d82dc6474dd88dad5e1615ab1b2ca74c",
    "MoveModel": "47b5f16cf15e326c7400f4504d3a0f75",
    "DebugTopicList": "b0eef9a05d4e829092fc2f2c3c2aad3d",
}
SUMS = MESSAGES | SERVICES
ROOT = Path(__file__).parents[2]


def test_sums_are_those_of_the_reference() -> None:
    assert OF_THE_REFERENCE.items() <= SUMS.items()


@pytest.mark.parametrize("package", ["flatland", "flatland_msgs"])
@pytest.mark.parametrize("name", SUMS)
def test_sums_of_the_classes(name: str, package: str) -> None:
    module = importlib.import_module(f"{package}.{'msg' if name in MESSAGES else 'srv'}")
    generated = getattr(module, name)
    assert generated._md5sum == SUMS[name]
    assert generated._type == f"{package}/{name}"


def test_all_types_have_expected_sums() -> None:
    for kind, names in (("msg", MESSAGES), ("srv", SERVICES)):
        assert set(names) == {path.stem for path in (ROOT / kind).glob(f"*.{kind}")}


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
        assert capsys.readouterr().out.split() == [SUMS[name]]
