"""Placement: blocked poses with each value of `if_blocked`, and free places."""

from __future__ import annotations

import logging
import math
from typing import Any, ClassVar

import numpy as np
import pytest

import flatland
from flatland import PluginError, WorldError

ROOM = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"
WORLD = """
properties: {}
layers:
  - {name: walls, map: room.yaml}
  - {name: high, map: high.yaml}
models: []
"""
CRATE = """
bodies:
  - name: base
    footprints: [{type: polygon, points: [[-.5, -.5], [.5, -.5], [.5, .5], [-.5, .5]], density: 1,
                  layers: [walls]}]
"""
CART = """
bodies:
  - {name: front, pose: [1, 0, 0], footprints: [{type: circle, radius: 0.2, density: 1}]}
  - {name: rear, footprints: [{type: circle, radius: 0.2, density: 1},
                              {type: circle, radius: 2, density: 0, sensor: true}]}
joints:
  - {name: hitch, type: weld,
     bodies: [{name: front, anchor: [-1, 0]}, {name: rear, anchor: [0, 0]}]}
"""


@pytest.fixture
def world(files: Any) -> flatland.World:
    """A room of 10 m by 10 m in one layer, and a shelf at x = 2 in another layer."""
    files.write("room.dat", ROOM)
    files.write("high.dat", "2 -1 2 1\n")
    for name in ("room", "high"):
        files.write(
            f"{name}.yaml",
            f"{{type: line_segments, data: {name}.dat, scale: 1, origin: [0, 0, 0]}}",
        )
    files.write("crate.model.yaml", CRATE)
    files.write("cart.model.yaml", CART)
    loaded: flatland.World = files.load(WORLD)
    return loaded


def spawn(
    world: flatland.World, file: str, name: str, pose: tuple[float, ...], **options: Any
) -> Any:
    return world.spawn_model(f"{file}.model.yaml", name, pose=pose, **options)


def warnings_of(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]


# -- if_blocked ---------------------------------------------------------------------------------


def test_warn_is_the_default_and_names_all_overlapped_models_and_layers(
    world: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    spawn(world, "minimal", "first", (4.5, 0, 0))
    assert warnings_of(caplog) == []
    model = spawn(world, "minimal", "second", (4.84, 0.1, 0.5))
    text = 'model "second" overlaps layer "walls", model "first" at '
    assert warnings_of(caplog) == [text + "(4.840, 0.100, 0.500)"]
    assert model.pose == pytest.approx((4.84, 0.1, 0.5))
    assert world.move_model("second", (4.81, 0.0, 0.0)) is model
    assert warnings_of(caplog)[1:] == [text + "(4.810, 0.000, 0.000)"]
    assert model.pose == pytest.approx((4.81, 0.0, 0.0))
    assert model.displacement == (0.0, 0.0)
    caplog.clear()
    spawn(world, "minimal", "third", (5, 0, 0), if_blocked="allow")
    world.move_model("third", (-5, 0, 0), if_blocked="allow")
    assert world.model("third").pose == pytest.approx((-5, 0, 0))
    assert warnings_of(caplog) == []


def test_the_overlap_of_a_model_is_a_text(world: flatland.World) -> None:
    spawn(world, "crate", "crate", (0, 0, 0))
    assert world.describe_overlap("crate") == ""
    world.move_model("crate", (4.8, 0, 0), if_blocked="allow")
    assert world.describe_overlap("crate") == 'overlaps layer "walls" at (4.800, 0.000, 0.000)'
    with pytest.raises(WorldError, match="does not exist"):
        world.describe_overlap("nothing")


def test_an_unknown_choice_is_refused_before_anything_changes(world: flatland.World) -> None:
    with pytest.raises(ValueError, match=r"if_blocked must be one of .*, got 'maybe'"):
        spawn(world, "minimal", "m", (0, 0, 0), if_blocked="maybe")
    assert world.models == []
    spawn(world, "minimal", "m", (0, 0, 0))
    with pytest.raises(ValueError, match=r"if_blocked must be one of .*, got 'maybe'"):
        world.move_model("m", (1, 0, 0), if_blocked="maybe")
    assert world.model("m").pose == (0.0, 0.0, 0.0)


def test_refuse_leaves_the_world_unchanged(world: flatland.World) -> None:
    first = spawn(world, "minimal", "first", (1, 0, 0), if_blocked="refuse")
    first.bodies[0].set_velocity(0.1, 0.2, 0.3)
    fixtures = len(world.physics.contacts())
    with pytest.raises(WorldError) as error:
        spawn(world, "minimal", "second", (1.3, 0, 0), if_blocked="refuse")
    assert str(error.value) == (
        'Flatland World: failed to spawn model "second", it overlaps model "first" at '
        "(1.300, 0.000, 0.000)"
    )
    assert world.models == [first]
    assert len(world.physics.contacts()) == fixtures
    with pytest.raises(WorldError, match='failed to move model "first", it overlaps layer "walls"'):
        world.move_model("first", (1, 4.9, 0), if_blocked="refuse")
    assert first.pose == pytest.approx((1, 0, 0))
    assert first.bodies[0].velocity == pytest.approx((0.1, 0.2, 0.3))
    # The new pose overlaps only the previous pose of the model itself.
    world.move_model("first", (1.1, 0, 0), if_blocked="refuse")
    assert first.pose == pytest.approx((1.1, 0, 0))


def test_a_failed_spawn_logs_no_warning_and_a_refused_one_starts_no_plugin(
    world: flatland.World, files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    files.write("bad.model.yaml", CRATE + "plugins: [{name: p, type: Missing}]\n")
    with pytest.raises(PluginError):
        spawn(world, "bad", "m", (5, 0, 0))
    assert warnings_of(caplog) == []
    with pytest.raises(WorldError, match="it overlaps"):
        spawn(world, "bad", "m", (5, 0, 0), if_blocked="refuse")
    assert world.models == []


@pytest.mark.parametrize(
    ("requested", "distance"),
    [
        ((4.9, 1.0, 0.7), 0.1),  # 0.2 from the wall at x = 5, inside
        ((4.9, 4.85, -2.0), math.hypot(0.1, 0.05)),  # both walls of the corner
        ((5.1, 0.0, 0.0), 0.1),  # the outside is closer
    ],
)
def test_nearest_to_walls(
    world: flatland.World, requested: tuple[float, float, float], distance: float
) -> None:
    model = spawn(world, "minimal", "m", requested, if_blocked="nearest")
    assert model.pose[2] == pytest.approx(requested[2])
    assert math.dist(model.pose[:2], requested[:2]) == pytest.approx(distance, abs=0.006)
    assert model.displacement == pytest.approx(
        (model.pose[0] - requested[0], model.pose[1] - requested[1]), abs=1e-6
    )
    assert world.is_free(model.pose, model=model)
    world.move_model("m", (0, 0, 0), if_blocked="nearest")
    assert model.pose == pytest.approx((0, 0, 0))
    assert model.displacement == (0.0, 0.0)
    world.move_model("m", requested, if_blocked="nearest")
    assert math.hypot(*model.displacement) == pytest.approx(distance, abs=0.006)


def test_nearest_moves_all_bodies(world: flatland.World) -> None:
    """The rear body is blocked, while the pose of the model is that of the front body."""
    model = spawn(world, "cart", "m", (-4.9, 0, 0), if_blocked="nearest")
    front, rear = model.body("front").pose, model.body("rear").pose
    assert rear == pytest.approx((-4.8, 0, 0), abs=0.006)
    assert front == pytest.approx((rear[0] + 1, rear[1], 0), abs=1e-5)
    assert model.displacement == pytest.approx((0.1, 0), abs=0.006)


def test_nearest_raises_without_a_free_place(world: flatland.World, files: Any) -> None:
    """A disc larger than the room overlaps the walls at all places within 5 m of the middle."""
    files.write(
        "giant.model.yaml",
        "bodies: [{name: b, footprints: [{type: circle, radius: 5.5, density: 1}]}]",
    )
    with pytest.raises(WorldError) as error:
        spawn(world, "giant", "m", (0, 0, 0), if_blocked="nearest")
    assert str(error.value) == (
        'Flatland World: failed to spawn model "m", it overlaps layer "walls", layer "high" at '
        "(0.000, 0.000, 0.000), and no place within 5 m is free"
    )
    assert world.models == []


def test_touching_is_not_blocked(world: flatland.World, caplog: pytest.LogCaptureFixture) -> None:
    """A row of crates from wall to wall, and two adjacent crates."""
    for i in range(10):
        spawn(world, "crate", f"c{i}", (-4.5 + i, -4.5, 0))
    spawn(world, "crate", "top", (0.3, -3.5, math.pi / 2))
    spawn(world, "crate", "sunk", (3.0, -3.504, 0))  # by less than 5 mm
    assert warnings_of(caplog) == []
    spawn(world, "crate", "deep", (-3.0, -3.506, 0))
    assert len(warnings_of(caplog)) == 1


def test_layers_and_sensors_are_treated_as_in_the_physics(world: flatland.World) -> None:
    """The crate is only in the layer of the walls; the sensor of the cart reaches a wall."""
    spawn(world, "crate", "c", (2, 0, 0), if_blocked="refuse")
    spawn(world, "cart", "cart", (3.5, 3, math.pi), if_blocked="refuse")
    with pytest.raises(WorldError, match='overlaps layer "high"'):
        spawn(world, "minimal", "m", (2, 0.9, 0), if_blocked="refuse")


def test_bodies_without_a_model_block(world: flatland.World) -> None:
    world.physics.create_body("static", (0, 3, 0)).create_circle((0, 0), 0.5, density=1)
    with pytest.raises(WorldError, match="it overlaps a body without a model at"):
        spawn(world, "minimal", "m", (0, 3, 0), if_blocked="refuse")


def test_a_refused_request_of_a_hook_logs_one_error(
    world: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    spawn(world, "minimal", "m", (0, 0, 0))

    class MoveOnce(flatland.WorldObserver):
        results: ClassVar[list[object]] = []

        def time_advanced(self, sim_time_ns: int) -> None:
            if not self.results:
                assert world.is_free((4, 0), radius=0.2)
                self.results.append(world.move_model("m", (5, 0, 0), if_blocked="refuse"))

    world.add_observer(MoveOnce())
    world.step()
    assert MoveOnce.results == [None]
    assert world.model("m").pose == pytest.approx((0, 0, 0))
    assert ["failed to move" in line for line in warnings_of(caplog)] == [True]


def test_five_overlapped_models_are_named_and_the_others_counted(
    files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    models = ", ".join(f"{{name: m{number}, model: minimal.model.yaml}}" for number in range(40))
    world = files.load(f"properties: {{}}\nlayers: []\nmodels: [{models}]\n")
    texts = warnings_of(caplog)
    assert len(texts) == 39
    assert max(map(len, texts)) < 200
    named = ", ".join(f'model "m{number}"' for number in range(5))
    assert texts[-1].endswith(f"overlaps {named} and 34 more at (0.000, 0.000, 0.000)")
    assert " and 34 more at " in world.describe_overlap("m0")


def test_each_overlapping_model_of_a_world_file_is_logged_once(
    world: flatland.World, files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    models = """
    models:
      - {name: a, model: minimal.model.yaml, pose: [5, 0, 0]}
      - {name: b, model: minimal.model.yaml, pose: [5, 0.1, 0]}
      - {name: c, model: minimal.model.yaml, pose: [0, 0, 0]}
    """
    files.load(WORLD.replace("models: []", "") + models.replace("\n    ", "\n"))
    assert warnings_of(caplog) == [
        'model "a" overlaps layer "walls" at (5.000, 0.000, 0.000)',
        'model "b" overlaps layer "walls", model "a" at (5.000, 0.100, 0.000)',
    ]


# -- is_free ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "options", "free"),
    [
        ((4.69, 0), {"radius": 0.3}, True),
        ((4.704, 0, 2.0), {"radius": 0.3}, True),  # penetrates by less than 5 mm
        ((4.706, 0), {"radius": 0.3}, False),
        ((4.6, 0), {"radius": 0.3, "clearance": 0.05}, True),
        ((4.6, 0), {"radius": 0.3, "clearance": 0.15}, False),
        ((2.0, 0), {"radius": 0.3}, False),
        ((2.0, 0), {"radius": 0.3, "layers": "walls"}, True),
        ((2.0, 0), {"radius": 0.3, "layers": ["high", "walls"]}, False),
        ((4.9, 0), {"radius": 0.3, "layers": ["high"]}, True),
        ((0, 0.5), {"radius": 0.3}, False),  # the model m
        ((0, 0.5), {"radius": 0.3, "ignore": "m"}, True),
        ((0, 0.5), {"radius": 0.3, "ignore": ["m", "n"]}, True),
        ((0, 0.5), {"radius": 0.3, "ignore": ["n"]}, False),
        ((0, 0.1, 0), {"model": "m"}, True),
        ((0, 3.1, 0), {"model": "m"}, False),
        ((0, 3.1, 0), {"model": "m", "ignore": "n"}, True),
        ((0, 2.5, 0), {"model": "m"}, True),
        ((0, 2.5, 0), {"model": "m", "clearance": 0.2}, False),
        ((9, 9), {"radius": 0.3}, True),
    ],
)
def test_is_free(
    world: flatland.World, pose: tuple[float, ...], options: dict[str, Any], free: bool
) -> None:
    spawn(world, "minimal", "m", (0, 0.3, 0))
    spawn(world, "minimal", "n", (0, 3, 0))
    assert world.is_free(pose, **options) is free
    if isinstance(options.get("model"), str):
        options = {**options, "model": world.model(options["model"])}
        assert world.is_free(pose, **options) is free


# -- sample_free --------------------------------------------------------------------------------


def check_samples(
    world: flatland.World, poses: Any, n: int, radius: float, clearance: float
) -> None:
    assert poses.shape == (n, 3)
    assert poses.dtype == np.float64
    assert (np.abs(poses[:, 2]) <= math.pi).all()
    for index, (x, y, _) in enumerate(poses):
        assert world.is_free((x, y), radius, clearance=clearance + 0.005 - 1e-4)
        for other in poses[:index]:
            assert math.dist((x, y), other[:2]) >= 2 * radius + clearance - 1e-9


def test_samples_are_free_separate_and_repeatable(world: flatland.World) -> None:
    spawn(world, "crate", "c", (0, 0, 0.5))
    poses = world.sample_free(60, 0.3, 0.1, np.random.default_rng(5))
    check_samples(world, poses, 60, 0.3, 0.1)
    assert np.abs(poses[:, :2]).max() <= 5 - 0.4 + 1e-4
    assert len(np.unique(np.sign(poses[:, :2]), axis=0)) == 4  # in all quadrants of the room
    assert np.array_equal(poses, world.sample_free(60, 0.3, 0.1, np.random.default_rng(5)))
    assert np.array_equal(poses, world.sample_free(60, 0.3, 0.1, 5))
    assert not np.array_equal(poses, world.sample_free(60, 0.3, 0.1, 6))


def test_the_default_generator_depends_on_the_seed_of_the_world(
    world: flatland.World, files: Any
) -> None:
    first, second = (world.sample_free(5, 0.3) for _ in range(2))
    assert not np.array_equal(first, second)
    again = files.load(WORLD)
    assert np.array_equal(first, again.sample_free(5, 0.3))
    other = files.load(WORLD, seed=2)
    assert not np.array_equal(first, other.sample_free(5, 0.3))


def test_samples_are_equal_after_a_reset(world: flatland.World) -> None:
    before = world.sample_free(5, 0.3, rng=1, connected_to=(1, 1))
    world.reset()
    assert np.array_equal(before, world.sample_free(5, 0.3, rng=1, connected_to=(1, 1)))


def test_spawning_at_samples_logs_no_warning(
    world: flatland.World, caplog: pytest.LogCaptureFixture
) -> None:
    for index, pose in enumerate(world.sample_free(40, 0.2, rng=3)):
        spawn(world, "minimal", f"m{index}", tuple(pose), if_blocked="refuse")
    assert warnings_of(caplog) == []
    check_samples(world, world.sample_free(10, 0.2, rng=4), 10, 0.2, 0.0)
    ignoring = world.sample_free(500, 0.05, rng=4, ignore=world.models)
    assert not all(world.is_free(pose, 0.05) for pose in ignoring)


def test_samples_in_bounds_and_layers(world: flatland.World) -> None:
    poses = world.sample_free(9, 0.1, 0.0, 1, bounds=(1.5, -0.5, 2.5, 0.5))
    assert (poses[:, :2] >= (1.5, -0.5)).all()
    assert (poses[:, :2] <= (2.5, 0.5)).all()
    assert (np.abs(poses[:, 0] - 2) >= 0.1 - 1e-6).all()
    through = world.sample_free(9, 0.1, 0.0, 1, bounds=(1.5, -0.5, 2.5, 0.5), layers="walls")
    assert (np.abs(through[:, 0] - 2) < 0.1).any()


def test_walls_that_are_added_later_are_respected(world: flatland.World) -> None:
    """A wall at x = 0 divides the room, and the cached free space is not used."""
    before = world.sample_free(40, 0.3, 0.0, 1, connected_to=(-3, 0))
    assert (before[:, 0] > 0).any()
    world.layer("walls").add_edges(np.array([[0, -5, 0, 5]], np.float32))
    after = world.sample_free(40, 0.3, 0.0, 1, connected_to=(-3, 0))
    assert (after[:, 0] <= -0.3 + 1e-4).all()
    assert (world.sample_free(40, 0.3, 0.0, 1)[:, 0] > 0).any()


def test_moved_walls_are_respected(world: flatland.World) -> None:
    world.layer("walls").body.set_pose(20, 0, math.pi / 4)
    poses = world.sample_free(20, 0.3, 0.0, 1, connected_to=(20, 0))
    assert np.abs(poses[:, 0] - 20).max() <= 5 * math.sqrt(2)
    check_samples(world, poses, 20, 0.3, 0.0)
    x, y = poses[:, 0] - 20, poses[:, 1]
    assert max(np.abs(x + y).max(), np.abs(x - y).max()) <= (5 - 0.3) * math.sqrt(2) + 1e-4


def test_too_few_free_places_raise(world: flatland.World) -> None:
    with pytest.raises(
        WorldError, match=r"found only [1-9] of 20 free places for discs of radius 2 m"
    ):
        world.sample_free(20, 2.0, rng=1)
    with pytest.raises(WorldError, match="found only 0 of 1 free places"):
        world.sample_free(1, 5.1, rng=1)
    with pytest.raises(WorldError, match=r"found only 0 of 1 .* connected to \(4, 4\)"):
        world.sample_free(1, 0.3, 4.8, rng=1, connected_to=(4, 4))
    assert world.sample_free(0, 1.0, rng=1).shape == (0, 3)


def test_a_place_that_just_fits_is_found(world: flatland.World) -> None:
    """With a radius of 4.98 m, a square of 4 cm in the middle of the room is free."""
    poses = world.sample_free(1, 4.98, rng=1, layers="walls")
    assert np.abs(poses[0, :2]).max() <= 0.0201


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda w: w.is_free((0, 0)), ValueError, "requires either a radius or a model"),
        (lambda w: w.is_free((0, 0), 1, model="m"), ValueError, "requires either a radius or a"),
        (lambda w: w.is_free((0, math.nan), 1), ValueError, "pose must be finite"),
        (lambda w: w.is_free((0, 1, 2, 3), 1), ValueError, "pose must be three numbers"),
        (lambda w: w.is_free((0, 0), -1), ValueError, "radius must be finite and not negative"),
        (lambda w: w.is_free((0, 0), 1, clearance=math.inf), ValueError, "clearance must be fin"),
        (lambda w: w.is_free((0, 0), model="x"), WorldError, 'model with name "x" does not exist'),
        (lambda w: w.is_free((0, 0), 1, ignore="x"), WorldError, 'model with name "x" does not'),
        (lambda w: w.is_free((0, 0), 1, layers="x"), WorldError, 'layer with name "x" does not'),
        (lambda w: w.sample_free(-1, 0.3), ValueError, "n must be an integer of at least 0"),
        (lambda w: w.sample_free(1, 0), ValueError, "radius must be positive"),
        (lambda w: w.sample_free(1, math.nan), ValueError, "radius must be positive"),
        (lambda w: w.sample_free(1, 0.3, -0.1), ValueError, "clearance must be finite and not neg"),
        (lambda w: w.sample_free(1, 0.3, bounds=(0, 0, 0, 1)), ValueError, "bounds must be"),
        (lambda w: w.sample_free(1, 0.3, connected_to=(0, math.inf)), ValueError, "two finite"),
    ],
)
def test_invalid_arguments_raise(
    world: flatland.World, call: Any, error: type[Exception], text: str
) -> None:
    spawn(world, "minimal", "m", (0, 0, 0))
    with pytest.raises(error, match=text):
        call(world)


def test_a_world_without_walls_requires_bounds(empty_world: flatland.World) -> None:
    with pytest.raises(WorldError, match="the layers have no walls; bounds are required"):
        empty_world.sample_free(3, 0.3)
    poses = empty_world.sample_free(9, 0.3, 0.0, 1, bounds=(-2, 3, 2, 5), connected_to=(0, 4))
    check_samples(empty_world, poses, 9, 0.3, 0.0)
