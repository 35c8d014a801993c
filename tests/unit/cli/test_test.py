"""The command `flatland test`."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import signal
import sys
from pathlib import Path

import pytest
from flatland_command import main
from forked_workers import CONTEXT
from full_disk import REASON
from programs import Program, run_program
from waiting import wait_until

from flatland.scenarios.results import locked

WORLD = """
    properties: {}
    layers: [{name: walls, map: room.yaml}]
    models: [{name: robot, model: bot.model.yaml, pose: [3, 5, 0]}]
"""
ROBOT = """
    bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 100}]}]
    plugins:
    - {type: DiffDrive, name: drive, body: base}
    - {type: Laser, name: eye, body: base, range: 9, angle: {min: -3, max: 3, increment: 0.1}}
"""
SLOW = """
import math

import flatland

class Slow:
    def __init__(self, task): pass
    def command(self, scan, pose, goal):
        bearing = math.atan2(goal[1] - pose[1], goal[0] - pose[0]) - pose[2]
        turn = math.remainder(bearing, math.tau)
        return flatland.Twist(linear_x=0.3 if abs(turn) < 0.5 else 0.0, angular_z=2 * turn)

class Still(Slow):
    def command(self, scan, pose, goal): return flatland.Twist()

class Late(Slow):
    def command(self, scan, pose, goal):
        import time
        time.sleep(0.02)
        return flatland.Twist()
"""


@pytest.fixture
def suite(files, monkeypatch):
    """A folder with a scenario file that `straight` passes, which is the current folder."""
    files.write_map("room", ["##########", *["#........#"] * 8, "##########"])
    files.write("bot.model.yaml", ROBOT)
    files.write("room.world.yaml", WORLD)
    files.write("own.py", SLOW)
    files.write(
        "box.model.yaml",
        "bodies: [{name: b, type: static, footprints: [{type: circle, radius: 0.3, density: 0}]}]",
    )
    files.write(
        "s.yaml",
        """
        world: room.world.yaml
        goal: [4.5, 5]
        seeds: 0:3
        limits: {time: 15}
        require: [reached within 12 s]
        """,
    )
    monkeypatch.chdir(files.folder)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    monkeypatch.setattr("flatland.scenarios.workers._CONTEXT", CONTEXT)
    return files.folder


def test_a_suite_is_run_and_reported(suite, capsys):
    assert main("test", "s.yaml", "--robot", "straight,gap", "--workers", "2") == 0
    output = capsys.readouterr().out
    assert re.search(r"^s +straight +3 +100 %", output, re.MULTILINE)
    assert "gap against straight" in output
    assert "worst run" not in output
    found = {path.name for path in (suite / "flatland-test").iterdir()}
    assert {"report.html", "results.csv", "results.json", "junit.xml"} <= found
    assert "unfinished.jsonl" not in found
    content = json.loads((suite / "flatland-test" / "results.json").read_text())
    rows = [run["row"] for run in content["runs"]]
    # In the order of the suite, independently of the processes.
    assert [(row["seed"], row["controller"]) for row in rows] == [
        (seed, controller) for seed in range(3) for controller in ("straight", "gap")
    ]


def test_a_failed_run_is_drawn_and_can_be_replayed(suite, capsys):
    options = ("--robot", "straight", "--param", "x=1", "--out", "out", "--junit", "j.xml")
    # A box is in the way, and near, since the replay takes as long as the run.
    box = "models: [{name: box, model: box.model.yaml, pose: [4.2, 5, 0]}]\n"
    text = (suite / "s.yaml").read_text().replace("[4.5, 5]", "[5.5, 5]")
    (suite / "s.yaml").write_text(box + text)
    assert main("test", "s.yaml", "--seeds", "4", *options) == 1
    output = capsys.readouterr().out
    assert "worst run: s straight seed 4" in output
    assert "reached within 12 s: the outcome is collision" in output
    assert "S•" in output
    (command,) = [line for line in output.splitlines() if line.startswith("flatland replay")]
    words = command.split()[1:]
    assert main(*words) == 0
    printed = capsys.readouterr()
    assert re.search(r"http://127\.0\.0\.1:\d+/", printed.out + printed.err)
    assert "no difference" in printed.out
    assert (suite / "j.xml").is_file()
    assert "with links that replay the runs: flatland replay out --view" in output


def test_a_baseline_decides_on_the_exit_code(suite, capsys):
    # Each seed has another start.
    (suite / "s.yaml").write_text(
        (suite / "s.yaml").read_text() + "start: {area: [2, 4, 3.5, 6]}\n"
    )
    run = ("test", "s.yaml", "--seeds", "0:12")
    assert main(*run, "--robot", "straight", "--out", "old") == 0
    baseline = ("--baseline", "old/results.json")
    assert main(*run, "--robot", "straight", *baseline) == 0
    assert "no significant difference of a measure in 12 distinct pairs" in capsys.readouterr().out
    # Slower, and within its limit.
    assert main(*run, "--robot", "own.py:Slow", *baseline, "--out", "slow") == 1
    output = capsys.readouterr().out
    assert "own.py:Slow against the baseline (straight):" in output
    assert re.search(r"time is worse: \d+\S* -> \d+", output)
    # Faster, and with more energy.
    assert main(*run, "--robot", "straight", "--baseline", "slow") == 1
    output = capsys.readouterr().out
    assert "time is better" in output
    assert "energy is worse" in output


def test_a_run_that_does_not_pass_any_more_fails_the_gate(suite, capsys):
    assert main("test", "s.yaml", "--robot", "straight", "--out", "old") == 0
    assert "s with straight: 3 seeds, 1 distinct trajectory" in capsys.readouterr().out
    run = ("test", "s.yaml", "--baseline", "old", "--out", "new")
    assert main(*run, "--robot", "own.py:Late") == 1
    output = capsys.readouterr().out
    assert "3 runs from pass to fail:" in output
    assert "    s seed 2: reached within 12 s: the outcome is timeout" in output
    assert " is worse" not in output  # It is one run.
    assert "From pass to fail: 3" in (suite / "new" / "report.html").read_text()
    assert main(*run, "--robot", "own.py:Late", "--regressions", "significant") == 0
    capsys.readouterr()
    # Back again, and a controller that the baseline does not have.
    back = ("test", "s.yaml", "--baseline", "new", "--robot")
    assert main(*back, "straight") == 0
    assert "3 runs from fail to pass:" in capsys.readouterr().out
    assert main(*back, "own.py:Late,straight") == 1
    assert "straight against the baseline:\n  no runs in common" in capsys.readouterr().out


def test_a_baseline_without_runs_in_common_is_not_passed(suite, capsys):
    assert main("test", "s.yaml", "--robot", "straight,gap", "--out", "old") == 0
    run = ("test", "s.yaml", "--baseline", "old")
    assert main(*run, "--robot", "straight", "--seeds", "7") == 1
    assert "no runs in common" in capsys.readouterr().out
    assert main(*run, "--robot", "own.py:Slow") == 1
    assert "own.py:Slow against the baseline:\n  no runs in common" in capsys.readouterr().out


def test_a_folder_is_written_by_one_suite_at_a_time(suite, capsys):
    with locked(suite / "out"):
        assert main("test", "s.yaml", "--out", "out") == 1
    assert "another `flatland test` writes to out; wait for its end" in capsys.readouterr().err


def test_the_lock_of_a_killed_suite_is_released(suite):
    command = [sys.executable, "-m", "flatland", "test", "s.yaml", "--out", "out"]
    program = Program([*command, "--robot", "own.py:Late", "--seeds", "0:50"])
    wait_until("the journal", (suite / "out" / "unfinished.jsonl").exists)
    options = ("--robot", "straight", "--seeds", "0", "--out", "out")
    assert main("test", "s.yaml", *options) == 1
    program.kill()
    wait_until("the lock", lambda: main("test", "s.yaml", *options) == 0)


LIMITED = """
import sys
from full_disk import limited_files
from flatland import cli
with limited_files(int(sys.argv.pop(1))):
    sys.exit(cli.main())
"""


def test_what_is_incomplete_is_named(suite):
    text = (suite / "s.yaml").read_text().replace("time: 15", "time: 30")
    (suite / "s.yaml").write_text(text)
    options = ("--robot", "own.py:Still", "--seeds", "0", "--record", "all", "--out", "out")
    program = [sys.executable, "-c", LIMITED, "9000", "test", "s.yaml", *options]
    done = run_program(program, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 1
    first, second = done.stderr.splitlines()
    pattern = rf"flatland: out/recordings/\S+ is incomplete: {REASON}, at step \d+"
    assert re.fullmatch(pattern, first), done.stderr
    assert second == f"flatland: not written: [Errno 27] {REASON}: 'out/report.html'"
    assert re.search(r"^s +own\.py:Still +1 ", done.stdout, re.MULTILINE)
    assert "report: " not in done.stdout
    assert (suite / "out" / "results.json").exists()


def test_options_that_are_given_several_times(suite, capsys):
    text = (suite / "s.yaml").read_text().replace("time: 15", "time: 0.1")
    (suite / "s.yaml").write_text(text + "\nmatrix: {.robot.max_speed: [0.1, 0.2, 0.3]}")
    options = ("--seeds", "0", "--seeds", "0:2,5", "--record", "none")
    patterns = ("--only", "s[robot.max_speed=0.1]", "--only", "*=0.3?")
    assert main("test", "s.yaml", "--robot", "straight", "--robot", "gap", *options, *patterns) == 1
    content = json.loads((suite / "flatland-test" / "results.json").read_text())
    rows = [run["row"] for run in content["runs"]]
    assert [(row["scenario"], row["seed"], row["controller"]) for row in rows] == [
        (scenario, seed, controller)
        for scenario in ("s[robot.max_speed=0.1]", "s[robot.max_speed=0.3]")
        for seed in (0, 1, 5)
        for controller in ("straight", "gap")
    ]
    report = (suite / "flatland-test" / "report.html").read_text()
    assert "flatland test s.yaml --robot straight --robot gap" in report


def test_names_that_are_not_utf8(suite, capfdbinary):
    name = os.fsdecode(b"b\xff\x1b.yaml")
    (suite / "s.yaml").rename(name)
    out = os.fsdecode(b"o\xff")
    assert main("test", name, "--robot", "straight", "--seeds", "0", "--out", out) == 0
    assert main("test", name, "--robot", "straight", "--continue", "--out", out) == 0
    assert rb"b\udcff\x1b  straight" in capfdbinary.readouterr().out
    row = json.loads(Path(out, "results.json").read_text())["runs"][0]["row"]
    assert row["scenario"] == r"b\udcff\x1b"


def test_errors_of_scenarios_are_printed_together(suite, capsys):
    text = (suite / "s.yaml").read_text()
    (suite / "s.yaml").write_text(
        text.replace("goal:", "gaol:").replace("reached within", "clerance >")
    )
    (suite / "t.yaml").write_text("world: rom.world.yaml\ngoal: [1, 1]\n")
    assert main("test", "s.yaml", "t.yaml") == 1
    errors = capsys.readouterr().err
    assert "t.yaml:1: error: The world file does not exist" in errors
    assert 'hint: did you mean "room.world.yaml"?' in errors
    assert re.search(r'^s\.yaml:\d+: error: .*there is no measure "clerance"', errors, re.MULTILINE)
    assert not (suite / "flatland-test").exists()


def test_check_lists_the_errors_of_a_scenario(suite, capsys):
    assert main("check", "s.yaml") == 0
    assert "1 scenario, 3 runs of each controller" in capsys.readouterr().out
    (suite / "s.yaml").write_text("world: x.yaml\ngoal: [1, 1]\nsome: thing\n")
    assert main("check", "s.yaml") == 1
    output = capsys.readouterr().out
    assert "s.yaml:1: error: The world file does not exist" in output
    assert "s.yaml:3: error: " in output
    assert "s.yaml: 2 errors" in output
    assert main("check", "s.yaml", "--json") == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["kind"], report["errors"]) == ("scenario", 2)


def test_scenarios_that_do_not_fit_their_world_are_not_run(suite, capsys):
    text = (suite / "s.yaml").read_text()
    (suite / "s.yaml").write_text(f"{text}robot: bot\nparams: {{unused: 1}}\n")
    assert main("check", "s.yaml") == 1
    checked = capsys.readouterr().out
    assert main("test", "s.yaml", "--robot", "straight") == 1
    errors = capsys.readouterr().err
    assert errors.splitlines()[0] == 's.yaml:7: error: the robot "bot" does not exist'
    assert errors in checked
    assert not (suite / "flatland-test").exists()
    # A warning is printed, and the scenario is run.
    (suite / "s.yaml").write_text(f"{text}params: {{unused: 1}}\n")
    assert main("test", "s.yaml", "--robot", "straight") == 0
    assert "s.yaml:7: warning: no file of the world" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "name scenario files or included suites"),
        (("s.yaml", "--seeds", "x"), "must be numbers and ranges of seeds"),
        (("s.yaml", "--workers", "0"), "must be at least 1"),
        (("s.yaml", "--robot", ","), "must name a controller"),
        (("s.yaml", "--working-dir", "."), "--working-dir requires --ray"),
    ],
)
def test_invalid_arguments(arguments, message, suite, capsys):
    with pytest.raises(SystemExit, match="2"):
        main("test", *arguments)
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("ofice",), "neither a file nor an included suite 'ofice' (hint: did you mean"),
        (("s.yaml", "--robot", "unknown"), "'unknown' does not exist; included are straight"),
        (("s.yaml", "--only", "x"), "no scenario has a title that matches 'x'"),
        (("s.yaml", "--baseline", "missing.json"), "missing.json cannot be read"),
    ],
)
def test_what_does_not_exist_is_an_error(arguments, message, suite, capsys):
    assert main("test", *arguments) == 1
    assert message in capsys.readouterr().err


def test_a_controller_with_an_error_does_not_end_the_suite(suite, capsys):
    (suite / "bad.py").write_text("def bad(scan, pose, goal): raise ValueError('no')")
    assert main("test", "s.yaml", "--robot", "bad.py:bad,straight") == 1
    assert "ValueError: no [bad.py:1]" in capsys.readouterr().out


@pytest.mark.skipif(importlib.util.find_spec("ray") is not None, reason="Ray is installed")
def test_a_missing_package_is_named(suite, capsys):
    assert main("test", "s.yaml", "--ray") == 1
    error = capsys.readouterr().err
    assert "`flatland test --ray` needs Ray" in error
    assert 'pip install "flatland-sim[ray]"' in error


def test_the_included_scenarios_are_listed(suite, capsys):
    assert main("test", "--list") == 0
    output = capsys.readouterr().out
    assert "narrow_doors/straight_ahead[door=0.55]" in output
    assert main("test", "s.yaml", "--list") == 0
    assert "s  3 seeds" in capsys.readouterr().out


def test_the_leaderboard_is_a_table_of_markdown(suite, capsys):
    assert main("test", "s.yaml", "--robot", "straight", "--markdown") == 0
    assert "| s | `straight` | 3 | 100 %" in capsys.readouterr().out


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_command_writes_partial_results(number, suite):
    text = (suite / "s.yaml").read_text()
    (suite / "s.yaml").write_text(text.replace("time: 15", "time: 2"))
    command = [sys.executable, "-m", "flatland", "test", "s.yaml", "--robot", "own.py:Late"]
    command += ["--seeds", "0:50", "--workers", "2", "--out", "out"]
    program = Program(command)
    journal = suite / "out" / "unfinished.jsonl"
    wait_until(
        "the first result",
        lambda: journal.exists() and len(journal.read_text().splitlines()) > 1,
    )
    program.send(number)
    assert program.wait() == 128 + number, program.output
    assert re.search(r"interrupted: \d+ runs missing; --continue makes them", program.output)
    content = json.loads((suite / "out" / "results.json").read_text())
    assert 1 <= len(content["runs"]) < 50
    assert content["missing"] == 50 - len(content["runs"])
    assert (suite / "out" / "report.html").is_file()
