"""Tests of examples/learning, which require the extra `learning`: for `make test-learning`."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import evaluate
import numpy as np
import onnxruntime
import pytest
import torch
from free_ports import free_port
from navigation import NAME, TrainingBuildings
from network import Network
from stable_baselines3.common.env_checker import check_env
from teacher import Teacher
from train_navigate import Training

import flatland
from flatland.gym import FlatlandEnv, FlatlandVectorEnv
from flatland.gym import evaluate as rates_of
from flatland.gym.policies import INCLUDED, Policy
from flatland.gym.stable_baselines import StableVector

FOLDER = Path(evaluate.__file__).resolve().parent
WORLD = FOLDER.parents[1] / "worlds" / "learning" / "navigate.yaml"
EPISODES = 8

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a short training."""
    path = tmp_path_factory.mktemp("policy") / "navigate.onnx"
    command = [sys.executable, str(FOLDER / "train_navigate.py"), "--rounds", "4"]
    subprocess.run([*command, "--episodes", "4", "--output", str(path)], check=True)
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
    env = FlatlandEnv()
    check_env(env)
    env.close()


def test_the_vector_ends_episodes_as_stable_baselines_expects() -> None:
    envs = StableVector(FlatlandVectorEnv(4, autoreset_mode="SameStep", max_steps=3))
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
    envs = StableVector(FlatlandVectorEnv(3, autoreset_mode="SameStep"))
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


@pytest.fixture
def envs() -> Iterator[FlatlandVectorEnv]:
    vector = FlatlandVectorEnv(16, TrainingBuildings(5, 500), autoreset_mode="SameStep")
    yield vector
    vector.close()


def test_the_teacher_leaves_dead_ends(envs: FlatlandVectorEnv) -> None:
    network, teacher = Network(envs), Teacher(envs)

    def choose(observations: np.ndarray) -> np.ndarray:
        headings = torch.from_numpy(teacher.headings(observations)).float()
        return network.drive(torch.from_numpy(observations), headings).numpy()

    assert rates_of(choose, envs, 64, seed=1).success_rate >= 0.95
    teacher.close()


def test_left_and_right_are_exchanged(envs: FlatlandVectorEnv) -> None:
    network = Network(envs)
    observations = torch.from_numpy(envs.reset(seed=1)[0])
    # The first beam points backwards, the others are symmetric.
    scan = torch.cat((observations[:, :1], observations[:, 1:180].flip(1)), 1)
    signs = torch.tensor((1.0, 1.0, -1.0, 1.0, -1.0))
    other = torch.cat((scan, observations[:, 180:] * signs), 1)
    (features, frames), (expected, opposite) = map(network.features, (observations, other))
    assert torch.allclose(network.mirrored(features), expected, atol=1e-5)
    assert torch.allclose(frames, -opposite)


def test_a_training_repeats() -> None:
    def weights() -> list[torch.Tensor]:
        training = Training(3, 1, 4, TrainingBuildings(5))
        training.run()
        return list(training.network.parameters())

    for one, other in zip(weights(), weights(), strict=True):
        assert torch.equal(one, other)


def test_a_short_training_learns(policy: Path) -> None:
    with policy.with_suffix(".csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["steps"]) for row in rows] == [4096, 8192, 12288, 16384]
    assert float(rows[-1]["loss"]) < float(rows[0]["loss"]) - 0.3
    assert policy.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    outcomes = evaluate.run_in_python(Policy(policy), 16)
    assert sum(success for success, _ in outcomes) >= 13


def test_the_file_equals_the_network(policy: Path, tmp_path: Path) -> None:
    training = Training(1, 1, 8, TrainingBuildings(2))
    training.run()
    path = tmp_path / "navigate.onnx"
    training.write(path)
    envs = FlatlandVectorEnv(8, autoreset_mode="SameStep")
    policy_of_file = Policy(path, envs)
    observations, _ = envs.reset(seed=2)
    state = torch.zeros(8, 2)
    for _ in range(20):
        with torch.no_grad():
            expected, state = training.network(torch.from_numpy(observations), state)
        actions = policy_of_file(observations)
        np.testing.assert_allclose(actions, expected.numpy(), atol=1e-5)
        observations, _, terminated, truncated, _ = envs.step(actions)
        ended = terminated | truncated
        state[torch.from_numpy(ended)] = 0.0
        policy_of_file.reset(ended)
    envs.close()


def test_the_table_compares_the_policy_with_the_controllers(
    policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evaluate.print_table(policy, 8, [NAME])
    lines = capsys.readouterr().out.splitlines()[1:]
    names = [line.removeprefix(NAME).split()[0] for line in lines]
    assert names == ["straight", "gap", "window", "policy"]
    for line in lines:
        rates = [float(word.rstrip("%")) for word in line.split() if word.endswith("%")]
        assert sum(rates) == pytest.approx(100, abs=0.2)


class Comparison:
    """A policy that compares each action on the node with those of other consumers of the file.

    The robot of an environment is moved to the pose of the robot on the node, at its velocity.
    """

    def __init__(self) -> None:
        self.env = FlatlandEnv()
        self.in_env, self.on_node = Policy(), Policy()
        self.session = onnxruntime.InferenceSession(str(INCLUDED))
        self.robot: Any = None
        self.reset()

    def reset(self) -> None:
        self.in_env.reset()
        self.on_node.reset()
        self.state = np.zeros((1, 2), np.float32)

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        s = self.robot._situation
        self.env.reset(options={"start": s.poses[0], "goal": s.goals[0]})
        self.env.world.model("robot").bodies[0].physics.set_velocity(*s.velocities[0])
        self.env.episodes.look()
        here = self.env.episodes.observations[0].copy()
        action = self.on_node(observation)
        np.testing.assert_allclose(self.in_env(here), action, atol=1e-5)
        plain, self.state = self.session.run(
            ("action", "next_state"), {"observation": here[np.newaxis], "state": self.state}
        )
        np.testing.assert_allclose(plain[0], action, atol=1e-5)
        return action


@pytest.mark.usefixtures("simulator")
def test_the_policy_does_over_ros_what_it_does_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    import ros_robot

    comparison = Comparison()

    class Observed(ros_robot.RosRobot):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            comparison.robot = self

    monkeypatch.setattr(ros_robot, "RosRobot", Observed)
    over_ros = evaluate.run_over_ros(comparison, EPISODES)  # type: ignore[arg-type]
    comparison.env.close()
    in_python = evaluate.run_in_python(Policy(), EPISODES)
    for outcomes in (over_ros, in_python):
        # A command may arrive a step late, so that single episodes end differently.
        assert sum(success for success, _ in outcomes) >= EPISODES - 1
        assert not any(touched for _, touched in outcomes)
