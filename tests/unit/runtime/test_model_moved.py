"""The hook `model_moved`."""

from __future__ import annotations

from typing import Any

import pytest

import flatland

MODEL = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
  - {name: arm, pose: [1, 0, 0], footprints: [{type: circle, radius: 0.1, density: 1}]}
plugins: [{type: BoolSensor, name: sensor}]
"""


class Moves:
    """Records the arguments of the hook of a plugin and the pose of its model at that time."""

    def __init__(self, plugin: Any) -> None:
        self.calls: list[Any] = []
        self._model = plugin.model
        plugin.model_moved = self._record

    def _record(self, previous: Any, keep_odometry: bool) -> None:
        self.calls.append((previous, keep_odometry, self._model.pose))


@pytest.fixture
def world(files: Any) -> flatland.World:
    world: flatland.World = files.load_model(MODEL)
    return world


@pytest.fixture
def moves(world: flatland.World) -> Moves:
    return Moves(world.model("robot").plugin("sensor"))


@pytest.mark.parametrize(("options", "keep"), [({}, False), ({"keep_odometry": True}, True)])
def test_receives_the_previous_poses_after_the_move(
    world: flatland.World, moves: Moves, options: dict[str, bool], keep: bool
) -> None:
    world.move_model("robot", (3.0, 4.0, 0.5), **options)
    ((previous, kept, pose),) = moves.calls
    assert previous["base"] == pytest.approx((0, 0, 0))
    assert previous["arm"] == pytest.approx((1, 0, 0))
    assert kept is keep
    assert pose == pytest.approx((3.0, 4.0, 0.5))


def test_is_not_called_for_other_models_and_failed_moves(
    world: flatland.World, moves: Moves
) -> None:
    world.spawn_model("robot.model.yaml", "second", pose=(5, 5, 0))
    world.move_model("second", (6, 6, 0))
    with pytest.raises(flatland.WorldError):
        world.move_model("robot", (2e9, 0, 0))
    with pytest.raises(flatland.WorldError):
        world.move_model("robot", (6, 6, 0), if_blocked="refuse")
    assert moves.calls == []


def test_moves_that_it_requests_take_effect_afterwards(world: flatland.World) -> None:
    plugin: Any = world.model("robot").plugin("sensor")
    results = []

    def move_back(_previous: Any, _keep: bool) -> None:
        if len(results) < 1:
            results.append(world.move_model("robot", (0.0, 0.0, 0.0)))

    plugin.model_moved = move_back
    world.move_model("robot", (3.0, 0.0, 0.0))
    assert results == [None]
    world.step()
    assert world.model("robot").pose == pytest.approx((0, 0, 0), abs=1e-6)


@pytest.mark.parametrize("errors", ["raise", "disable"])
def test_an_exception_does_not_prevent_the_move(files: Any, errors: Any) -> None:
    world = files.load_model(MODEL, plugin_errors=errors)
    plugin, calls = world.model("robot").plugin("sensor"), []

    def fail(_previous: Any, _keep: bool) -> None:
        calls.append(1)
        raise RuntimeError("fault")

    plugin.model_moved = fail
    for k in range(1, 6):
        world.move_model("robot", (float(k), 0.0, 0.0))
        assert world.model("robot").pose[0] == pytest.approx(k)
        if errors == "raise":
            with pytest.raises(RuntimeError, match="fault"):
                world.step()
    # The plugin is disabled after the third error in a row.
    assert len(calls) == (5 if errors == "raise" else 3)
