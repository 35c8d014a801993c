"""Mistakes of scenario files that only their worlds reveal."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from flatland.cli.check import check_scenarios
from flatland.scenarios.suite import SUITES, included_suites

DOOR = """
bodies:
  - name: leaf
    type: kinematic
    footprints: [{type: circle, radius: 0.1, density: 0}]
plugins:
  - {type: PathFollower, name: path, waypoints: [[0, 1]], start: false, start_topic: door}
"""
WORLD = """
properties: {}
layers: [{name: walls, map: room.yaml}]
plugins: [{type: Pedestrians, name: people, groups: [{name: visitor, count: 1}]}]
models:
  - {name: robot, model: robot.model.yaml, pose: [2, 5, 0]}
  - {name: pillar, model: box.model.yaml, pose: [7, 7, 0]}
  - {name: lid, model: box.model.yaml, pose: [3, 8, 0]}
"""


@pytest.fixture
def problems(room, files):
    """Returns the problems of the scenario of a text: its lines, severities, texts and hints."""
    # The room from 1 m to 9 m has a chamber at its upper right, whose door is 0.2 m wide.
    pixels = [["."] * 100 for _ in range(100)]
    for row in range(100):
        for column in range(100):
            is_wall = not (10 <= row < 90 and 10 <= column < 90)
            is_chamber = 30 <= row < 33 and column >= 70 and not 80 <= column < 82
            is_side = row < 33 and 70 <= column < 73
            if is_wall or is_chamber or is_side:
                pixels[99 - row][column] = "#"
    files.write_map("room", ["".join(row) for row in pixels], resolution=0.1)
    files.write("door.model.yaml", DOOR)
    files.write("world.yaml", WORLD)
    files.write("broken.model.yaml", "bodies: [{name: a, footprnts: []}]")

    def check(text: str, **params: object) -> list[tuple[int | None, str, str, str]]:
        file = room / "scenario.yaml"
        lines = "" if "world:" in text else "world: world.yaml\n"
        file.write_text(lines + text + ("" if re.search(r"\bgoals?:", text) else "\ngoal: [5, 5]"))
        _, found = check_scenarios(file, params)
        return [(one.line, one.severity, one.message, one.hint) for one in found]

    return check


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        # Names.
        ("robot: robbot", 'the robot "robbot" does not exist', 'did you mean "robot"?'),
        ("robot: {laser: eye}", 'the world has no plugin "eye" of type Laser', ": laser"),
        ("robot: {cmd_vel: cmd_val}", 'command "cmd_val" does not exist', '"/cmd_vel"'),
        ("people: [{group: visitors, count: 2}]", 'group "visitors" does not exist', '"visitor"'),
        ("events: [{at: 1, delete: pilar}]", 'model "pilar" does not exist', '"pillar"'),
        ("events: [{at: 1, delete: robot}]", "must not be the robot", ""),
        (
            "events: [{at: 1, move: {model: robot, pose: [3, 3, 0]}}]",
            "must not be the robot; use kidnap",
            "",
        ),
        (
            "events: [{at: 1, command: {topic: /cmd_ve, value: 1}}]",
            'no model or plugin has a command "/cmd_ve"',
            'did you mean "/cmd_vel"?',
        ),
        ("events: [{at: 1, people: {stop: [visitor_8]}}]", 'no person "visitor_8"', "visitor_"),
        ("require: [no contact with pilar]", 'no model or layer "pilar"', '"pillar"'),
        ("matrix: {speed: [1, 2]}", 'uses the parameter "speed" of matrix', ""),
        ("models: [{name: lid, model: box.model.yaml, pose: [4, 4, 0]}]", '"lid"', ""),
        (
            "events: [{at: 1, spawn: {name: lid, model: box.model.yaml, ahead: 1}}]",
            'a model "lid" exists already',
            "",
        ),
        ("require: [spl > 1]", '"spl > 1" cannot hold: spl is from 0 to 1', ""),
        ("require: [at least 2 goals]", "goals is from 0 to 1", ""),
        ("require: [reached within 0 s]", "cannot hold: time is from 0.005 to 60", ""),
        # Values of commands.
        (
            "models: [{name: d, model: door.model.yaml, pose: [4, 4, 0]}]\n"
            "events: [{at: 1, command: {topic: door, value: maybe}}]",
            "command /door takes bool",
            "",
        ),
        # Places.
        ("goal: [0.5, 5]", 'inside of a wall of layer "walls"', ""),
        ("goals: [[5, 5], [7.1, 7.1]]", 'inside of model "pillar"', ""),
        ("goal: [40, 5]", "outside of the walls from (0, 0) to (10, 10)", ""),
        ("goal: [8, 2]", "wide enough for a disc with the radius 0.2 m", ""),
        ("start: [1, 5, 0]", 'overlaps layer "walls"', ""),
        ("start: [40, 5, 0]", "cannot start at (40, 5): it is outside", ""),
        ("start: {area: [7.5, 1.5, 8.5, 2.5]}", "cannot be reached", ""),
        ("goal: {area: [20, 20, 30, 30]}", "cannot be reached: it is outside", ""),
        ("goal: {distance: 50}", "found no goal at a distance from 50 to inf m", ""),
        ("events: [{at: 1, kidnap: [0.5, 5, 0]}]", "inside of a wall", ""),
        ("events: [{at: 1, kidnap: [1.1, 5, 0]}]", 'overlaps layer "walls"', ""),
        ("events: [{at: 1, kidnap: [7.4, 7, 0]}]", 'overlaps model "pillar"', ""),
        ("events: [{at: 1, kidnap: [40, 5, 0]}]", "cannot be moved to (40, 5): it is outside", ""),
        ("events: [{near: [40, 5], delete: lid}]", "never takes place", ""),
        ("people: [{poses: [[0.5, 5, 0]]}]", "nobody can be at (0.5, 5): it is inside", ""),
        ("events: [{at: 1, people: {send: all, to: [0.5, 5]}}]", "nobody can walk to", ""),
        (
            "world: {generate: maze, seed: 1, size: [7, 7]}\nrobot: {name: robot, "
            "model: robot.model.yaml, pose: [1, 1, 0]}\ngoal: random",
            "no pose in a random world",
            "",
        ),
        # Times.
        ("limits: {time: 10}\nevents: [{at: 10, delete: lid}]", "at 10 s never takes place", ""),
        ("events: [{after_goal: 1, delete: lid}]", "after goal 1 never takes place", ""),
        (
            "events:\n- {at: 5, spawn: {name: b, model: box.model.yaml, ahead: 1}}\n"
            "- {at: 3, delete: b}",
            'model "b" is only added at 5 s',
            "",
        ),
        (
            "events: [{at: 5, delete: lid}, {at: 6, move: {model: lid, pose: [4, 4, 0]}}]",
            'model "lid" was deleted at 5 s',
            "",
        ),
        (
            "events:\n- {at: 5, spawn: {name: d, model: door.model.yaml, pose: [4, 4, 0]}}\n"
            "- {at: 3, command: {topic: door, value: true}}",
            'model "d" with the command "door" is only added at 5 s',
            "",
        ),
    ],
)
def test_mistakes_are_errors(text, message, hint, problems):
    ((line, severity, found, found_hint),) = problems(text)
    assert severity == "error"
    assert message in found
    assert hint in found_hint
    assert line is not None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("params: {speed: 1}", 'uses the parameter "speed" of params'),
        ("limits: {time: 20, stuck: 30}", '"stuck" has no effect'),
        ("robot: {period: 0.012}", "must be a multiple of the step of 0.005 s, got 0.012; 0.01 s"),
        ("goal: [2.1, 5]", "is reached at once"),
        ("limits: {time: 2}", "cannot be reached within 2 s"),
        ("goals: [[5, 5], [5, 5]]", "is reached at once, it is the one before"),
        # A scenario about a robot that does not reach its goal.
        ("goal: [8, 2]\nrequire: [no contact]", "cannot be reached: no way from (2, 5)"),
    ],
)
def test_what_is_probably_wrong_is_a_warning(text, message, problems):
    ((_, severity, found, _),) = problems(text)
    assert severity == "warning"
    assert message in found


@pytest.mark.parametrize(
    "text",
    [
        # A place that is reached only after a kidnapping, and one within the tolerance.
        "goal: [8, 2]\nevents: [{at: 1, kidnap: [7.8, 2.2, 0]}]",
        "goal: [1.05, 5]",
        # The lid is moved away from the goal, before or after it is reached.
        "goal: [3, 8]\nevents: [{near: [3, 7], move: {model: lid, pose: [5, 8, 0]}}]",
        # Models that may exist, depending on the robot.
        "events:\n- {near: [4, 5], spawn: {name: b, model: box.model.yaml, ahead: 1}}\n"
        "- {at: 3, delete: b}\n- {at: 9, spawn: {name: b, model: box.model.yaml, ahead: 1}}",
        "events:\n- {at: 3, delete: lid}\n"
        "- {at: 5, spawn: {name: lid, model: box.model.yaml, pose: [4, 4, 0]}}\n"
        "- {at: 6, move: {model: lid, pose: [5, 4, 0]}}",
        "require: [no contact with walls, no contact with people, no contact with robot]",
        # In one of two scenarios.
        "require: [no contact with b]\nscenarios:\n- {name: x}\n"
        "- {name: y, models: [{name: b, model: box.model.yaml, pose: [4, 4, 0]}]}\n",
        "matrix: {size: [1, 2]}\ntolerance: '$eval param(\"size\") * 0.1'",
        "models: [{name: d, model: door.model.yaml, pose: [4, 4, 0]}]\n"
        "events: [{at: 1, command: {topic: /door, value: true}}, {at: 2, people: {stop: all}}]",
    ],
)
def test_what_may_be_right_is_no_problem(text, problems):
    assert problems(text) == []


def test_errors_have_the_line_of_their_entry(problems):
    found = problems(
        "models: [{name: lid, model: box.model.yaml, pose: [4, 4, 0]}]\n"
        "goals:\n- [5, 5]\n- [0.5, 5]\n"
        "events:\n- {at: 1, delete: ghost}\n- {at: 90, delete: lid}\n"
        "require:\n- reached\n- no contact with ghost\n"
        "matrix:\n  .robot.max_speed: [0.5, 0.6]\n  size: [1, 2]\n"
    )
    assert sorted(line for line, *_ in found) == [2, 5, 7, 8, 11, 14]


def test_errors_of_worlds_and_models_are_those_of_their_files(problems, room, files):
    text = "events: [{at: 1, spawn: {name: b, model: broken.model.yaml, ahead: 1}}]"
    _, found = check_scenarios_of(room, text)
    assert {(Path(one.file).name, one.line) for one in found} == {("broken.model.yaml", 1)}
    files.write("bad.yaml", WORLD.replace("room.yaml", "rom.yaml").replace("visitor", "[]"))
    _, found = check_scenarios_of(room, "world: bad.yaml")
    assert {Path(one.file).name for one in found} == {"bad.yaml"}
    assert len(found) >= 2


def check_scenarios_of(room, text):
    lines = "" if "world:" in text else "world: world.yaml\n"
    (room / "scenario.yaml").write_text(f"{lines}{text}\ngoal: [5, 5]")
    return check_scenarios(room / "scenario.yaml", {})


@pytest.mark.parametrize("name", included_suites())
def test_the_included_suites_fit_their_worlds(name):
    scenarios, found = check_scenarios(SUITES / f"{name}.yaml", {})
    assert found == []
    assert len(scenarios) >= len(yaml.safe_load((SUITES / f"{name}.yaml").read_text())["scenarios"])
