"""Invalid arguments of environments and their parts: the error names the argument and the value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import numpy as np
import pytest
from wrong_values import HUGE, INTERNAL, NO_COUNTS, NO_NUMBERS

import flatland.gym as fg
from flatland import FlatlandError
from flatland.gym.controllers import Gap
from flatland.gym.policies import Policy, PolicyRobot

Call = Callable[[Any, Any], object]

PAIRS: Final = (5, None, "ab", (1,), ("0", "1"), (2, 1), (0, HUGE), (math.nan, 1))
ENV: Final = fg.FlatlandEnv

# The environment `e` is one, and `v` two environments of the autoreset mode SAME_STEP.
PARTS: list[tuple[str, Callable[[Any], object], str, Sequence[Any]]] = [
    ("sectors", fg.Scan, "sectors", ("a", -1, 0, 1.5, True, [1])),
    ("half", lambda v: fg.Scan(half=v), "half", ("a", 0, -1, math.nan, HUGE, [1])),
    ("scale", fg.Goal, "scale", (*NO_NUMBERS, 0, math.nan)),
    ("sideways", fg.Velocity, "sideways", ("yes", 1, None)),
    ("numbers", fg.LastAction, "numbers", (*NO_COUNTS, 4)),
    ("cells", fg.Costmap, "cells", (*NO_COUNTS, HUGE)),
    ("resolution", lambda v: fg.Costmap(resolution=v), "resolution", (*NO_NUMBERS, 0)),
    ("goal_radius", lambda v: fg.LocalMap(goal_radius=v), "goal_radius", (*NO_NUMBERS, 0)),
    ("stacked part", lambda v: fg.Stacked(v, 2), "part", (5, "a", fg.Scan)),
    ("count", lambda v: fg.Stacked(fg.Scan(), v), "count", NO_COUNTS),
    ("observation", fg.Observation, "part", (5, "a", None, fg.Scan)),
    ("speed", lambda v: fg.VelocityAction(speed=v), "speed", (5, "ab", *PAIRS[3:])),
    ("yaw_rate", lambda v: fg.VelocityAction(yaw_rate=v), "yaw_rate", ("3", 0, HUGE, [1])),
    ("angle", lambda v: fg.SteeringAction(angle=v), "angle", ("3", 0, HUGE, [1])),
    ("commands", fg.DiscreteAction, "commands", (5, "ab", [], [(1,)], [("a", "b")], [(0, HUGE)])),
    ("kind", lambda v: fg.DiscreteAction([(0, 0)], v), "kind", (5, "a")),
    ("distance", fg.RandomGoal, "distance", PAIRS),
    ("clearance", lambda v: fg.RandomGoal(clearance=v), "clearance", (*NO_NUMBERS, -1)),
    ("radius", lambda v: fg.RandomGoal(goal_radius=v), "goal_radius", (*NO_NUMBERS, 0)),
    ("margin", lambda v: fg.RandomGoal(margin=v), "margin", ("3", -1, HUGE, [1])),
    ("origin", lambda v: fg.RandomGoal(origin=v), "origin", (5, "ab", (1,), (1, math.inf))),
    ("start", lambda v: fg.FixedGoal(v, (1, 1)), "start", (5, "abc", None, (1, 2))),
    ("goal", lambda v: fg.FixedGoal((0, 0, 0), v), "goal", (5, "ab", None, (1,), (1, 2, 3))),
    ("strayed", fg.Strayed, "distance", (*NO_NUMBERS, 0)),
    ("proximity", fg.Proximity, "distance", (*NO_NUMBERS, 0)),
    ("factor", lambda v: fg.Progress() * v, "factor", (*NO_NUMBERS, math.nan, HUGE)),
    ("noise", fg.ScanNoise, "deviation", PAIRS),
    ("dropout", fg.BeamDropout, "share", PAIRS),
    ("latency", fg.CommandLatency, "steps", PAIRS),
    ("limits", fg.DriveLimits, "velocity", [each for each in PAIRS if each is not None]),
    ("payload", fg.Payload, "mass", PAIRS),
    ("friction", fg.Friction, "factor", PAIRS),
    ("size", fg.RobotSize, "factor", PAIRS),
    ("models", fg.ObstacleSize, "models", (5, None, "a", [5])),
    ("sum", lambda v: fg.ScanNoise() + v, "Randomization", (5, "a", None)),
    ("world", lambda v: ENV(v), "world", (5, None, [1])),
    ("max_steps", lambda v: ENV("corridor", max_steps=v), "max_steps", ("3", 0, 1.5, True, HUGE)),
    ("repeat", lambda v: ENV("corridor", physics_steps=v), "physics_steps", (*NO_COUNTS, HUGE)),
    ("step_size", lambda v: ENV("corridor", step_size=v), "step_size", (*NO_NUMBERS, 0, HUGE)),
    ("params", lambda v: ENV("corridor", params=v), "params", (5, "a")),
    ("render_mode", lambda v: ENV("corridor", render_mode=v), "render_mode", (5, "a")),
    ("web_port", lambda v: ENV("corridor", web_port=v), "web_port", ("3", -1, 1.5, 70_000)),
    ("unknown", lambda v: ENV("corridor", nothing=v), "nothing", (5,)),
    ("num_envs", fg.FlatlandVectorEnv, "num_envs", (*NO_COUNTS, 0, HUGE)),
    ("threads", lambda v: fg.FlatlandVectorEnv(num_threads=v), "num_threads", (*NO_COUNTS, HUGE)),
    ("num_robots", lambda v: fg.make_parallel(num_robots=v), "num_robots", (*NO_COUNTS, 0, HUGE)),
    ("robot", lambda v: fg.make_parallel(robot=v), "yaml_path", (5, [1])),
    ("buildings", fg.Buildings, "worlds", (5, None, "a", [5], [])),
    ("building kind", fg.RandomBuildings, "kind", (5, None, "castle")),
    ("building count", lambda v: fg.RandomBuildings("maze", v), "count", (*NO_COUNTS, 0, HUGE)),
    ("controller", Gap, "env", (5, None)),
    ("policy", Policy, "file", (5, [1], "\0")),
    ("policy robot", PolicyRobot.of, "env", (5, None)),
]
CALLS: list[tuple[str, Callable[[Any, Any, Any], object], str, Sequence[Any]]] = [
    ("seed", lambda e, _, x: e.reset(seed=x), "seed", ("a", -1, 1.5, True, [1])),
    ("options", lambda e, _, x: e.reset(options=x), "options", (5, [1], "ab", {"x": 1}, {1: 2})),
    (
        "start",
        lambda e, _, x: e.reset(options={"start": x}),
        "start",
        (None, 5, "abc", (1, 2), (0, 0, HUGE)),
    ),
    (
        "goal",
        lambda e, _, x: e.reset(options={"goal": x}),
        "goal",
        (None, 5, "ab", [1], (1, 2, 3), (1, "x")),
    ),
    (
        "action",
        lambda e, _, x: (e.reset(), e.step(x)),
        "actions",
        (None, "ab", [1], [1, 2, 3], [math.nan, 0], 1j),
    ),
    ("task", lambda e, _, x: setattr(e, "task", x), "task", (None, 5, fg.RandomGoal)),
    (
        "seeds",
        lambda _, v, x: v.reset(seed=x),
        "seed",
        ("a", -1, 1.5, True, [1], [1, "a"], [1, -1]),
    ),
    (
        "all options",
        lambda _, v, x: v.reset(options=x),
        "options",
        (5, [1], "ab", {"x": 1}, {1: 2}),
    ),
    ("starts", lambda _, v, x: v.reset(options={"start": x}), "start", (None, 5, "abc", [[1, 2]])),
    (
        "goals",
        lambda _, v, x: v.reset(options={"goal": x}),
        "goal",
        (None, 5, [1], [[math.nan, 1]] * 2),
    ),
    (
        "mask",
        lambda _, v, x: v.reset(options={"reset_mask": x}),
        "reset_mask",
        (5, [True], np.ones(2)),
    ),
    ("episodes", lambda _, v, x: fg.evaluate(Gap(v), v, x), "episodes", (*NO_COUNTS, 0)),
    ("first seed", lambda _, v, x: fg.evaluate(Gap(v), v, 1, x), "seed", ("a", -1, 1.5, None)),
    ("choose", lambda _, v, x: fg.evaluate(x, v, 1), "choose", (5, None)),
    ("evaluated", lambda _, v, x: fg.evaluate(Gap(v), x, 1), "envs", (5, None)),
]


@pytest.fixture(scope="module")
def environments() -> Iterator[tuple[Any, Any]]:
    env = ENV("corridor")
    envs = fg.FlatlandVectorEnv(2, "corridor", autoreset_mode="SAME_STEP")
    env.reset(seed=1)
    yield env, envs
    env.close()
    envs.close()


def check(call: Callable[[Any], object], argument: str, values: Sequence[Any]) -> None:
    for value in values:
        with pytest.raises(
            (ValueError, TypeError, FlatlandError, fg.env.gymnasium.error.Error)
        ) as caught:
            call(value)
        text = str(caught.value)
        assert argument in text, text
        assert not INTERNAL.search(text), text
        assert len(text) < 400


@pytest.mark.parametrize("row", PARTS, ids=[row[0] for row in PARTS])
def test_an_invalid_argument_of_a_part_is_named(row: Any) -> None:
    check(*row[1:])


@pytest.mark.parametrize("row", CALLS, ids=[row[0] for row in CALLS])
def test_an_invalid_argument_of_a_call_is_named(environments: Any, row: Any) -> None:
    _, call, argument, values = row
    check(lambda value: call(*environments, value), argument, values)


def test_integers_of_numpy_are_integers() -> None:
    env = ENV("corridor", max_steps=np.int64(5), physics_steps=np.int32(2))
    env.reset(seed=np.int64(3), options={"goal": np.array([8, 1])})
    assert env.goal == (8.0, 1.0)
    env.close()
