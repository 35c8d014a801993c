from __future__ import annotations

import pytest

from flatland.config.collecting_reader import ErrorCollector
from flatland.errors import Place, YamlError
from flatland.scenarios.reader import is_scenario_file, read_scenarios
from flatland.scenarios.scenario import GeneratedWorld, RandomPlace, Trigger


def test_a_scenario(scenario, room):
    found = scenario(
        """
        description: A test.
        robot: {name: robot, max_speed: 0.5}
        start: [1, 2, 3]
        goals: [[4, 5], random, {distance: [1, 3], clearance: 0.2, area: [0, 0, 4, 4]}]
        limits: {time: 20, collisions: any, stuck: 5}
        require: [no contact, clearance > 0.1 m]
        models: [{name: box, model: box.model.yaml, pose: [3, 3, 0]}]
        people: [{group: visitor, count: 2}, {poses: [[1, 1, 0]]}]
        events:
          - {at: 2, delete: box}
          - {near: [3, 4], radius: 0.5, kidnap: [1, 1, 0]}
          - {after_goal: 1, spawn: {name: b, model: box.model.yaml, ahead: 2}}
          - {at: 1, people: {send: [visitor_0], to: [2, 2]}}
        params: {/noise: 0.1, word: abc, flag: true}
        seeds: 1,5:7
        """
    )
    assert (found.title, found.description) == ("scenario", "A test.")
    assert found.world == str(room / "world.yaml")
    assert found.start == (1.0, 2.0, 3.0)
    assert found.goals[0] == (4.0, 5.0)
    assert found.goals[1] == RandomPlace()
    assert found.goals[2] == RandomPlace((1.0, 3.0), 0.2, (0.0, 0.0, 4.0, 4.0))
    assert (found.limits.time, found.limits.collisions, found.limits.stuck) == (20.0, None, 5.0)
    assert [one.text for one in found.require] == ["no contact", "clearance > 0.1 m"]
    assert found.models[0].model == str(room / "box.model.yaml")
    assert [(one.group, one.count, one.poses) for one in found.people] == [
        ("visitor", 2, ()),
        ("", 0, ((1.0, 1.0, 0.0),)),
    ]
    assert [event.action for event in found.events] == ["delete", "kidnap", "spawn", "people"]
    assert found.events[1].trigger == Trigger(place=(3.0, 4.0), radius=0.5)
    assert found.params == {"/noise": 0.1, "word": "abc", "flag": True}
    assert found.seeds == (1, 5, 6)


def test_defaults(scenario):
    found = scenario()
    assert [one.text for one in found.require] == ["reached"]
    assert found.seeds == (0,)
    assert (found.limits.time, found.limits.collisions) == (60.0, 0)


def test_random_worlds(scenario):
    found = scenario("world: {generate: maze, seed: 3, size: [9, 8]}")
    assert found.world == GeneratedWorld("maze", 3, (9.0, 8.0), 0.3)


def test_a_matrix_sets_parameters_and_fields(room):
    file = room / "m.yaml"
    file.write_text(
        "world: world.yaml\n"
        "goal: ['$eval param(\"x\") + 1', 5]\n"
        "matrix: {x: [1, 2.5], .robot.max_speed: [0.4, 0.8], .start: [random]}\n"
    )
    found = read_scenarios(file)
    assert [one.title for one in found] == [
        "m[x=1,robot.max_speed=0.4,start=random]",
        "m[x=1,robot.max_speed=0.8,start=random]",
        "m[x=2.5,robot.max_speed=0.4,start=random]",
        "m[x=2.5,robot.max_speed=0.8,start=random]",
    ]
    assert [one.goals[0] for one in found] == [(2.0, 5.0), (2.0, 5.0), (3.5, 5.0), (3.5, 5.0)]
    assert [one.robot.max_speed for one in found] == [0.4, 0.8, 0.4, 0.8]
    assert found[0].start == RandomPlace()
    assert [one.params["x"] for one in found] == [1, 1, 2.5, 2.5]


def test_a_matrix_of_goals_takes_the_place_of_a_goal(scenario, room):
    file = room / "g.yaml"
    file.write_text("world: world.yaml\ngoal: [1, 1]\nmatrix: {.goals: [[[2, 2], [3, 3]]]}\n")
    (found,) = read_scenarios(file)
    assert found.goals == ((2.0, 2.0), (3.0, 3.0))


def test_several_scenarios_in_a_file(room, caplog):
    file = room / "many.yaml"
    file.write_text(
        "world: world.yaml\n"
        "goal: [5, 5]\n"
        "limits: {time: 9}\n"
        "scenarios:\n"
        "  - {name: a}\n"
        "  - {name: b, goals: [[1, 1], [2, 2]]}\n"
        "  - {name: c, matrix: {n: [1, 2]}, limits: {time: '$eval param(\"n\") * 3'}}\n"
    )
    found = read_scenarios(file)
    assert [one.title for one in found] == ["many/a", "many/b", "many/c[n=1]", "many/c[n=2]"]
    assert [one.limits.time for one in found] == [9.0, 9.0, 3.0, 6.0]
    assert found[1].goals == ((1.0, 1.0), (2.0, 2.0))
    assert caplog.text == ""


def test_given_parameters_take_precedence(scenario):
    found = scenario("params: {a: 1, b: 2}", b=3)
    assert found.params == {"a": 1, "b": 3}


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("world: wrld.yaml", "The world file does not exist", 'did you mean "world.yaml"?'),
        ("goal: [1]", 'Error converting entry "goal" to vector', "[x, y]"),
        ("tolerence: 1", 'unrecognized entry(s) {"tolerence"}', 'did you mean "tolerance"?'),
        ("require: [clerance > 1]", 'no measure "clerance"', 'did you mean "clearance"?'),
        ("seeds: 5:5", "there are no seeds in '5:5'", ""),
        ("world: {generate: palace}", '"generate" must be one of office', ""),
        ("events: [{at: 1}]", "must have one of the actions", ""),
        ("events: [{delete: a}]", "must have one of the triggers", "at: SECONDS"),
        ("events: [{at: 1, spwan: {}}]", "one of the actions", 'did you mean "spawn"?'),
        ("events: [{at: 1, fail: {how: broken}}]", '"how" must be one of blind, frozen', ""),
        (
            "robot: robot\nevents: [{at: 1, move: {model: robot, pose: [0, 0, 0]}}]",
            "must not be the robot; use kidnap",
            "",
        ),
        ("models: [{name: a, model: bx.model.yaml, pose: [0, 0, 0]}]", "model file does not", ""),
        ("models: [{name: a, model: box.model.yaml, ahead: 1}]", '"pose" does not exist', ""),
        ("limits: {time: -1}", 'Invalid "time"', ""),
        ("goal: {distance: [3, 2]}", "must be [least, most]", ""),
        ("matrix: {a: []}", "a list of at least one value", ""),
        ("goal: [1, 1]\ngoals: [[1, 1]]", 'has "goal" or "goals", not both', ""),
        ("goals: []", "a list of at least one goal", ""),
    ],
)
def test_invalid_scenarios(text, message, hint, scenario, room):
    with pytest.raises(YamlError) as caught:
        scenario(text)
    assert message in str(caught.value)
    assert hint in caught.value.hint
    assert caught.value.place.path == str(room / "scenario.yaml")
    assert caught.value.place.line


def test_all_errors_are_collected(room):
    file = room / "wrong.yaml"
    file.write_text(
        "world: wrld.yaml\n"
        "goal: [1]\n"
        "tolerence: 1\n"
        "require:\n"
        "  - reached\n"
        "  - fast\n"
        "scenarios:\n"
        "  - {name: a, limits: {time: x}}\n"
        "  - {name: b, events: [{at: -1, delete: c}]}\n"
        "  - name: c\n"
        "    people: [{count: -1},\n"
        "      {poses: 1}]\n"
        "    models: [{name: d, model: none.yaml, pose: [0, 0, 0]}]\n"
    )
    collector = ErrorCollector()
    with collector.at(Place(str(file))):
        read_scenarios(file, read=collector.read)
    lines = sorted(error.place.line for error in collector.errors)
    assert lines == [1, 2, 3, 6, 8, 9, 11, 12, 13]


def test_scenario_files_are_recognized(room):
    assert not is_scenario_file(room / "world.yaml")
    assert not is_scenario_file(room / "robot.model.yaml")
    assert not is_scenario_file(room / "missing.yaml")
    (room / "s.yaml").write_text("world: world.yaml\ngoal: [1, 1]")
    assert is_scenario_file(room / "s.yaml")
