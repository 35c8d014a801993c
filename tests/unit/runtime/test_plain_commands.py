"""Commands from plain values, as in files and options of the command line."""

from __future__ import annotations

from typing import Any

import pytest

from flatland import ModelPlugin, Twist, World
from flatland.errors import FlatlandError
from flatland.runtime.plain_commands import set_command


class Receiver(ModelPlugin):
    """Has commands of several types."""

    def on_initialize(self, config: Any) -> None:
        self.twist = self.command("twist", Twist)
        self.number = self.command("number", float)
        self.count = self.command("count", int)


@pytest.fixture
def world(files: Any, declare_plugins: Any) -> World:
    declare_plugins(Receiver)
    body = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
    files.write(
        "m.yaml", f"{{bodies: [{body}], plugins: [{{type: 'test::Receiver', name: receiver}}]}}"
    )
    return files.load(  # type: ignore[no-any-return]
        "{properties: {}, layers: [], models: [{name: m, model: m.yaml}]}"
    )


@pytest.mark.parametrize(
    ("topic", "value", "expected"),
    [
        ("twist", {"linear_x": 1, "angular_z": -0.5}, Twist(linear_x=1.0, angular_z=-0.5)),
        ("twist", {"linear": {"x": 1}, "angular": {"z": 2}}, Twist(linear_x=1.0, angular_z=2.0)),
        ("twist", {}, Twist()),
        ("number", 2, 2.0),
        ("number", 2.5, 2.5),
        ("count", 3, 3),
    ],
)
def test_values(world: World, topic: str, value: Any, expected: Any) -> None:
    received = getattr(world.model("m").plugin("receiver"), topic)
    set_command(world, f"/{topic}", value)
    world.step()
    assert received.value == expected
    assert type(received.value) is type(expected)


@pytest.mark.parametrize(
    ("topic", "value", "text"),
    [
        ("twist", {"linear": {"w": 1}}, "are the numbers linear_x, .*, got linear_w"),
        ("twist", {"linear_x": "1"}, "are the numbers linear_x, .*, got {'linear_x': '1'}"),
        ("twist", 1.0, "takes Twist"),
        ("number", True, "takes float"),
        ("count", 1.5, "takes int"),
        ("missing", 1, "missing"),
    ],
)
def test_errors(world: World, topic: str, value: Any, text: str) -> None:
    with pytest.raises(FlatlandError, match=text):
        set_command(world, f"/{topic}", value)
