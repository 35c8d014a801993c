"""Invalid arguments of the public functions: the error names the argument and the value found."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from wrong_values import HUGE, INTERNAL, NO_COUNTS, NO_NUMBERS, NO_PATHS, NO_POSES

from flatland import (
    Body,
    DynamicsLimits,
    FlatlandError,
    ModelSpec,
    Timekeeper,
    Twist,
    UpdateTimer,
    World,
)
from flatland.checks import quoted, shown
from flatland.drawing import save
from flatland.physics import PhysicsFixture
from flatland.recording import Replay
from flatland.runtime.batch import step_worlds
from flatland.simulation import Simulation
from flatland.worldgen import generate, maze

TEXT: Final = "{bodies: [{name: b, footprints: []}]}"

Call = Callable[[World, Any], object]


def body_of(world: World) -> Body:
    return world.model("robot").bodies[0]


def fixture_of(world: World) -> PhysicsFixture:
    return body_of(world).fixtures[0]


# By the name in the error.
BODY_NUMBERS: dict[str, Call] = {
    "x": lambda w, v: body_of(w).set_pose(v, 0, 0),
    "theta": lambda w, v: body_of(w).set_pose(0, 0, theta=v),
    "vx": lambda w, v: body_of(w).set_velocity(v, 0, 0),
    "omega": lambda w, v: body_of(w).set_velocity(0, 0, v),
    "torque": lambda w, v: body_of(w).apply_torque(v),
    "factor": lambda w, v: body_of(w).scale_shapes(v),
    "density": lambda w, v: setattr(fixture_of(w), "density", v),
    "friction": lambda w, v: setattr(fixture_of(w), "friction", v),
    "radius": lambda w, v: body_of(w).create_circle((0, 0), v, density=1),
    "restitution": lambda w, v: body_of(w).create_circle((0, 0), 1, density=1, restitution=v),
    "linear_damping": lambda w, v: w.physics.create_body("static", (0, 0, 0), linear_damping=v),
}
# What is named if a number is out of range.
PARTS: Final = {"x": "pose", "theta": "pose angle", "vx": "velocity"}
NO_POINTS: Final = ("ab", None, 5, (1,), (1, "2"), (HUGE, 0), (math.nan, 0), (1j, 0))

# A name for the id, the call, what the error names, and invalid values.
TABLE: list[tuple[str, Call, str, Sequence[Any]]] = [
    ("step", lambda w, v: w.step(v), "n", (*NO_COUNTS, HUGE)),
    ("load path", lambda _, v: World.from_yaml(v), "path", NO_PATHS[1:]),
    ("load seed", lambda w, v: World.from_yaml(w.path, seed=v), "seed", ("a", -1, 1.5, [1], True)),
    (
        "load step_size",
        lambda _, v: World(step_size=v),
        "step_size",
        (*NO_NUMBERS, 0, HUGE, math.nan),
    ),
    ("load params", lambda w, v: World.from_yaml(w.path, params=v), "params", ("a", 5, [1])),
    (
        "load simplify",
        lambda w, v: World.from_yaml(w.path, simplify_map=v),
        "simplify_map",
        (3, "1", True),
    ),
    (
        "load model_path",
        lambda w, v: World.from_yaml(w.path, model_path=v),
        "model_path",
        ("a", 5, [5]),
    ),
    ("plugin_timeout", lambda _, v: World(plugin_timeout=v), "plugin_timeout", ("a", 0, -1, True)),
    ("plugin_errors", lambda _, v: World(plugin_errors=v), "plugin_errors", ("x", None, 5)),
    ("on_invalid_body", lambda _, v: World(on_invalid_body=v), "on_invalid_body", ("x", None, 5)),
    ("observers", lambda _, v: World(observers=v), "observer", ([5], ["x"])),
    (
        "iterations",
        lambda _, v: World(velocity_iterations=v),
        "velocity_iterations",
        (*NO_COUNTS, HUGE),
    ),
    ("reset", lambda w, v: w.reset(v), "seed", (-1, 1.5, "a", True, [1])),
    ("randomize", lambda w, v: w.randomize(v), "seed", NO_COUNTS),
    ("snapshot", lambda w, v: w.snapshot(original=v), "original", (5, "a")),
    ("restore", lambda w, v: w.restore(v), "snapshot", (None, 5)),
    (
        "spawn name",
        lambda w, v: w.spawn_model(TEXT, v),
        "name",
        ("", None, 5, "a\n", "\ud800", ".."),
    ),
    (
        "spawn namespace",
        lambda w, v: w.spawn_model(TEXT, "x", v),
        "namespace",
        (None, 5, "a b", ".."),
    ),
    ("spawn path", lambda w, v: w.spawn_model(v, "x"), "yaml_path", NO_PATHS),
    ("spawn pose", lambda w, v: w.spawn_model(TEXT, "x", "", v), "pose", NO_POSES),
    (
        "spawn if_blocked",
        lambda w, v: w.spawn_model(TEXT, "x", "", (0, 0, 0), v),
        "if_blocked",
        ("a", 5, None),
    ),
    ("spawn models", lambda w, v: w.spawn_models(v), "ModelSpec", ([5], [None], ["x"])),
    ("spawn poses", lambda w, v: w.spawn_models([ModelSpec(TEXT, "x", "", v)]), "pose", NO_POSES),
    ("move pose", lambda w, v: w.move_model("robot", v), "pose", NO_POSES),
    (
        "move name",
        lambda w, v: w.move_model(v, (0, 0, 0)),
        "name",
        (None, [1], "a\0", "x" * 10_000),
    ),
    (
        "move poses",
        lambda w, v: w.move_models(v),
        "pose",
        (None, 5, "ab", [("robot",)], {"robot": (1, 2)}),
    ),
    ("delete names", lambda w, v: w.delete_models(v), "names", (None, 5, [1])),
    (
        "color",
        lambda w, v: w.set_appearance("robot", color=v),
        "color",
        ("red", (1, 2), (HUGE, 0, 0), 5),
    ),
    ("layers", lambda w, v: w.set_appearance("robot", layers=v), "layers", (5, [1])),
    ("map", lambda w, v: w.set_layer_map("walls", v), "source", NO_PATHS),
    ("is_free pose", lambda w, v: w.is_free(v, 0.2), "pose", (*NO_POSES, "ab")),
    (
        "is_free radius",
        lambda w, v: w.is_free((0, 0), v),
        "radius",
        ("3", True, [1], -1, HUGE, math.nan),
    ),
    ("is_free layers", lambda w, v: w.is_free((0, 0), 0.2, layers=v), "layers", (5, None, [1])),
    ("is_free ignore", lambda w, v: w.is_free((0, 0), 0.2, ignore=v), "model", (5, None, [1])),
    ("sample n", lambda w, v: w.sample_free(v, 0.2), "n", (*NO_COUNTS, HUGE)),
    (
        "sample radius",
        lambda w, v: w.sample_free(1, v),
        "radius",
        (*NO_NUMBERS, 0, -1, HUGE, math.nan),
    ),
    (
        "sample clearance",
        lambda w, v: w.sample_free(1, 0.2, v),
        "clearance",
        (*NO_NUMBERS, -1, HUGE),
    ),
    ("sample rng", lambda w, v: w.sample_free(1, 0.2, rng=v), "rng", ("3", -1, 1.5, True)),
    (
        "sample start",
        lambda w, v: w.sample_free(1, 0.2, connected_to=v),
        "connected_to",
        ("ab", 5, (1,)),
    ),
    (
        "sample bounds",
        lambda w, v: w.sample_free(1, 0.2, bounds=v),
        "bounds",
        ("abcd", 5, (0, 0, HUGE, 1)),
    ),
    ("record", lambda w, v: w.record(v), "path", (*NO_PATHS, "a\0b")),
    ("add_observer", lambda w, v: w.add_observer(v), "observer", (None, 5)),
    ("post", lambda w, v: w.post(v), "action", (None, 5)),
    ("between_steps", lambda w, v: w.between_steps(v), "action", (None, 5)),
    ("subscribe", lambda w, v: w.output("/scan").subscribe(v), "callback", (None, 5)),
    ("command", lambda w, v: w.command("/cmd_vel").set(v), "/cmd_vel", (None, 5, "a")),
    ("twist", lambda w, v: w.command("/cmd_vel").set(Twist(v)), "command", ("3", None, [1])),
    ("view port", lambda w, v: w.view(port=v), "port", (*NO_COUNTS, 70_000)),
    ("view height", lambda w, v: w.view(height=v), "height", (*NO_COUNTS, 0)),
    ("view host", lambda w, v: w.view(host=v), "host", (None, 5, "\0")),
    ("view token", lambda w, v: w.view(token=v), "token", (5, "short")),
    (
        "draw size",
        lambda w, v: w.draw(size=v),
        "size",
        (5, "ab", (1,), (1.5, 2), ("5", "5"), (HUGE, 1)),
    ),
    ("draw dpi", lambda w, v: w.draw(dpi=v), "dpi", (*NO_NUMBERS, 1, HUGE, math.nan)),
    (
        "draw view",
        lambda w, v: w.draw(view=v),
        "view",
        (5, "abcd", ("0", "0", "1", "1"), (0, 0, HUGE, 1)),
    ),
    ("draw layers", lambda w, v: w.draw(layers=v), "layers", (5, "walls", [1])),
    ("save", lambda w, v: save(w, v), "path", (*NO_PATHS, "\0.png", "a.bmp")),
    ("Simulation", lambda _, v: Simulation(v), "world", (None, 5)),
    ("update_rate", lambda w, v: Simulation(w, v), "update_rate", (*NO_NUMBERS, -1, math.nan)),
    ("max_lag", lambda w, v: Simulation(w, max_lag=v), "max_lag", (*NO_NUMBERS, -1, math.inf)),
    (
        "report_period",
        lambda w, v: Simulation(w, report_period=v),
        "report_period",
        (*NO_NUMBERS, 0),
    ),
    ("request_steps", lambda w, v: Simulation(w).request_steps(v), "count", (*NO_COUNTS, 0)),
    ("run", lambda w, v: Simulation(w).run(v), "duration", (*NO_NUMBERS, -1, math.nan)),
    ("step_worlds", lambda w, v: step_worlds([w], v), "n", (*NO_COUNTS, HUGE)),
    ("num_threads", lambda w, v: step_worlds([w], 1, v), "num_threads", (*NO_COUNTS, HUGE)),
    ("Timekeeper", lambda _, v: Timekeeper(v), "step_size", (*NO_NUMBERS, 0, HUGE)),
    ("UpdateTimer", lambda _, v: UpdateTimer(v), "rate", (*NO_NUMBERS, -1, math.nan)),
    ("DynamicsLimits", lambda _, v: DynamicsLimits(v), "velocity_limit", (*NO_NUMBERS, -1)),
    (
        "set_pose",
        lambda w, v: w.models[0].set_pose(v, 0, 0),
        "pose",
        ("3", True, None, HUGE, math.nan),
    ),
    *(
        (f"body {name}", call, name, ("3", None, 1j, np.complex128(1j), [1]))
        for name, call in BODY_NUMBERS.items()
    ),
    *(
        (f"body {name} out of range", call, PARTS.get(name, name), (HUGE, -HUGE, math.nan))
        for name, call in BODY_NUMBERS.items()
    ),
    ("body force", lambda w, v: body_of(w).apply_force(v, (0, 0)), "force", NO_POINTS),
    ("body point", lambda w, v: body_of(w).apply_force((0, 0), v), "point", NO_POINTS),
    ("body awake", lambda w, v: setattr(body_of(w), "awake", v), "awake", ("no", [1], 1j)),
    (
        "body material",
        lambda w, v: body_of(w).set_material(v),
        "material",
        ("abc", None, 5, (1, 2), (1, "2", 3), (HUGE, 0, 0)),
    ),
    (
        "fixture is_sensor",
        lambda w, v: setattr(fixture_of(w), "is_sensor", v),
        "is_sensor",
        ("no", [1], 1j),
    ),
    (
        "fixture category_bits",
        lambda w, v: setattr(fixture_of(w), "category_bits", v),
        "category_bits",
        ("1", None, 1.5, -1, 65536, HUGE),
    ),
    (
        "fixture center",
        lambda w, v: body_of(w).create_circle(v, 1, density=1),
        "center",
        (*NO_POINTS, (1, 2, 3)),
    ),
    (
        "joint anchor_a",
        lambda w, v: w.physics.create_weld_joint(body_of(w), w.layers[0].body, v, (0, 0)),
        "anchor_a",
        (*NO_POINTS, (1, 2, 3)),
    ),
    (
        "joint limits",
        lambda w, v: w.physics.create_revolute_joint(
            body_of(w), w.layers[0].body, (0, 0), (0, 0), limits=v
        ),
        "limit",
        ("ab", 5, (1,), (HUGE, 0)),
    ),
    ("worldgen kind", lambda _, v: generate(v, 1), "kind", (None, 5, [1], "castle")),
    ("worldgen seed", lambda _, v: maze(v), "seed", NO_COUNTS),
    ("worldgen size", lambda _, v: maze(1, v), "size", (5, "ab", (10,), (10, "20"), (HUGE, 10))),
    (
        "worldgen resolution",
        lambda _, v: maze(1, resolution=v),
        "resolution",
        (*NO_NUMBERS, 1, HUGE),
    ),
    ("worldgen radius", lambda _, v: maze(1, radius=v), "radius", (*NO_NUMBERS, 5, HUGE)),
    ("Replay", lambda _, v: Replay(v), "path", (*NO_PATHS, "a\0b")),
]


@pytest.fixture(scope="module")
def world(checkout: Path) -> Any:
    with World.from_yaml(checkout / "worlds" / "office" / "world.yaml", seed=1) as world:
        yield world


@pytest.mark.parametrize(
    ("call", "argument", "values"), [r[1:] for r in TABLE], ids=[r[0] for r in TABLE]
)
def test_an_invalid_argument_is_named(
    world: World, call: Call, argument: str, values: Sequence[Any]
) -> None:
    before = world.state_hash()
    for value in values:
        with pytest.raises((ValueError, TypeError, FlatlandError)) as caught:
            call(world, value)
        text = str(caught.value)
        assert argument in text, text
        assert not INTERNAL.search(text), text
        assert len(text) < 400
        assert text.isprintable()
    assert world.state_hash() == before


def test_integers_of_numpy_are_integers(checkout: Path) -> None:
    with World.from_yaml(
        checkout / "worlds" / "simple" / "world.yaml", seed=np.uint32(3), simplify_map=np.int8(0)
    ) as world:
        assert world.seed == 3
        world.step(np.int64(2))
        assert world.time == 0.01
        world.reset(np.int64(5))
        assert world.seed == 5
        world.randomize(np.int32(1))
        assert Simulation(world, np.float32(50)).rate == 50
    assert maze(np.int64(3)).seed == 3


def test_a_value_in_an_error_is_short() -> None:
    for value in ("x" * 1000, 10**5000, [[1]] * 500, np.zeros((30, 30)), "\0\n\ud800"):
        assert len(shown(value)) < 150
        assert len(quoted(value)) < 150
        assert shown(value).isprintable()
        assert quoted(value).isprintable()
