"""Runs of scenarios: measures, events and controllers, against values that are known."""

from __future__ import annotations

import itertools
import math
import sys

import pytest
from full_disk import REASON, limited_files

from flatland.recording import Replay
from flatland.scenarios.columns import COLUMNS, TIMING
from flatland.scenarios.controllers import INCLUDED


def without_timing(row):
    return {name: value for name, value in row.items() if name not in TIMING}


def test_a_straight_drive(run):
    row = run("tolerance: 0.1").row
    assert list(row) == list(COLUMNS)
    results = (row["outcome"], row["success"], row["passed"], row["goals"])
    assert results == ("reached", True, True, 1)
    assert row["path_length"] == pytest.approx(2.9, abs=0.02)
    # Both paths end where the goal is reached, at the tolerance.
    assert row["shortest_path"] == pytest.approx(2.9)
    assert row["spl"] == pytest.approx(1.0, abs=1e-6)
    # A wall of the room is at x = 1, the robot starts at 2, and its radius is 0.2. The solver keeps
    # a distance of less than 1 mm in addition.
    assert row["clearance"] in (0.799, 0.8)
    assert row["collisions"] == 0
    assert row["collided_with"] is row["impact_speed"] is row["people_distance"] is None
    assert row["final_distance"] == pytest.approx(0.1, abs=0.01)
    assert row["steps"] == pytest.approx(row["time"] / 0.005)
    assert row["command_time"] > 0
    assert row["max_command_time"] >= row["command_time"]
    # At constant speed.
    mass = 100 * math.pi * 0.2**2
    kinetic = 0.5 * mass * 0.8**2
    rolling = 0.02 * mass * 9.81 * row["path_length"]
    assert row["energy"] == pytest.approx(kinetic + rolling, rel=1e-3)


def test_runs_are_repeatable_with_the_same_task_for_all_controllers(run):
    def task_of(result):
        return (result.row["start_x"], result.row["start_y"], *result.goals)

    text = "start: random\ngoals: [random, {distance: [1, 3]}]\nlimits: {time: 2}"
    tasks = set()
    for name in INCLUDED:
        first, second = (run(text, name, seed=3) for _ in range(2))
        assert without_timing(first.row) == without_timing(second.row)
        tasks.add(task_of(first))
    assert len(tasks) == 1
    assert task_of(run(text, seed=4)) not in tasks


def test_random_places_are_within_their_limits(run):
    for seed in range(8):
        result = run(
            "start: {area: [2, 2, 4, 4]}\n"
            "goals: [{distance: [1, 2]}, {area: [6, 6, 8, 8], clearance: 0.5}]\n"
            "limits: {time: 0.1}",
            seed=seed,
        )
        start = (result.row["start_x"], result.row["start_y"])
        assert all(2 <= number <= 4 for number in start)
        assert 1 <= math.dist(start, result.goals[0]) <= 2
        assert all(6 <= number <= 8 for number in result.goals[1])


def test_a_collision_with_a_wall(run):
    row = run("goal: [20, 5]").row
    assert (row["outcome"], row["success"], row["spl"]) == ("collision", False, 0.0)
    assert (row["collisions"], row["collided_with"]) == (1, "walls")
    assert row["impact_speed"] == pytest.approx(0.8, abs=0.01)
    assert row["clearance"] == 0.0
    assert row["failures"] == "reached: the outcome is collision"


def test_a_collision_with_a_model_and_the_limit_of_collisions(run):
    box = "models: [{name: box, model: box.model.yaml, pose: [3.5, 5, 0]}]\n"
    assert run(box).row["collided_with"] == "box"
    row = run(box + "limits: {collisions: any, time: 8}\nrequire: [no contact with walls]").row
    assert (row["outcome"], row["collisions"], row["passed"]) == ("timeout", 1, True)
    # It pushes against the box for the rest of the time.
    assert row["stuck_time"] == pytest.approx(8 - 1.5, abs=0.3)
    row = run(box + "limits: {collisions: any, time: 20, stuck: 3}").row
    assert row["outcome"] == "stuck"
    assert row["time"] < 6


def test_goals_are_reached_one_after_the_other(run):
    row = run("goals: [[4, 5], [4, 7], [2, 7]]").row
    assert (row["outcome"], row["goals"]) == ("reached", 3)
    # Around both corners at the distance of the tolerance.
    first, second = corners_of_the_shortest_way(0.3)
    around = math.dist((2, 5), first) + math.dist(first, second) + math.dist(second, (2, 7)) - 0.3
    assert row["shortest_path"] == pytest.approx(around, abs=1e-3)
    assert 0.9 < row["spl"] < 1.0


def corners_of_the_shortest_way(radius):
    """Returns the points of circles about (4, 5) and (4, 7) on the shortest way to (2, 7)."""
    angles = [math.radians(degrees / 10) for degrees in range(900, 2700)]
    first = [(4 + radius * math.cos(a), 5 + radius * math.sin(a)) for a in angles]
    second = [(4 + radius * math.cos(a), 7 + radius * math.sin(a)) for a in angles]
    best = (4 - radius, 5), (4 - radius, 7)
    for _ in range(20):
        one = min(first, key=lambda p: math.dist((2, 5), p) + math.dist(p, best[1]))
        best = one, min(second, key=lambda p: math.dist(one, p) + math.dist(p, (2, 7)))
    return best


def test_a_detour_has_a_lower_efficiency(run, room):
    (room / "own.py").write_text(
        "import math, flatland\n"
        "class Own:\n"
        "    def __init__(self, task): self.seen = False\n"
        "    def command(self, scan, pose, goal):\n"
        "        self.seen = self.seen or pose[1] > 6\n"
        "        goal = goal if self.seen else (pose[0], 7)\n"
        "        bearing = math.atan2(goal[1] - pose[1], goal[0] - pose[0]) - pose[2]\n"
        "        turn = math.remainder(bearing, math.tau)\n"
        "        return flatland.Twist(0.5 * (abs(turn) < 0.3), angular_z=2 * turn)\n"
    )
    row = run("", "own.py:Own").row
    assert row["outcome"] == "reached"
    assert row["spl"] == pytest.approx(2.7 / row["path_length"], rel=0.01)
    assert 0.5 < row["spl"] < 0.75


def test_a_start_at_the_goal_is_efficient(run):
    row = run("goal: [2.1, 5]").row
    assert (row["outcome"], row["spl"], row["shortest_path"]) == ("reached", 1.0, 0.0)


def test_shortest_paths_lead_around_static_models(run):
    row = run(
        "models: [{name: box, model: box.model.yaml, pose: [3.5, 5, 0]}]\ngoal: [5, 5]", "pursuit"
    ).row
    # Around the corners of the box at the distance of the radius.
    corner = (0.3 + 0.2 / math.sqrt(2), 0.3 + 0.2 / math.sqrt(2))
    around = 2 * math.hypot(1.5 - corner[0], corner[1]) + 2 * corner[0] - 0.3
    assert row["outcome"] == "reached"
    assert row["shortest_path"] == pytest.approx(around, rel=0.05)
    assert 0.8 < row["spl"] <= 1


def test_people_have_a_personal_space(run):
    text = "models: [{name: anna, model: person.model.yaml, pose: [3.5, 6, 0]}]\n"
    row = run(text + "require: [reached, no contact with people]").row
    assert row["passed"]
    assert row["people_distance"] == pytest.approx(1.0, abs=0.02)
    assert row["intrusions"] == 1
    # The chord of a circle of 1.2 m at the distance of 1 m.
    assert row["intrusion_time"] == pytest.approx(2 * math.sqrt(1.2**2 - 1) / 0.8, abs=0.11)
    # In front of a person from the start to the end, 0.05 s after the last complete period.
    near = text.replace("3.5, 6, 0]", "2, 5.6, 0]") + "robot: {max_speed: 0.1}\n"
    assert run(near + "limits: {time: 1.05}").row["intrusion_time"] == pytest.approx(1.05)
    row = run(text.replace("6, 0]", "5, 0]") + "require: [no contact with people]").row
    assert row["failures"] == "no contact with people: contact with anna"


def test_jerk_of_a_change_of_speed(run, room):
    (room / "own.py").write_text(
        "import flatland\n"
        "class Own:\n"
        "    def __init__(self, task):\n"
        "        self.task, self.calls = task, 0\n"
        "    def command(self, scan, pose, goal):\n"
        "        self.calls += 1\n"
        "        return flatland.Twist(linear_x=0.3 if self.calls < 6 else 0.5)\n"
    )
    result = run("limits: {time: 2}", "own.py:Own")
    # One change by 0.3 m/s at the start, one by 0.2 m/s, each in two second differences of which
    # the first one is incomplete at the start; 18 or 19 differences in all.
    samples = len(result.path) - 1
    assert result.row["jerk"] * (samples - 2) == pytest.approx((0.3 + 2 * 0.2) / 0.01, rel=0.1)
    assert result.row["angular_jerk"] == 0.0


def test_the_last_sample_of_a_run_is_no_period(run, room):
    """The jerk of a constant speed from the start is that of the start, however the run ends."""
    (room / "own.py").write_text(
        "import flatland\ndef drive(scan, pose, goal): return flatland.Twist(linear_x=0.5)\n"
    )
    # One second difference of 0.5 m/s is not zero, in 39 of them: the first sample is at 0 s.
    for end in ("4.0", "4.08", "4.005"):
        row = run(f"goal: [20, 5]\nlimits: {{time: {end}}}", "own.py:drive").row
        assert row["outcome"] == "timeout"
        assert row["jerk"] == pytest.approx(0.5 / 0.1**2 / 39, rel=1e-4), end


def test_periods_are_whole_numbers_of_steps(run, room):
    (room / "own.py").write_text(
        "import flatland\n"
        "class Own:\n"
        "    def __init__(self, task): self.period = task.period\n"
        "    def command(self, scan, pose, goal):\n"
        "        return flatland.Twist(linear_x=self.period)\n"
    )
    # Steps take 5 ms.
    row = run("robot: {period: 0.0124}\nlimits: {time: 1}", "own.py:Own").row
    assert row["path_length"] == pytest.approx(0.01, abs=1e-3)
    # A period may be longer than the window of the time stuck.
    text = "robot: {period: 5}\nlimits: {time: 30, stuck: 3}"
    assert run(text, "straight").row["outcome"] == "reached"
    (room / "still.py").write_text(
        "import flatland\ndef stand(scan, pose, goal): return flatland.Twist()\n"
    )
    row = run(text, "still.py:stand").row
    assert (row["outcome"], row["time"]) == ("stuck", 5.005)


def test_the_models_at_the_end_are_drawn(run):
    result = run(
        "models: [{name: box, model: box.model.yaml, pose: [7, 7, 0]},\n"
        "         {name: far, model: box.model.yaml, pose: [3, 8, 0]}]\n"
        "events: [{at: 0.5, move: {model: box, pose: [4, 5, 0]}}, {at: 1, delete: far}]"
    )
    points = [point for line in result.outline.lines for point in line]
    assert {(1.0, 1.0), (9.0, 1.0), (9.0, 9.0), (1.0, 9.0)} <= set(points)
    assert result.row["collided_with"] == "box"
    assert [(name, role) for name, role, _ in result.models] == [("robot", "robot"), ("box", "hit")]
    box = {(3.7, 4.7), (4.3, 4.7), (4.3, 5.3), (3.7, 5.3)}
    assert {point for line in result.models[1][2] for point in line} == box
    assert result.outline.key == run().outline.key


# -- events --------------------------------------------------------------------------------


def test_a_box_falls_in_the_way(run):
    box = "spawn: {name: box, model: box.model.yaml, ahead: 1}"
    row = run(f"events: [{{at: 1, {box}}}]").row
    assert (row["outcome"], row["collided_with"]) == ("collision", "box")
    away = "{at: 1.2, delete: box}"
    assert run(f"events: [{{at: 1, {box}}}, {away}]").row["outcome"] == "reached"
    moved = "{at: 1.2, move: {model: box, pose: [8, 8, 0]}}"
    assert run(f"events: [{{at: 1, {box}}}, {moved}]").row["outcome"] == "reached"


def test_a_kidnapping_is_no_part_of_the_path(run):
    result = run("events: [{near: [3.5, 5], radius: 0.2, kidnap: [2, 5, 0]}]")
    row = result.row
    assert row["outcome"] == "reached"
    # 1.3 m to the place, and 2.7 m after it.
    assert row["path_length"] == pytest.approx(4.0, abs=0.03)
    (event,) = result.events
    assert event[3] == "kidnap"
    assert event[0] == pytest.approx(1.3 / 0.8, abs=0.05)
    ((time, *places),) = result.jumps
    assert time == event[0]
    assert places == pytest.approx([3.3, 5, 2, 5], abs=0.02)
    first, second = result.tracks
    assert (first[0], first[-1]) == ((2.0, 5.0), tuple(places[:2]))
    assert second[0] == (2.0, 5.0)
    # The shortest path consists of one to the place and one from there.
    assert row["shortest_path"] == pytest.approx(1.3 + 2.7, abs=0.02)
    assert row["spl"] == pytest.approx(1.0, abs=0.001)
    row = run("events: [{near: [3.5, 5], radius: 0.2, kidnap: [2, 7, -0.5]}]").row
    assert row["shortest_path"] == pytest.approx(1.3 + math.hypot(3, 2) - 0.3, abs=0.02)


def test_an_event_after_a_goal(run):
    row = run(
        "goals: [[4, 5], [2, 5]]\n"
        "events: [{after_goal: 1, spawn: {name: box, model: box.model.yaml, pose: [3, 5, 0]}}]"
    ).row
    assert (row["goals"], row["collided_with"]) == (1, "box")


@pytest.mark.parametrize("how", ["blind", "frozen"])
def test_a_laser_fails(how, run, room):
    (room / "own.py").write_text(
        "import flatland\n"
        "SCANS = []\n"
        "def watch(scan, pose, goal):\n"
        "    SCANS.append(scan.ranges.copy())\n"
        "    return flatland.Twist(linear_x=0.5)\n"
    )
    run(
        f"limits: {{time: 2}}\nevents: [{{at: 0.5, fail: {{how: {how}, for: 0.4}}}}]",
        "own.py:watch",
    )
    path = str(room / "own.py")
    (module,) = [m for m in sys.modules.values() if getattr(m, "__file__", None) == path]
    scans = module.SCANS
    del sys.modules[module.__name__]
    if how == "blind":
        blind = [bool((scan == 10.0).all()) for scan in scans]
        assert blind == [False] * 5 + [True] * 4 + [False] * (len(scans) - 9)
    else:
        frozen = [bool((b == a).all()) for a, b in itertools.pairwise(scans)]
        assert frozen[4:8] == [True] * 4
        assert not any(frozen[9:])


def test_an_impossible_event_is_an_error_with_its_line(run, room):
    row = run("events:\n  - {at: 0.5, delete: ghost}").row
    assert row["outcome"] == "error"
    assert f"delete [{room / 'scenario.yaml'}:4]" in row["error"]
    assert "ghost" in row["error"]


# -- worlds --------------------------------------------------------------------------------


def test_a_random_world_with_people(run, room):
    text = (
        "world: {generate: maze, seed: 2, size: [8, 8]}\n"
        "start: random\ngoal: random\nlimits: {time: 2}\npeople: [{count: 3}]"
    )
    result = run(text, "pursuit")
    assert result.row["outcome"] in ("reached", "timeout", "collision"), result.row
    assert result.row["people_distance"] > 0
    assert len(list((room / "out" / "worlds").iterdir())) == 1
    assert without_timing(run(text, "pursuit").row) == without_timing(result.row)


def test_a_robot_that_the_world_does_not_contain(run, room, files):
    files.write("empty.yaml", "{properties: {}, layers: [{name: walls, map: room.yaml}]}")
    text = "world: empty.yaml\nrobot: {model: robot.model.yaml, pose: [2, 5, 0]}\n"
    assert run(text).row["outcome"] == "reached"
    row = run("world: empty.yaml").row
    assert row["error"] == "Flatland scenario: the world has no plugin of type Laser"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot: ghost", "ghost"),
        ("robot: {laser: eye}", 'has no plugin "eye" of type Laser'),
        ("people: [{count: 1}]", "has no plugin Pedestrians"),
        ("start: [1, 1, 0]", "overlap"),
        ("goal: {distance: 50}", "found no goal at a distance from 50 to inf m"),
    ],
)
def test_scenarios_that_do_not_fit_their_world_are_errors(text, message, run):
    row = run(text).row
    assert (row["outcome"], row["passed"]) == ("error", False)
    assert message in row["error"]
    assert row["failures"] == row["error"]


# -- controllers and recordings ------------------------------------------------------------

CONTROLLERS = """
import flatland

class Nan:
    def __init__(self, task): pass
    def command(self, scan, pose, goal): return flatland.Twist(linear_x=float("nan"))

class Raises(Nan):
    def command(self, scan, pose, goal): raise RuntimeError("no way")

class Leaves(Nan):
    def command(self, scan, pose, goal): raise SystemExit(3)

class Interrupts(Nan):
    def command(self, scan, pose, goal): raise KeyboardInterrupt("my own")

class Exits(Nan):
    def command(self, scan, pose, goal): raise GeneratorExit("the end")

class Evil(Exception):
    def __str__(self): raise ValueError("no text")
    __repr__ = __str__

class Unprintable(Nan):
    def command(self, scan, pose, goal): raise Evil

class Returns(Nan):
    def command(self, scan, pose, goal): return Evil()

class Long(Nan):
    def command(self, scan, pose, goal): raise ValueError("A" * 5_000_000)

class Surrogate(Nan):
    def command(self, scan, pose, goal): raise ValueError("bad \\udcff name")

class Cheats:
    def __init__(self, task): self.task = task
    def command(self, scan, pose, goal):
        self.task.world.move_model("robot", (*goal, 0))
        return flatland.Twist()

class Redefines:
    def __init__(self, task):
        object.__setattr__(task, "goals", (task.robot.pose[:2],))
    def command(self, scan, pose, goal): return flatland.Twist()

class Counts(Nan):
    recoveries = 2
    def command(self, scan, pose, goal): return flatland.Twist(linear_x=100.0)

class Words(Nan):
    def command(self, scan, pose, goal): return flatland.Twist(linear_x="fast")

class Miscounts(Counts):
    recoveries = "many"

class Unprepared(Nan):
    def __init__(self, task): raise ValueError("not today")

def nothing(scan, pose, goal): pass

NUMBER = 5
"""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own.py:Nan", "returned a command that is not finite"),
        ("own.py:Words", "returned a command that is not finite"),
        ("own.py:Raises", "RuntimeError: no way [own.py:9]"),
        ("own.py:Leaves", "SystemExit: 3"),
        ("own.py:Interrupts", "KeyboardInterrupt: my own [own.py:"),
        ("own.py:Exits", "GeneratorExit: the end [own.py:"),
        ("own.py:Unprintable", "Evil: <Evil whose text raises ValueError> [own.py:"),
        ("own.py:Returns", "return a flatland.Twist, got <Evil whose text raises ValueError>"),
        ("own.py:Long", "A... (4998000 more characters) [own.py:"),
        ("own.py:Surrogate", r"ValueError: bad \udcff name [own.py:"),
        ("own.py:Cheats", '"move_model" of the world is not available: a controller can only'),
        ("own.py:Miscounts", "recoveries of the controller must be a count, got 'many'"),
        ("own.py:Unprepared", "ValueError: not today"),
        ("own.py:nothing", "must return a flatland.Twist, got None"),
        ("own.py:NUMBER", "has no function NUMBER, and no class NUMBER"),
        ("own.py:Missing", "has no function Missing"),
        ("unknown", "'unknown' does not exist; included are straight, gap"),
        ("missing.py:A", "file not found"),
        ("no_such_module:A", "ModuleNotFoundError"),
        ("broken.py:A", "SyntaxError"),
    ],
)
def test_a_controller_that_fails_is_an_error_with_the_reason(name, message, run, room):
    (room / "own.py").write_text(CONTROLLERS)
    (room / "broken.py").write_text("def")
    row = run("limits: {time: 1}", name).row
    assert (row["outcome"], row["success"], row["passed"]) == ("error", False, False)
    assert message in row["error"]


def test_ctrl_c_ends_a_run(run, room):
    (room / "own.py").write_text(
        "import signal\ndef own(scan, pose, goal): signal.raise_signal(signal.SIGINT)"
    )
    with pytest.raises(KeyboardInterrupt):
        run("limits: {time: 1}", "own.py:own")


def test_a_controller_cannot_set_its_goal(run, room):
    (room / "own.py").write_text(CONTROLLERS)
    assert run("limits: {time: 1}", "own.py:Redefines").row["outcome"] == "timeout"


def test_commands_are_limited_and_recoveries_are_reported(run, room):
    (room / "own.py").write_text(CONTROLLERS)
    text = "robot: {max_speed: 0.4}\nrequire: [at most 1 recoveries]\nlimits: {time: 2}"
    row = run(text, "own.py:Counts").row
    assert row["path_length"] == pytest.approx(0.8, abs=0.01)
    assert row["failures"] == "at most 1 recoveries: recoveries is 2"


def test_a_recording_that_is_cut_has_its_reason(run, room):
    run("limits: {time: 1}")  # The files of the world are read.
    with limited_files(3000):
        result = run("limits: {time: 5}\ngoal: [20, 5]", "random", record="all")
        passed = run(record="failed")
    assert result.recording_error.startswith(f"{REASON}, at step ")
    assert (room / "out" / result.recording).stat().st_size <= 3000
    # Nothing is missing.
    assert (passed.recording, passed.recording_error) == ("", "")


def test_failed_runs_are_recorded_and_can_be_replayed(run, room):
    result = run("events: [{at: 1, kidnap: [2, 3, 1]}]\ngoal: [20, 5]", record="failed")
    replay = Replay(room / "out" / result.recording)
    assert replay.run() is None
    assert replay.world.state_hash() == result.row["state_hash"]
    replay.close()
    assert run(record="failed").recording == ""
    assert not (room / "out" / result.recording).exists()
    assert (room / "out" / run(record="all").recording).is_file()
