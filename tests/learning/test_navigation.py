"""Tests of examples/learning, which require the extra `learning`: for `make test-learning`."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import evaluate
import numpy as np
import pytest
import train_navigate
from free_ports import free_port
from navigation import make_many, make_one
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env

import flatland
from flatland.gym import FlatlandVectorEnv
from flatland.gym.stable_baselines import StableVector

FOLDER = Path(evaluate.__file__).resolve().parent
WORLD = FOLDER.parents[1] / "worlds" / "learning" / "navigate.yaml"
EPISODES = 20

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a training of about a minute."""
    path = tmp_path_factory.mktemp("policy") / "navigate.zip"
    command = [sys.executable, str(FOLDER / "train_navigate.py"), "--minutes", "1"]
    subprocess.run([*command, "--episodes", "64", "--output", str(path)], check=True)
    return path


@pytest.fixture
def simulator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The node in lockstep, with a master of its own."""
    port = free_port()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    command = ["roslaunch", "-p", str(port), "flatland", "server.launch", f"world_path:={WORLD}"]
    log = (tmp_path / "roslaunch.log").open("wb")
    process = subprocess.Popen(
        [*command, "show_viz:=false", "lockstep:=true"],
        stdout=log,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
        log.close()


def test_stable_baselines_accepts_the_environment() -> None:
    env = make_one()
    check_env(env)
    env.close()


def test_the_vector_ends_episodes_as_stable_baselines_expects() -> None:
    envs = StableVector(make_many(4, max_steps=3))
    envs.seed(1)
    observations = envs.reset()
    still = np.full((4, 2), -1.0, np.float32)
    still[:, 1] = 0.0
    for _ in range(2):
        observations, _, ended, _ = envs.step(still)
        assert not ended.any()
    following, _, ended, infos = envs.step(still)
    assert ended.all()
    for row, info in enumerate(infos):
        assert info["TimeLimit.truncated"]
        assert info["episode"]["l"] == 3
        # Robots that stand still see the same as before; the next episode is elsewhere.
        np.testing.assert_allclose(info["terminal_observation"], observations[row], atol=0.05)
        assert abs(following[row] - observations[row]).max() > 0.1
    envs.close()
    with pytest.raises(ValueError, match="SAME_STEP"):
        StableVector(FlatlandVectorEnv(1, autoreset_mode="NextStep"))


def test_options_of_the_vector_apply_to_the_next_reset() -> None:
    envs = StableVector(make_many(3))
    goals = [(-3.0, -3.5), (-2.0, -5.0)]
    envs.seed(1)
    envs.set_options([{"start": (-3, -5.5, 1), "goal": goals[0]}, {"goal": goals[1]}, {}])
    envs.reset()
    assert envs.envs.poses[0] == pytest.approx((-3, -5.5, 1))
    np.testing.assert_array_equal(envs.envs.goals[:2], goals)
    assert tuple(envs.envs.goals[2]) not in goals
    envs.reset()
    assert (envs.envs.goals[:2] != goals).all()
    envs.set_options({"goal": (60.0, 0.0)})
    with pytest.raises(flatland.WorldError, match=r"environment 0: the goal .* outside"):
        envs.reset()
    for options, message in (({"aim": (1, 1)}, "got aim"), ({"goal": "x"}, "environment 0 must")):
        envs.set_options(options)
        with pytest.raises(ValueError, match=message):
            envs.reset()
    envs.close()


def test_training_improves_the_policy(policy: Path) -> None:
    with policy.with_suffix(".csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["return"]) > float(rows[0]["return"]) + 0.5
    assert policy.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    trained = train_navigate.success_rate(PPO.load(policy, device="cpu"), 128)
    untrained = train_navigate.success_rate(PPO("MlpPolicy", make_one(), seed=0, device="cpu"), 128)
    assert trained[0] > untrained[0] + 0.2


def test_the_table_compares_the_policy_with_the_controllers(
    policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evaluate.print_table(PPO.load(policy, device="cpu"), 64)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[2:]] == ["straight", "gap", "window", "policy"]
    rates = [[float(rate.rstrip("%")) for rate in line.split()[1:4]] for line in lines[2:]]
    assert [sum(row) for row in rates] == pytest.approx([100] * 4, abs=0.2)
    assert rates[1][1] == rates[2][1] == 0.0


@pytest.mark.usefixtures("simulator")
def test_the_policy_does_over_ros_what_it_does_in_python(policy: Path) -> None:
    model = PPO.load(policy, device="cpu")
    in_python = evaluate.run_in_python(model, EPISODES)
    over_ros = evaluate.run_over_ros(model, EPISODES)
    # The first scan over ROS is that of a robot that has stood still for a step, and a command may
    # arrive a step late: some episodes end differently.
    agreeing = sum(one[0] == other[0] for one, other in zip(in_python, over_ros, strict=True))
    assert agreeing >= 0.7 * EPISODES
