"""The worlds of the reference load unchanged and run for a minute without warnings.

The only exceptions are warnings about models whose initial pose overlaps walls or other models.
"""

from __future__ import annotations

import logging
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import flatland

RATE = 200  # steps in a second of simulated time
DURATION = 20  # s of simulated time
COMMAND_DURATION = 5  # s of simulated time

# By world: the number of values that each output publishes in this time.
WORLDS: dict[str, dict[str, int]] = {
    "benchmark_world": {
        "/odometry/ground_truth": DURATION * RATE,
        "/odometry/filtered": DURATION * RATE,
        "/scan": DURATION * 40,
    },
    "conestogo_office_test": {
        "/odometry/ground_truth": DURATION * RATE,
        "/odometry/filtered": DURATION * RATE,
        "/scan": DURATION * 40,
        "/detector_out": DURATION * 10,
    },
    "simple_test_A": {},
}

# By world: the models whose initial poses overlap walls or other models, by more than 0.2 m each.
OVERLAPS: dict[str, list[str]] = {
    "simple_test_A": [
        'model "turtlebot1" overlaps layer "2d", layer "3d" at (0.000, 0.000, 0.000)',
        'model "turtlebot2" overlaps layer "3d" at (3.000, 4.500, 3.142)',
        'model "chair1" overlaps model "turtlebot2" at (1.200, 3.500, 2.123)',
        'model "person1" overlaps model "turtlebot1" at (0.000, 1.000, 2.000)',
    ],
}


@pytest.fixture
def no_other_warnings(name: str, caplog: pytest.LogCaptureFixture) -> Any:
    """Fails the test if a warning is logged that is not an expected one."""
    caplog.set_level(logging.WARNING)
    yield
    messages = [record.getMessage() for record in caplog.get_records("call")]
    # Models that overlap walls or each other initially can be jammed.
    jams = [text for text in messages if "is jammed between walls" in text]
    assert all(re.match(r'model "(spawned\d+|turtlebot2)" is jammed', text) for text in jams)
    assert [text for text in messages if text not in jams] == OVERLAPS.get(name, [])


def test_all_worlds_are_tested(shared_dir: Path) -> None:
    assert {path.parent.name for path in (shared_dir / "worlds").rglob("world.yaml")} == set(WORLDS)


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.usefixtures("no_other_warnings")
def test_a_world_publishes_and_moves(shared_dir: Path, name: str) -> None:
    path = shared_dir / "worlds" / name / "world.yaml"
    counts: Counter[str] = Counter()
    with flatland.World.from_yaml(path, seed=1) as world:
        for topic in world.ports.outputs:
            world.output(topic).subscribe(lambda _value, topic=topic: counts.update([topic]))
        start = {model.name: model.pose for model in world.models}
        # Curves to both sides, partly into walls.
        for i in range(0, DURATION, COMMAND_DURATION):
            for topic in world.ports.commands:
                world.command(topic).set(flatland.Twist(0.8, 0.0, 0.4 * (-1) ** i))
            world.step(COMMAND_DURATION * RATE)
            for model in world.models:
                for body in model.bodies:
                    assert all(map(math.isfinite, (*body.pose, *body.velocity))), body.name
        assert world.time == pytest.approx(DURATION)
        assert counts == WORLDS[name]
        if world.ports.commands:
            moved = math.dist(world.model("cleaner1").pose[:2], start["cleaner1"][:2])
            assert moved > 1


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.usefixtures("no_other_warnings")
def test_all_models_of_a_world_can_be_spawned(shared_dir: Path, name: str) -> None:
    folder = shared_dir / "worlds" / name
    with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
        files = sorted(folder.glob("*.model.yaml"))
        assert files
        for i, path in enumerate(files):
            pose = (1.0, 2.0, 0.5)
            world.spawn_model(path.name, f"spawned{i}", f"s{i}", pose, if_blocked="allow")
        for topic in world.ports.outputs:
            world.output(topic)
        world.step(RATE)
        assert all(world.output(topic).latest is not None for topic in world.ports.outputs)
