"""The messages and services are compatible with existing clients of the reference."""

from __future__ import annotations

import importlib
import importlib.util

import pytest

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("genpy") is None, reason="genpy is not installed"
)

MD5_OF_THE_REFERENCE = {
    "srv.SpawnModel": "952237af09cbedc354d376afc6d2fc71",
    "srv.DeleteModel": "d82dc6474dd88dad5e1615ab1b2ca74c",
    "srv.MoveModel": "47b5f16cf15e326c7400f4504d3a0f75",
    "msg.DebugTopicList": "b0eef9a05d4e829092fc2f2c3c2aad3d",
}

FIELDS = {
    "Vector2": {"x": "float64", "y": "float64"},
    "Collision": {
        "entity_A": "string",
        "body_A": "string",
        "entity_B": "string",
        "body_B": "string",
        "magnitude_forces": "float64[]",
        "contact_positions": "flatland/Vector2[]",
        "contact_normals": "flatland/Vector2[]",
    },
    "Collisions": {"header": "std_msgs/Header", "collisions": "flatland/Collision[]"},
    "DebugTopicList": {"topics": "string[]"},
}


@pytest.mark.parametrize("name", MD5_OF_THE_REFERENCE)
def test_md5_sum_equals_the_reference(name):
    kind, message = name.split(".")
    module = importlib.import_module(f"flatland.{kind}")
    assert getattr(module, message)._md5sum == MD5_OF_THE_REFERENCE[name]


@pytest.mark.parametrize("name", FIELDS)
def test_fields_of_messages(name):
    message = getattr(importlib.import_module("flatland.msg"), name)
    fields = dict(zip(message.__slots__, message._slot_types, strict=True))
    assert fields == FIELDS[name]
    assert list(fields) == list(FIELDS[name])
