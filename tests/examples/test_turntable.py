"""The example plugin Turntable: rotation on command, its rate, and invalid parameters."""

from __future__ import annotations

import pytest

from flatland import PluginError


def table(parameters):
    """Returns a model that consists of a kinematic disc with a turntable."""
    return f"""
bodies: [{{name: disc, type: kinematic, footprints: [{{type: circle, radius: 1, density: 0}}]}}]
plugins: [{{name: t, type: "my_robots::Turntable", {parameters}}}]
"""


def test_turntable_rotates_while_the_command_is_true(load):
    world = load(table=table("body: disc, speed: -0.5"))
    run, turning = world.command("/run"), world.output("/turning")
    world.step(200)
    assert (world.model("table").pose, turning.latest) == ((0, 0, 0), False)
    run.set(True)
    world.step(400)
    assert world.model("table").pose == pytest.approx((0, 0, -1), abs=1e-5)
    assert turning.latest is True
    run.set(False)
    world.step(400)
    assert world.model("table").pose == pytest.approx((0, 0, -1), abs=1e-5)
    assert turning.latest is False


def test_turntable_publishes_at_its_rate(load):
    world = load(table=table("body: disc, update_rate: 4"))
    messages = []
    world.ports.outputs["/turning"].subscribe(messages.append)
    world.step(400)
    assert messages == [False] * 8


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ("speed: 1", 'Entry "body" does not exist'),
        ("body: leg", 'Body with name "leg" does not exist'),
        ("body: disc, speed: .inf", 'Invalid "speed"'),
        ("body: disc, update_rate: -1", 'Invalid "update_rate"'),
        ("body: disc, sped: 1", 'contains unrecognized entry(s) {"sped"}'),
    ],
)
def test_turntable_rejects_invalid_parameters(load, parameters, text):
    with pytest.raises(PluginError) as caught:
        load(table=table(parameters))
    assert text in str(caught.value)
