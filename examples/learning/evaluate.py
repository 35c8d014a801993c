#!/usr/bin/env python3
r"""Runs a policy in plain Python, or on the ROS node in lockstep, and counts its successes.

With --table, the controllers of flatland.gym and the policy are compared, also among people and in
random offices.

Without a file, the policy is the included one. All use the same episodes. For ROS, start the
simulator first:
  roslaunch flatland server.launch show_viz:=false lockstep:=true \
    world_path:=$(rospack find flatland)/worlds/learning/navigate.yaml
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from navigation import EVALUATION_SEED, TASKS, evaluate_on, rates

from flatland.gym import FlatlandEnv, Settings
from flatland.gym.controllers import CONTROLLERS
from flatland.gym.policies import Policy

Outcome = tuple[bool, bool]
"""Whether the goal was reached, and whether the robot touched something."""


def episodes(count: int) -> Iterator[tuple[Any, Sequence[float], Sequence[float]]]:
    """Yields the environment at the start of each episode, with the start and the goal."""
    env = FlatlandEnv()
    for i in range(count):
        observation, _ = env.reset(seed=EVALUATION_SEED + i)
        yield (env, observation), env.world.model("robot").pose, env.goal
    env.close()


def run_in_python(policy: Policy, count: int) -> list[Outcome]:
    """Runs episodes in the environment."""
    outcomes = []
    for (env, observation), _, _ in episodes(count):
        policy.reset()
        terminated = truncated = False
        info: dict[str, Any] = {}
        while not (terminated or truncated):
            observation, _, terminated, truncated, info = env.step(policy(observation))
        outcomes.append((info["is_success"], info["collision"]))
    return outcomes


def run_over_ros(policy: Policy, count: int) -> list[Outcome]:
    """Runs the same episodes on the node."""
    import rospy
    from ros_robot import RosRobot

    rospy.init_node("evaluate", anonymous=True, disable_signals=True)
    settings = Settings()
    robot: RosRobot | None = None
    outcomes = []
    for (env, _), start, goal in episodes(count):
        robot = robot or RosRobot(settings, settings.find_agent(env.world))
        observation = robot.reset(start, goal)
        policy.reset()
        arrived = touched = False
        for _ in range(settings.max_steps or 0):
            observation, arrived, touched = robot.step(policy(observation))
            if arrived or touched:
                break
        outcomes.append((arrived, touched))
    return outcomes


def print_table(file: Path | None, count: int, tasks: Iterable[str] = TASKS) -> None:
    """Runs the same episodes with all controllers and a policy, and prints their rates.

    Args:
        file: File of the policy, None for the included one.
        count: Number of episodes; fewer among people.
        tasks: What they are compared on, keys of `TASKS`.
    """
    makers: dict[str, Callable[[Any], Callable[[Any], Any]]] = {
        **CONTROLLERS,
        "policy": lambda envs: Policy(file, envs),
    }
    print("task                  controller   goal   coll.  other  steps to the goal")
    for task in tasks:
        for name, make in makers.items():
            print(f"{task:20s}  {name:10s} {rates(evaluate_on(task, make, count))}", flush=True)


def main() -> None:
    """Runs the policy and prints the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "policy", type=Path, nargs="?", help="file of train_navigate.py (default: the included one)"
    )
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--ros", action="store_true", help="on the ROS node")
    parser.add_argument("--table", action="store_true", help="compare with the controllers")
    options = parser.parse_args()
    if options.table and options.ros:
        parser.error("--table is not possible with --ros")
    if options.table:
        print_table(options.policy, options.episodes)
        return
    run = run_over_ros if options.ros else run_in_python
    outcomes = run(Policy(options.policy), options.episodes)
    for i, (success, collision) in enumerate(outcomes):
        print(i, "goal" if success else "collision" if collision else "time limit")
    rate = sum(success for success, _ in outcomes) / len(outcomes)
    print(f"success {rate:.1%} of {len(outcomes)} episodes")


if __name__ == "__main__":
    main()
