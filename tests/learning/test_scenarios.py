"""Scenarios on a Ray cluster, with workers and nodes that are killed."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent

import pandas as pd
import pytest
from waiting import TIMEOUT, wait_until

import flatland
from flatland.scenarios.columns import KEY, TIMING

SIMPLE = Path(__file__).resolve().parents[2] / "worlds" / "simple"
PACKAGE = Path(flatland.__file__).resolve().parent
SUITE_TIMEOUT = 240.0  # s
SCENARIO = """
    world: world.yaml
    start: random
    goal: {distance: 1}
    seeds: 0:3
    limits: {time: 30}
"""
# Ends its process at the first attempt of seed 1.
KILLER = """
    import os
    import signal
    from pathlib import Path

    from flatland.scenarios.controllers import PurePursuit

    FLAG = Path(__file__).with_name("killed")

    class Killer(PurePursuit):
        def __init__(self, task):
            super().__init__(task)
            self.seed = task.world.seed

        def command(self, scan, pose, goal):
            if self.seed == 1 and not FLAG.exists():
                FLAG.write_text(str(os.getpid()))
                os.kill(os.getpid(), signal.SIGKILL)
            return super().command(scan, pose, goal)

    class Incurable(Killer):
        def command(self, scan, pose, goal):
            if self.seed == 1:
                os.kill(os.getppid() if FLAG.exists() else os.getpid(), signal.SIGKILL)
            return super().command(scan, pose, goal)
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a scenario and controllers."""
    folder = tmp_path / "project"
    shutil.copytree(SIMPLE, folder)
    (folder / "s.yaml").write_text(dedent(SCENARIO))
    (folder / "killer.py").write_text(dedent(KILLER))
    return folder


def environment() -> dict[str, str]:
    """Returns the environment of a suite."""
    # The cluster of the fixture would send statistics of its use.
    return {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "RAY_USAGE_STATS_ENABLED": "0"}


def start(*arguments: str, folder: Path) -> subprocess.Popen[str]:
    """Starts `flatland test` in a folder."""
    return subprocess.Popen(
        [sys.executable, "-m", "flatland", "test", *arguments],
        cwd=folder,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        # A shell ignores this signal on behalf of the programs that it starts in the background.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def run(*arguments: str, folder: Path, out: str, code: int = 0) -> pd.DataFrame:
    """Runs `flatland test` in a folder, and returns the rows."""
    with start(*arguments, "--out", out, folder=folder) as process:
        output, _ = process.communicate(timeout=SUITE_TIMEOUT)
    assert process.returncode == code, output
    return read(folder / out)


def read(out: Path) -> pd.DataFrame:
    frame = pd.read_parquet(out / "results.parquet")
    return frame.sort_values(list(KEY)).reset_index(drop=True)


def assert_same(a: pd.DataFrame, b: pd.DataFrame) -> None:
    """Checks that two suites have the same results, bit by bit."""
    timing = list(TIMING)
    pd.testing.assert_frame_equal(a.drop(columns=timing), b.drop(columns=timing), check_exact=True)


def test_ray_and_processes_have_the_same_results(project):
    run_of = ("s.yaml", "--robot", "pursuit,random", "--record", "all")
    by_ray = run(*run_of, "--ray", "--workers", "2", folder=project, out="a", code=1)
    by_processes = run(*run_of, "--workers", "1", folder=project, out="b", code=1)
    assert len(by_ray) == 6
    assert_same(by_ray, by_processes)
    names = {path.name for path in (project / "b" / "recordings").iterdir()}
    assert {path.name for path in (project / "a" / "recordings").iterdir()} == names
    for name in names:
        command = [sys.executable, "-m", "flatland", "replay", f"a/recordings/{name}"]
        subprocess.run(command, cwd=project, env=environment(), check=True, timeout=TIMEOUT)


def test_a_worker_killed_in_the_middle_changes_no_result(project):
    run_of = ("s.yaml", "--robot", "pursuit,killer.py:Killer")
    disturbed = run(*run_of, "--ray", "--workers", "2", folder=project, out="a")
    killed = (project / "killed").read_text()
    assert not disturbed["worker"].str.endswith(f":{killed}").any()
    undisturbed = run(*run_of, folder=project, out="b")
    assert_same(disturbed, undisturbed)


def test_a_run_that_always_kills_its_worker_is_an_error(project):
    run_of = ("s.yaml", "--robot", "killer.py:Incurable", "--seeds", "0:4", "--workers", "1")
    (project / "killed").write_text("")  # Kills the process of Ray as well.
    frame = run(*run_of, "--ray", folder=project, out="a", code=1)
    failed = frame[frame["outcome"] == "error"]
    assert failed["seed"].tolist() == [1]
    assert "attempts" in failed["error"].item()


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


def test_a_node_that_fails_changes_no_result(cluster, project, tmp_path):
    address = answer(cluster, "address ")
    # The files are copied to the nodes.
    run_of = ("project/s.yaml", "--robot", "pursuit,killer.py:Killer", "--seeds", "0:60")
    copied = ("--ray", address, "--working-dir", "project", "--out", str(tmp_path / "a"))
    journal = tmp_path / "a" / "unfinished.jsonl"
    with start(*run_of, *copied, folder=tmp_path) as process:
        wait_until(
            "the first results",
            lambda: journal.exists() and len(journal.read_text().splitlines()) > 1,
        )
        assert cluster.stdin is not None
        print("remove", file=cluster.stdin, flush=True)
        answer(cluster, "removed")
        assert len(journal.read_text().splitlines()) - 1 < 120
        output, _ = process.communicate(timeout=SUITE_TIMEOUT)
    assert process.returncode == 0, output
    undisturbed = run("s.yaml", *run_of[1:], folder=project, out="b")
    assert_same(read(tmp_path / "a"), undisturbed)


@pytest.fixture
def clone(project: Path) -> Path:
    """The beginning of a clone without the extension, in the folder of a suite."""
    (project / "flatland").mkdir()
    for name in ("__init__.py", "requirements.py", "version.py"):
        shutil.copy(PACKAGE / name, project / "flatland" / name)
    return project


def test_workers_find_the_installed_package_in_a_clone(clone):
    command = [sys.executable, "-P", "-m", "flatland", "test", "s.yaml", "--robot", "pursuit"]
    subprocess.run(
        [*command, "--ray", "--out", "a"],
        cwd=clone,
        env=environment(),
        check=True,
        timeout=SUITE_TIMEOUT,
    )
    assert len(read(clone / "a")) == 3


@pytest.fixture
def unused_port() -> int:
    """A TCP port of this machine that no program uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("127.0.0.1:{port}", "Ray cannot be reached at 127.0.0.1:{port}"),
        ("localhost", "the address must be auto or HOST:PORT, got 'localhost'"),
    ],
)
def test_a_cluster_that_does_not_exist_is_reported(
    address: str, message: str, unused_port: int, project: Path
) -> None:
    address = address.format(port=unused_port)
    with start("s.yaml", "--ray", address, folder=project) as process:
        output, _ = process.communicate(timeout=SUITE_TIMEOUT)
    assert process.returncode == 1, output
    assert message.format(port=unused_port) in output
