"""The example plugin ResetPoses, without ROS."""

from __future__ import annotations

import pytest

from flatland import PluginError

RESET = '[{{name: reset, type: "my_robots::ResetPoses"{parameters}}}]'
PLAIN = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"


def test_reset_moves_models_to_their_initial_poses_with_zero_velocities(load):
    world = load(RESET.format(parameters=""), a=PLAIN, b=PLAIN)
    world.move_model("b", (3, 0, 0))
    [plugin] = world.plugins
    assert plugin.reset() == ["a", "b"]
    body = world.model("b").bodies[0]
    body.set_velocity(1, 2, 3)
    world.step(100)
    world.spawn_model("a.yaml", "late", pose=(8, 8, 0))
    world.delete_model("a")
    assert plugin.reset() == ["b"]
    assert (body.pose, body.velocity) == ((0, 0, 0), (0, 0, 0))
    assert world.model("late").pose == (8, 8, 0)


def test_reset_moves_only_the_models_in_the_parameter(load):
    world = load(RESET.format(parameters=", models: [b]"), a=PLAIN, b=PLAIN)
    world.move_model("a", (3, 0, 0))
    world.move_model("b", (3, 3, 0))
    assert world.plugins[0].reset() == ["b"]
    assert [model.pose for model in world.models] == [(3, 0, 0), (0, 0, 0)]


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        (", models: [ghost]", 'Invalid "models", model "ghost" does not exist at the start'),
        (", modells: [a]", 'contains unrecognized entry(s) {"modells"}'),
    ],
)
def test_reset_rejects_invalid_parameters(load, parameters, text):
    with pytest.raises(PluginError) as caught:
        load(RESET.format(parameters=parameters), a=PLAIN)
    assert str(caught.value).startswith(
        'Flatland plugin: World Plugin "reset" type "my_robots::ResetPoses": '
    )
    assert text in str(caught.value)
    assert "world.yaml:" in str(caught.value)
