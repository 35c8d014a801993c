"""Runs in real worker processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
from contextlib import ExitStack
from pathlib import Path

import pytest
from full_disk import REASON, limited_files
from waiting import wait_until

from flatland.scenarios.columns import TIMING
from flatland.scenarios.episode import Options
from flatland.scenarios.results import ResultsError, key_of
from flatland.scenarios.scenario import Run
from flatland.scenarios.suite import Plan, SuiteError, run_suite, runs_of
from flatland.scenarios.workers import WorkerLimits, run_in_processes

CONTROLLERS = """
import os, shutil, signal, subprocess, threading, time
from pathlib import Path
import numpy as np
import flatland

FOLDER = Path(__file__).parent
MARKER = "987654.5"

class Drives:
    def __init__(self, task):
        self.seed = task.world.seed

    def command(self, scan, pose, goal):
        return flatland.Twist(linear_x=0.5)

class Hangs(Drives):
    def command(self, scan, pose, goal):
        threading.Event().wait()

class HangsAtStart(Drives):
    def __init__(self, task):
        threading.Event().wait()

class Floods(Drives):
    def command(self, scan, pose, goal):
        kept = []
        while True:
            kept.append(np.ones(4_000_000))

class Prints(Drives):
    def command(self, scan, pose, goal):
        print("x" * 100_000)
        return super().command(scan, pose, goal)

class DiesOnce(Drives):
    def command(self, scan, pose, goal):
        flag = FOLDER / f"died{self.seed}"
        if self.seed == 1 and not flag.exists():
            flag.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        return super().command(scan, pose, goal)

class Dies(Drives):
    def command(self, scan, pose, goal):
        os._exit(3)

class Forks(Drives):
    # Starts processes that would outlive it, and forks that would go on with the run.
    def command(self, scan, pose, goal):
        if not hasattr(self, "forked"):
            self.forked = True
            subprocess.Popen(["sleep", MARKER])
            subprocess.Popen(["sleep", MARKER], env={}, start_new_session=True)
            if os.fork() == 0:
                os.setsid()
                if os.fork() == 0:  # with another parent
                    os.execve(shutil.which("sleep"), ["sleep", MARKER], {})
        os.fork()
        return super().command(scan, pose, goal)

class ForksAndDies(Drives):
    # A fork keeps the connection open.
    def command(self, scan, pose, goal):
        if os.fork() == 0:
            os.setsid()
            (FOLDER / f"fork{os.getpid()}").touch()
            signal.pause()
        while not any(FOLDER.glob("fork*")):
            time.sleep(0.01)
        os._exit(4)

class Faults(Drives):
    def command(self, scan, pose, goal):
        os.kill(os.getpid(), signal.SIGSEGV)
"""
pytestmark = pytest.mark.usefixtures("forked")


@pytest.fixture
def suite(scenario, room):
    """Returns the runs of controllers, and a plan."""
    (room / "own.py").write_text(CONTROLLERS)

    def suite(names, seeds=(1,), limits=None, workers=2, text="limits: {time: 3}", **plan):
        found = scenario(text + "\nrequire: [no contact]")
        runs = runs_of([found], [n if n in ("gap",) else f"own.py:{n}" for n in names], seeds)
        options = Options(str(room), str(room / "out"))
        return runs, Plan(options, limits or WorkerLimits(), workers, **plan)

    return suite


def carry_out(runs, plan, **more):
    found = run_in_processes(runs, plan.options, plan.limits, plan.workers, **more)
    return {key_of(result.row): result for result in found}


def test_results_do_not_depend_on_the_number_of_processes(suite):
    text = "start: random\ngoal: random\nlimits: {time: 3}"
    found = []
    for workers in (1, 3):
        runs, plan = suite(["gap", "Drives"], seeds=range(4), workers=workers, text=text)
        results = carry_out(runs, plan)
        assert len(results) == 8
        found.append(
            {
                key: (
                    {name: v for name, v in result.row.items() if name not in TIMING},
                    result.path,
                    result.goals,
                )
                for key, result in results.items()
            }
        )
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("name", "limits", "message"),
    [
        ("Hangs", WorkerLimits(command_time=0.3), "a call of the controller took more than 0.3 s"),
        ("HangsAtStart", WorkerLimits(command_time=0.3), "a call of the controller took more than"),
        ("Hangs", WorkerLimits(run_time=0.5), "the run took more than 0.5 s of wall time"),
        ("Floods", WorkerLimits(memory=200 << 20), "the run needed more memory than its limit"),
    ],
)
def test_a_run_that_must_be_ended_is_an_error(name, limits, message, suite, room):
    runs, plan = suite([name], limits=limits)
    (result,) = carry_out(runs, plan).values()
    assert result.row["outcome"] == "error"
    assert message in result.row["error"]
    assert not result.row["passed"]
    if result.recording:
        assert (room / "out" / result.recording).is_file()


def test_a_run_that_ends_its_process_is_an_error_and_does_not_affect_others(suite):
    runs, plan = suite(["Dies", "Drives", "Faults"])
    results = carry_out(runs, plan)
    dies, drives, faults = (results[run.key].row for run in runs)
    assert drives["passed"]
    assert "ended in each of 3 attempts (exit code 3)" in dies["error"]
    assert f"(signal {int(signal.SIGSEGV)})" in faults["error"]
    assert (dies["outcome"], dies["passed"]) == ("error", False)


def commands() -> list[bytes]:
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(file.read_bytes())
        except OSError:  # it has ended
            continue
    return found


def test_what_a_controller_starts_ends_with_the_suite(suite):
    runs, plan = suite(["Forks"], text="limits: {time: 1}")
    (result,) = carry_out(runs, plan).values()
    assert result.row["passed"], result.row["error"]
    assert not any(b"987654.5" in command for command in commands())


def test_a_fork_does_not_hide_the_end_of_a_worker(suite, room):
    # Without a limit of a call, which a worker that has ended would exceed.
    runs, plan = suite(["ForksAndDies"], limits=WorkerLimits(command_time=1e6), workers=1)
    (result,) = carry_out(runs, plan).values()
    assert "the worker process ended in each of 3 attempts (exit code 4)" in result.row["error"]
    forks = [int(file.name.removeprefix("fork")) for file in room.glob("fork*")]
    assert forks
    wait_until("the forks have ended", lambda: all(map(has_ended, forks)))


def test_a_run_whose_worker_is_killed_is_made_again(suite, room):
    runs, plan = suite(["DiesOnce"], seeds=(0, 1, 2))
    results = carry_out(runs, plan)
    killed = (room / "died1").read_text()
    assert [result.row["passed"] for result in results.values()] == [True] * 3
    assert not results[runs[1].key].row["worker"].endswith(f":{killed}")


@pytest.mark.parametrize("is_shown", [False, True])
def test_what_a_controller_prints_is_dropped_or_shown(is_shown, suite, capfd, monkeypatch):
    # The streams of forked workers are not those of this test.
    spawn = multiprocessing.get_context("spawn")
    monkeypatch.setattr("flatland.scenarios.workers._CONTEXT", spawn)
    runs, plan = suite(["Prints"], limits=WorkerLimits(shows_output=is_shown))
    assert carry_out(runs, plan)[runs[0].key].row["passed"]
    assert ("xxxx" in capfd.readouterr().out) == is_shown


def has_ended(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False


def test_the_processes_end_with_the_suite(suite):
    runs, plan = suite(["Drives"], seeds=range(6))
    workers = set()
    for result in run_in_processes(runs, plan.options, plan.limits, 2):
        workers.add(int(result.row["worker"].rpartition(":")[2]))
        break
    wait_until("the workers have ended", lambda: all(map(has_ended, workers)))


def test_an_interrupted_suite_is_continued(suite):
    runs, plan = suite(["Drives"], seeds=range(5), workers=1)
    done = []
    partial = run_suite(
        runs, plan, is_stopped=lambda: len(done) >= 2, on_result=lambda r: done.append(r.row)
    )
    assert 2 <= len(partial.results) < 5
    assert partial.missing == 5 - len(partial.results)
    _, continued = suite(["Drives"], seeds=range(5), continues=True)
    complete = run_suite(runs, continued)
    assert complete.missing == 0
    assert [row["seed"] for row in complete.rows] == [0, 1, 2, 3, 4]
    # Results from before were kept.
    times = {row["seed"]: row["wall_time"] for row in complete.rows}
    assert all(times[row["seed"]] == row["wall_time"] for row in done)


def test_results_of_another_suite_are_not_continued(suite):
    runs, plan = suite(["Drives"], seeds=range(2), workers=1)
    done = []
    run_suite(runs, plan, is_stopped=lambda: done, on_result=done.append)
    _, continued = suite(["Drives"], continues=True)
    with pytest.raises(ResultsError, match="has results of other scenarios"):
        run_suite(runs[:1], continued)


def test_damaged_results_are_not_continued(suite, room):
    runs, plan = suite(["Drives"], seeds=range(2), workers=1)
    done = []
    run_suite(runs, plan, is_stopped=lambda: done, on_result=done.append)
    journal = room / "out" / "unfinished.jsonl"
    head, entry = journal.read_text().splitlines()
    _, continued = suite(["Drives"], seeds=range(2), workers=1, continues=True)
    for lines, message in (
        (f"{head}\n{{\n{entry}\n", r"unfinished\.jsonl:2 cannot be read"),
        (f"{head}\n5\n", r"unfinished\.jsonl:2 must be a map, got 5"),
        (f'{head}\n{{"row": {{}}}}\n', r"unfinished\.jsonl:2\.row\.scenario is missing"),
        (f"{head}\n{entry.replace(chr(34) + 'own.py', chr(34) + 'x.py')}\n", "not part of this"),
        (f"{entry}\n", "has results of other scenarios"),
        ("[1]\n", "has results of other scenarios"),
    ):
        journal.write_text(lines)
        with pytest.raises(ResultsError, match=message):
            run_suite(runs, continued)
    # A process that was killed, or a full disk, cuts the last line; a line may exist twice.
    journal.write_text(f"{head}\n{entry}\n{entry}\n{entry[:50]}")
    complete = run_suite(runs, continued)
    assert [row["seed"] for row in complete.rows] == [0, 1]


def test_a_full_disk_ends_a_suite_that_can_be_continued(suite, room):
    runs, plan = suite(["Drives"], seeds=range(3), workers=1)

    def stop_writing(_result):
        limit.enter_context(limited_files((room / "out" / "unfinished.jsonl").stat().st_size + 9))

    with ExitStack() as limit, pytest.raises(ResultsError, match=REASON) as caught:
        run_suite(runs, plan, on_result=stop_writing)
    assert "unfinished.jsonl cannot be written" in str(caught.value)
    assert "--continue" in caught.value.hint
    _, continued = suite(["Drives"], seeds=range(3), workers=1, continues=True)
    assert [row["seed"] for row in run_suite(runs, continued).rows] == [0, 1, 2]


def test_a_suite_needs_runs_with_different_names(suite):
    runs, plan = suite(["Drives"])
    with pytest.raises(SuiteError, match="there are no runs"):
        run_suite([], plan)
    with pytest.raises(SuiteError, match="two scenario files have the same name"):
        run_suite([*runs, Run(runs[0].scenario, runs[0].controller, runs[0].seed)], plan)
