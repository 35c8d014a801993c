"""Tests of examples/sweep, which require the extra `ray`: `make test-learning` runs them."""

from __future__ import annotations

import ast
import contextlib
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pandas as pd
import pytest
from flatland_sweep import command_line
from flatland_sweep.cells import Cell, Settings, SweepError, parse_seeds, table_of_cells
from flatland_sweep.columns import COLUMNS, KEY, TIMING, row_of
from flatland_sweep.controllers import INCLUDED, Task, find_controller
from flatland_sweep.episode import run_cell
from flatland_sweep.measurements import Measurements
from flatland_sweep.planner import PlanningError, plan_path
from flatland_sweep.results import Results, read_results
from flatland_sweep.summary import summarize, wilson_interval
from free_ports import free_port
from pages import code_blocks
from waiting import TIMEOUT, wait_until

import flatland

SIMPLE = Path(__file__).resolve().parents[2] / "worlds" / "simple"
WORLD = str(SIMPLE / "world.yaml")
SCRIPT = Path(command_line.__file__).resolve().parents[1] / "sweep.py"
# Limit of a program that runs many episodes [s].
SWEEP_TIMEOUT = 3 * TIMEOUT


# -- cells and settings --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("3", [3]), ("0:3", [0, 1, 2]), ("0:10:4", [0, 4, 8]), ("5, 1:3,2", [5, 1, 2])],
)
def test_seeds_are_numbers_and_ranges(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(
    "text", ["", "a", "1:", "-1", "3:3", "5:1", "0:4:0", "1,,2", "0:9999999999"]
)
def test_invalid_seeds_are_rejected(text):
    with pytest.raises(SweepError, match="seeds"):
        parse_seeds(text)


def test_a_table_has_each_combination_once():
    cells = table_of_cells(["a", "b", "a"], ["gap"], [1, 2])
    assert cells == [Cell(w, "gap", s) for s in (1, 2) for w in ("a", "b")]


def test_a_table_without_controllers_is_rejected():
    with pytest.raises(SweepError, match="needs controllers"):
        table_of_cells(["a"], [], [1])


@pytest.mark.parametrize(
    "values",
    [
        {"period": 0.0},
        {"time_limit": float("nan")},
        {"clearance": -1.0},
        {"max_distance": 1.0},
        {"tolerance": 2.0},
    ],
)
def test_settings_out_of_range_are_rejected(values):
    with pytest.raises(SweepError, match=next(iter(values))):
        Settings(**values)


# -- measurements --------------------------------------------------------------------------


@pytest.fixture
def room() -> Iterator[flatland.World]:
    """A room from (0, 0) to (8, 6) with a robot of radius 0.2 m."""
    with flatland.World.from_yaml(WORLD, seed=1) as world:
        yield world


def test_clearance_path_and_collisions_are_those_of_the_true_state(room):
    robot = room.model("robot")
    room.move_model("robot", (1.0, 3.0, np.pi))
    measured = Measurements(room, robot)
    assert measured.min_clearance == pytest.approx(0.8, abs=2e-3)
    drive = room.command("/cmd_vel")
    drive.set(flatland.Twist(linear_x=0.5))
    for _ in range(200):  # 0.5 m
        room.step()
        measured.update()
    assert measured.path_length == pytest.approx(0.5, abs=1e-3)
    assert measured.min_clearance == pytest.approx(0.3, abs=2e-3)
    assert measured.collisions == 0
    for _ in range(400):  # 0.3 m to the wall, where it stays
        room.step()
        measured.update()
    assert measured.path_length == pytest.approx(0.8, abs=0.02)
    assert measured.min_clearance == 0.0
    assert measured.collisions == 1
    drive.set(flatland.Twist(linear_x=-0.5))
    for _ in range(100):
        room.step()
        measured.update()
    drive.set(flatland.Twist(linear_x=0.5))
    for _ in range(200):
        room.step()
        measured.update()
    assert measured.collisions == 2


def test_clearance_does_not_contain_the_noise_of_the_laser(tmp_path):
    model = (SIMPLE / "robot.model.yaml").read_text()
    (tmp_path / "robot.model.yaml").write_text(
        model.replace("update_rate: 10", "update_rate: 10\n    noise_std_dev: 0.5")
    )
    for name in ("world.yaml", "room.yaml", "room.dat"):
        (tmp_path / name).write_text((SIMPLE / name).read_text())
    noisy = run_cell(Cell("world.yaml", "random", 3), Settings(), str(tmp_path))
    exact = run_cell(Cell(WORLD, "random", 3), Settings(), "")
    assert noisy["outcome"] == exact["outcome"] == "collision"
    assert noisy["min_clearance"] == exact["min_clearance"]
    assert noisy["path_length"] == exact["path_length"]


# -- controllers ---------------------------------------------------------------------------


def task_in(world: flatland.World, goal: tuple[float, float]) -> Task:
    """Returns a task for the robot of the room."""
    return Task(world, world.model("robot"), 0.2, 1, goal, 0.1, 0.8, 1.5, np.random.default_rng(1))


def test_a_path_avoids_all_obstacles(room):
    path = plan_path(task_in(room, (6.0, 1.0)))
    assert path[-1].tolist() == [6.0, 1.0]
    assert np.hypot(*(path[0] - (1.5, 1.5))) < 0.2
    # Around the partition at x = 4, which ends at y = 3.5.
    assert path[:, 1].max() > 3.5
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert steps.max() < 0.2
    points = np.column_stack((path, np.zeros(len(path))))
    assert room.physics.free_discs(points, 0.2, 1, ignored=room.model("robot").bodies).all()


def test_a_goal_without_a_path_is_reported(room):
    with pytest.raises(PlanningError, match=r"no path from \(1.50, 1.50\)"):
        plan_path(task_in(room, (20.0, 20.0)))


@pytest.mark.parametrize("controller", ["gap", "pursuit"])
@pytest.mark.parametrize("seed", [0, 2, 4])
def test_included_controllers_reach_goals_without_touching_anything(controller, seed):
    row = run_cell(Cell(WORLD, controller, seed), Settings(), "")
    assert row["outcome"] == "reached", row
    assert row["success"] is True
    assert row["collisions"] == 0
    assert row["min_clearance"] > 0
    assert row["final_distance"] <= 0.3
    assert row["path_length"] >= row["distance"] - 0.3 - 1e-6
    # Not faster than the limit of the speed.
    assert row["time"] >= row["path_length"] / 0.8 - 1e-6


def test_controllers_of_a_seed_have_the_same_start_and_goal():
    rows = [run_cell(Cell(WORLD, name, 7), Settings(), "") for name in INCLUDED]
    places = [
        tuple(row[f"{end}_{axis}"] for end in ("start", "goal") for axis in "xy") for row in rows
    ]
    assert len(set(places)) == 1
    other = run_cell(Cell(WORLD, "gap", 8), Settings(), "")
    assert (other["start_x"], other["start_y"]) != places[0][:2]


def test_an_episode_is_repeatable():
    first, second = (run_cell(Cell(WORLD, "random", 5), Settings(), "") for _ in range(2))
    for name in TIMING:
        del first[name], second[name]
    assert first == second
    assert len(first["state_hash"]) == 32


def test_an_episode_goes_on_after_tolerated_collisions():
    row = run_cell(Cell(WORLD, "random", 5), Settings(max_collisions=1000, time_limit=90), "")
    assert row["outcome"] == "timeout"
    assert row["collisions"] > 1
    assert row["time"] == pytest.approx(90.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("unknown", "included are gap, pursuit, random"),
        ("missing.py:Gap", "controller file not found"),
        ("no_such_module:Gap", "ModuleNotFoundError"),
        ("json:JSONDecoder", "no class JSONDecoder with a method command"),
    ],
)
def test_unknown_controllers_are_rejected(name, message, tmp_path):
    with pytest.raises(SweepError, match=message):
        find_controller(name, str(tmp_path))


# -- errors of cells -----------------------------------------------------------------------


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], str]:
    """Writes a file into the temporary folder, and returns its path."""

    def write_file(name: str, text: str) -> str:
        (tmp_path / name).write_text(dedent(text))
        return str(tmp_path / name)

    return write_file


CONTROLLERS = """
    import flatland

    class Raising:
        def __init__(self, task):
            pass
        def command(self, scan, pose, goal):
            raise RuntimeError("out of ideas")

    class Exiting(Raising):
        def command(self, scan, pose, goal):
            raise SystemExit(3)

    class Infinite(Raising):
        def command(self, scan, pose, goal):
            return flatland.Twist(linear_x=float("inf"))

    class Silent(Raising):
        def command(self, scan, pose, goal):
            return None
"""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Raising", r"RuntimeError: out of ideas \[bad\.py:8\]"),
        ("Exiting", "SystemExit: 3"),
        ("Infinite", "a command that is not finite"),
        ("Silent", "must return a flatland.Twist, got None"),
    ],
)
def test_an_error_of_a_controller_is_a_row(name, message, write, tmp_path):
    write("bad.py", CONTROLLERS)
    row = run_cell(Cell(WORLD, f"bad.py:{name}", 0), Settings(), str(tmp_path))
    assert row["outcome"] == "error"
    assert row["success"] is False
    assert re.search(message, row["error"]), row["error"]
    assert row["time"] is None


@pytest.mark.parametrize(
    ("text", "settings", "message"),
    [
        ("properties: {}\nlayers: [", Settings(), "broken.yaml"),
        ("properties: {}\nlayers: []\n", Settings(), "the world has no plugin of type Laser"),
        (None, Settings(robot="other"), '"other" does not exist'),
        (None, Settings(cmd_vel="velocity"), 'command "velocity" does not exist'),
        (None, Settings(laser="rear"), 'the world has no plugin "rear" of type Laser'),
        (None, Settings(min_distance=100.0), "found no goal at a distance from 100"),
    ],
)
def test_an_error_of_a_world_is_a_row(text, settings, message, write):
    world = WORLD if text is None else write("broken.yaml", text)
    row = run_cell(Cell(world, "gap", 0), settings, "")
    assert row["outcome"] == "error"
    assert message in row["error"]


# -- results -------------------------------------------------------------------------------


def a_row(seed: int, **values: Any) -> dict[str, Any]:
    """Returns a row with a result."""
    return row_of(Cell("w", "gap", seed), **{"outcome": "reached", "time": 1.5 * seed, **values})


@contextlib.contextmanager
def opened(folder: Path, **settings: Any) -> Iterator[Results]:
    """Opens and closes results; the definition is stored."""
    with contextlib.closing(Results(folder, settings)) as results:
        results.define("worlds", {"w": "/w"})
        yield results


def test_rows_are_in_parts_until_the_sweep_is_complete(tmp_path):
    with opened(tmp_path / "out") as results:
        for seed in (3, 1):
            results.add(a_row(seed))
        assert results.pending == 2
        assert read_results(tmp_path / "out").empty
        results.flush()
        results.add(a_row(2))
        results.flush()
        assert read_results(tmp_path / "out")["seed"].tolist() == [1, 2, 3]
        assert len(list((tmp_path / "out" / "parts").iterdir())) == 2
        cells = [Cell("w", "gap", seed) for seed in range(5)]
        assert [cell.seed for cell in results.missing(cells)] == [0, 4]
        results.complete()
    assert not list((tmp_path / "out" / "parts").iterdir())
    frame = pd.read_parquet(tmp_path / "out" / "results.parquet")
    assert frame["seed"].tolist() == [1, 2, 3]
    assert frame["time"].tolist() == [1.5, 3.0, 4.5]


def test_a_repeated_cell_replaces_its_error(tmp_path):
    with opened(tmp_path) as results:
        results.add(a_row(1, outcome="error", time=None, error="broken"))
        results.complete()
        cell = Cell("w", "gap", 1)
        assert results.missing([cell]) == []
        assert results.missing([cell], retry_errors=True) == [cell]
        results.add(a_row(1))
        frame = results.complete()
    assert frame["outcome"].tolist() == ["reached"]


def test_parts_that_were_merged_before_a_crash_are_not_counted_twice(tmp_path):
    with opened(tmp_path) as results:
        results.add(a_row(1))
        results.flush()
        part = next((tmp_path / "parts").iterdir())
        content = part.read_bytes()
        results.complete()
        part.write_bytes(content)
        assert len(results.frame()) == 1


def test_an_incomplete_file_is_removed(tmp_path):
    with opened(tmp_path) as results:
        results.add(a_row(1))
        results.flush()
    (tmp_path / "parts" / "000002.parquet.tmp").write_bytes(b"PAR1")
    with opened(tmp_path) as results:
        assert len(results.frame()) == 1
    assert [path.name for path in (tmp_path / "parts").iterdir()] == ["000001.parquet"]


def test_the_folder_of_another_sweep_is_refused(tmp_path):
    with opened(tmp_path, time_limit=60.0) as results:
        results.add(a_row(1))
        results.flush()
    with (
        pytest.raises(SweepError, match=r"another sweep: time_limit is 60\.0 there and 30\.0 here"),
        opened(tmp_path, time_limit=30.0),
    ):
        pass
    with (
        opened(tmp_path, time_limit=60.0) as results,
        pytest.raises(SweepError, match="results of another 'w'"),
    ):
        results.define("worlds", {"w": "/other"})


def test_a_folder_of_other_files_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(SweepError, match="contains other files"), opened(tmp_path):
        pass
    with pytest.raises(SweepError, match="cannot be used"), opened(tmp_path / "notes.txt"):
        pass
    assert [entry.name for entry in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 9}', '{"format": 1, "settings": 1}'])
def test_an_invalid_description_is_refused(text, tmp_path):
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(SweepError, match=r"sweep\.json"), opened(tmp_path):
        pass


def test_an_invalid_part_is_reported_with_its_name(tmp_path):
    with opened(tmp_path) as results:
        (tmp_path / "parts" / "000001.parquet").write_bytes(b"PAR1")
        with pytest.raises(SweepError, match=r"000001\.parquet cannot be read"):
            results.frame()


def test_a_folder_has_one_writer(tmp_path):
    with opened(tmp_path), pytest.raises(SweepError, match="another process"), opened(tmp_path):
        pass
    with opened(tmp_path):
        pass


# -- summary -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (8, 10, 0.49016, 0.94332),
        (0, 10, 0.0, 0.27753),
        (10, 10, 0.72247, 1.0),
        (50, 100, 0.40383, 0.59617),
    ],
)
def test_the_interval_is_that_of_wilson(successes, trials, low, high):
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=1e-5)


def test_the_summary_excludes_errors_from_rates():
    rows = [a_row(seed, collisions=0, path_length=2.0, min_clearance=0.5) for seed in (2, 4)]
    rows.append(a_row(5, outcome="timeout", collisions=0, path_length=9.0, min_clearance=0.1))
    rows.append(a_row(6, outcome="error", time=None, error="broken"))
    (summary,) = summarize(pd.DataFrame(rows)).to_dict("records")
    assert (summary["cells"], summary["errors"], summary["timeouts"]) == (4, 1, 1)
    assert summary["success"] == pytest.approx(2 / 3)
    assert (summary["time"], summary["path"]) == (4.5, 2.0)
    assert summary["clearance"] == 0.5


# -- the command: invalid arguments --------------------------------------------------------


@pytest.fixture
def arguments(tmp_path: Path) -> dict[str, Any]:
    """Valid arguments."""
    return {
        "--worlds": [WORLD],
        "--seeds": "0:3",
        "--controllers": "gap",
        "--out": str(tmp_path / "out"),
    }


def flat(arguments: dict[str, Any]) -> list[str]:
    """Returns options and their values as a list."""
    worlds = arguments["--worlds"]
    others = [word for item in arguments.items() if item[0] != "--worlds" for word in item]
    return ["--worlds", *worlds, *others]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"--worlds": ["missing.yaml"]}, "world file not found: "),
        ({"--seeds": "5:5"}, "there are no seeds in '5:5'"),
        ({"--controllers": "gap,unknown"}, "controller 'unknown' does not exist"),
        ({"--controllers": ","}, "a sweep needs controllers"),
        ({"--period": "0"}, "--period: must be a number above 0"),
        ({"--workers": "0"}, "--workers: must be at least 1"),
        ({"--max-distance": "1"}, "max_distance must be greater than min_distance"),
        ({"--working-dir": "/no/such/folder"}, "--working-dir is not a folder"),
        ({"--working-dir": str(SIMPLE.parents[1])}, "contains a folder flatland"),
        ({"--working-dir": "/"}, "paths must be relative to that folder"),
    ],
)
def test_invalid_arguments_are_reported_before_anything_starts(
    changes, message, arguments, tmp_path, capsys
):
    with contextlib.ExitStack() as stack:
        if changes.keys() & {"--period", "--workers"}:
            stack.enter_context(pytest.raises(SystemExit, match="2"))
        assert command_line.main(flat(arguments | changes)) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_local_sweeps_have_no_address(arguments, tmp_path, capsys):
    assert command_line.main([*flat(arguments), "--local", "--address", "auto"]) == 2
    assert "--address is for Ray, not for --local" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("missing", "options", "message"),
    [
        ("ray", (), "Ray is not installed: pip install 'flatland-sim[ray]', or use --local"),
        ("pandas", ("--local",), "pandas missing: pip install 'flatland-sim[ray]'"),
    ],
)
def test_a_missing_package_is_reported_with_the_command_that_installs_it(
    missing, options, message, arguments, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name == missing else object()
    )
    assert command_line.main([*flat(arguments), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


# -- the command: complete sweeps ----------------------------------------------------------

# Ends its process at the first attempt of seed 1.
KILLER = """
    import os
    import signal
    from pathlib import Path

    from flatland_sweep.controllers import PurePursuit

    FLAG = Path(__file__).with_name("killed")

    class Killer(PurePursuit):
        def __init__(self, task):
            super().__init__(task)
            self.seed, self.calls = task.world.seed, 0

        def command(self, scan, pose, goal):
            self.calls += 1
            if self.seed == 1 and self.calls == 5 and not FLAG.exists():
                FLAG.write_text(str(os.getpid()))
                os.kill(os.getpid(), signal.SIGKILL)
            return super().command(scan, pose, goal)

    class Incurable(Killer):
        def command(self, scan, pose, goal):
            if self.seed == 1:
                os.kill(os.getpid(), signal.SIGKILL)
            return super().command(scan, pose, goal)
"""


def environment() -> dict[str, str]:
    """Returns the environment of a sweep."""
    package = str(Path(flatland.__file__).resolve().parents[1])
    # The cluster of the fixture would send statistics of its use.
    return {**os.environ, "PYTHONPATH": package, "RAY_USAGE_STATS_ENABLED": "0"}


def start_sweep(arguments: dict[str, Any], *options: str, folder: Path) -> subprocess.Popen[str]:
    """Starts a sweep in a folder."""
    return subprocess.Popen(
        [sys.executable, SCRIPT, *flat(arguments), *options],
        cwd=folder,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        # A shell ignores this signal on behalf of the programs that it starts in the background.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def sweep(arguments: dict[str, Any], *options: str, folder: Path, code: int = 0) -> pd.DataFrame:
    """Runs a sweep in a folder, and returns its rows."""
    with start_sweep(arguments, *options, folder=folder) as process:
        output, _ = process.communicate(timeout=SWEEP_TIMEOUT)
    assert process.returncode == code, output
    return read_results(folder / arguments["--out"])


def without_timing(frame: pd.DataFrame) -> pd.DataFrame:
    """Returns the columns that must be equal for all runs of a sweep."""
    return frame.drop(columns=list(TIMING))


def assert_same(a: pd.DataFrame, b: pd.DataFrame) -> None:
    """Checks that two sweeps have the same results, bit by bit."""
    pd.testing.assert_frame_equal(without_timing(a), without_timing(b), check_exact=True)


def pid_of(frame: pd.DataFrame, controller: str, seed: int) -> str:
    """Returns the id of the process that completed a cell."""
    row = frame[(frame["controller"] == controller) & (frame["seed"] == seed)]
    return str(row["worker"].item()).rpartition(":")[2]


@pytest.mark.parametrize("options", [(), ("--local",)], ids=["ray", "local"])
def test_a_worker_killed_in_the_middle_changes_no_result(options, write, arguments, tmp_path):
    write("killer.py", KILLER)
    arguments["--controllers"] = "gap,random,killer.py:Killer"
    disturbed = sweep(arguments, "--workers", "2", *options, folder=tmp_path)
    killed = (tmp_path / "killed").read_text()
    assert pid_of(disturbed, "killer.py:Killer", 1) != killed
    assert len(disturbed) == 9
    assert set(disturbed["outcome"]) <= {"reached", "collision", "timeout"}
    arguments["--out"] = "undisturbed"
    # One worker instead of two.
    undisturbed = sweep(arguments, "--workers", "1", *options, folder=tmp_path)
    assert_same(disturbed, undisturbed)
    assert (tmp_path / "undisturbed" / "summary.csv").is_file()


@pytest.mark.parametrize("options", [(), ("--local",)], ids=["ray", "local"])
def test_a_cell_that_always_kills_its_worker_is_a_row_with_an_error(
    options, write, arguments, tmp_path
):
    write("killer.py", KILLER)
    arguments["--worlds"].append(write("broken.yaml", "properties: {}\nlayers: ["))
    arguments["--controllers"] = "gap,killer.py:Incurable"
    frame = sweep(arguments, "--workers", "2", *options, folder=tmp_path, code=1)
    assert len(frame) == 12
    broken = frame[frame["world"] != WORLD]
    assert (broken["outcome"] == "error").all()
    assert broken["error"].str.contains(r"broken\.yaml").all()
    failed = frame[(frame["world"] == WORLD) & (frame["outcome"] == "error")]
    assert failed[list(KEY)].to_numpy().tolist() == [[WORLD, "killer.py:Incurable", 1]]
    assert "attempts" in failed["error"].item()
    # Errors are results: nothing is left to do, unless it is requested.
    again = sweep(arguments, "--workers", "2", *options, folder=tmp_path, code=1)
    assert again["wall_time"].equals(frame["wall_time"])


@pytest.mark.parametrize(
    ("number", "options"),
    [(signal.SIGKILL, ()), (signal.SIGINT, ()), (signal.SIGTERM, ("--local",))],
    ids=["kill-ray", "interrupt-ray", "terminate-local"],
)
def test_an_interrupted_sweep_continues_where_it_stopped(number, options, arguments, tmp_path):
    count = 150
    arguments["--seeds"] = f"0:{count}"
    parts = tmp_path / "out" / "parts"
    process = start_sweep(arguments, "--workers", "1", *options, folder=tmp_path)
    wait_until("the first rows", lambda: any(parts.glob("*.parquet")), TIMEOUT, poll_period=0.01)
    process.send_signal(number)
    output, _ = process.communicate(timeout=SWEEP_TIMEOUT)
    before = read_results(tmp_path / "out")
    assert 0 < len(before) < count
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130, output
        assert f"interrupted with {count - len(before)} of {count} cells missing" in output
    after = sweep(arguments, "--workers", "2", *options, folder=tmp_path)
    assert len(after) == count
    # Rows from before the interruption were not computed again.
    kept = after.merge(before, on=list(KEY), suffixes=("", "_before"))
    assert len(kept) == len(before)
    assert (kept["wall_time"] == kept["wall_time_before"]).all()
    assert (kept["worker"] == kept["worker_before"]).all()
    arguments["--out"] = "undisturbed"
    assert_same(after, sweep(arguments, "--local", folder=tmp_path))


def test_a_sweep_can_be_extended(arguments, tmp_path):
    first = sweep(arguments, "--local", "--workers", "1", folder=tmp_path)
    arguments |= {"--seeds": "0:4", "--controllers": "gap,random"}
    extended = sweep(arguments, "--local", "--workers", "1", folder=tmp_path)
    assert len(extended) == 8
    kept = extended.merge(first, on=list(KEY), suffixes=("", "_before"))
    assert (kept["wall_time"] == kept["wall_time_before"]).all()
    arguments["--time-limit"] = "5"
    with start_sweep(arguments, "--local", folder=tmp_path) as process:
        output, _ = process.communicate(timeout=SWEEP_TIMEOUT)
    assert process.returncode == 2
    assert "another sweep: time_limit is 60.0 there and 5.0 here" in output


# Two nodes on this machine, as `ray start` would start them on two machines. The second one can
# be ended together with its workers.
CLUSTER = """
    import sys
    from ray.cluster_utils import Cluster

    cluster = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": 100_000_000}
    )
    node = cluster.add_node(num_cpus=1, object_store_memory=100_000_000)
    print("address", cluster.address, flush=True)
    for line in sys.stdin:
        if line.strip() == "remove":
            cluster.remove_node(node, allow_graceful=False)
            print("removed", flush=True)
    cluster.shutdown()
"""


@pytest.fixture
def unused_port() -> int:
    """A TCP port of this machine that no program uses."""
    return free_port()


@pytest.fixture
def cluster() -> Iterator[subprocess.Popen[str]]:
    """A cluster of two nodes, whose address is the first line of the output."""
    with subprocess.Popen(
        [sys.executable, "-c", dedent(CLUSTER)],
        env=environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()
        process.wait(TIMEOUT)


def answer(process: subprocess.Popen[str], word: str) -> str:
    """Returns the rest of the next line of output that starts with a word."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(word):
            return line.removeprefix(word).strip()
    raise AssertionError(f"the output has no line {word}")


def test_a_node_that_fails_changes_no_result(cluster, write, arguments, tmp_path):
    address = answer(cluster, "address ")
    # The worlds and controllers are copied to the nodes.
    project = tmp_path / "project"
    project.mkdir()
    for path in SIMPLE.iterdir():
        (project / path.name).write_bytes(path.read_bytes())
    (project / "own.py").write_text("from flatland_sweep.controllers import FollowGap as Own\n")
    arguments |= {"--worlds": ["world.yaml"], "--controllers": "gap,own.py:Own"}
    arguments |= {"--seeds": "0:80", "--address": address, "--working-dir": "project"}
    parts = tmp_path / "out" / "parts"
    with start_sweep(arguments, folder=tmp_path) as process:
        wait_until(
            "the first rows", lambda: any(parts.glob("*.parquet")), TIMEOUT, poll_period=0.01
        )
        assert cluster.stdin is not None
        print("remove", file=cluster.stdin, flush=True)
        answer(cluster, "removed")
        assert len(read_results(tmp_path / "out")) < 160
        output, _ = process.communicate(timeout=SWEEP_TIMEOUT)
    assert process.returncode == 0, output
    disturbed = read_results(tmp_path / "out")
    del arguments["--address"], arguments["--working-dir"]
    arguments["--out"] = str(tmp_path / "undisturbed")
    undisturbed = sweep(arguments, "--local", "--workers", "2", folder=project)
    assert_same(disturbed, undisturbed)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("127.0.0.1:{port}", "Ray cannot be reached at 127.0.0.1:{port}"),
        ("localhost", "--address must be auto or HOST:PORT, got 'localhost'"),
    ],
)
def test_a_cluster_that_does_not_exist_is_reported(
    address, message, unused_port, arguments, tmp_path
):
    address = address.format(port=unused_port)
    with start_sweep(arguments, "--address", address, folder=tmp_path) as process:
        output, _ = process.communicate(timeout=SWEEP_TIMEOUT)
    assert process.returncode == 2, output
    assert message.format(port=unused_port) in output
    assert not (tmp_path / "out").exists()


# -- the page ------------------------------------------------------------------------------

PAGE = SCRIPT.with_name("README.md")


def test_the_commands_of_the_page_are_valid(monkeypatch):
    text = PAGE.read_text() + (SCRIPT.parents[2] / "docs" / "learning.md").read_text()
    commands = re.findall(r"^python examples/sweep/sweep\.py (.*)$", text, re.MULTILINE)
    assert len(commands) >= 4
    for command in commands:
        options = command_line.make_parser().parse_args(shlex.split(command))
        folder = SCRIPT.parents[2] / (options.working_dir or "")
        assert all((folder / world).is_file() for world in options.worlds), command


def test_the_controller_of_the_page_reaches_goals(tmp_path):
    (code,) = (b for b in code_blocks(PAGE.read_text(), "python") if b.startswith("import math"))
    (tmp_path / "careful.py").write_text(code)
    rows = [
        run_cell(Cell(WORLD, "careful.py:Careful", seed), Settings(), str(tmp_path))
        for seed in range(6)
    ]
    assert {row["outcome"] for row in rows} == {"reached", "timeout"}, rows


def test_the_page_describes_all_columns():
    text = PAGE.read_text()
    assert [name for name in COLUMNS if f"`{name}`" not in text] == []


def test_the_environment_of_the_program_for_rllib_can_be_created():
    page = SCRIPT.parents[2] / "docs" / "learning.md"
    blocks = code_blocks(page.read_text(), "python")
    (program,) = (block for block in blocks if block.startswith("import ray\n"))
    (function,) = [node for node in ast.parse(program).body if isinstance(node, ast.FunctionDef)]
    names: dict[str, Any] = {}
    exec(compile(ast.Module([function], []), page.name, "exec"), names)
    environment = names[function.name]({"world": "corridor"})
    environment.reset(seed=1)
    observation, _, terminated, _, _ = environment.step(np.zeros(2, np.float32))
    assert environment.observation_space.contains(observation)
    assert not terminated
    environment.close()
