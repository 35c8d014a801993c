#!/usr/bin/env python3
r"""Runs a trained policy in plain Python, or on the ROS node in lockstep, and counts its successes.

Both use the same episodes. For ROS, start the simulator first:
  roslaunch flatland server.launch show_viz:=false lockstep:=true \
    world_path:=$(rospack find flatland)/worlds/learning/navigate.yaml
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from navigation import EVALUATION_SEED, arguments, make_one
from stable_baselines3 import PPO

Outcome = tuple[bool, bool]
"""Whether the goal was reached, and whether the robot touched something."""


def episodes(count: int) -> Iterator[tuple[Any, Sequence[float], Sequence[float]]]:
    """Yields the environment at the start of each episode, with the start and the goal."""
    env = make_one()
    for i in range(count):
        observation, _ = env.reset(seed=EVALUATION_SEED + i)
        yield (env, observation), env.world.model("robot").pose, env.goal
    env.close()


def run_in_python(model: Any, count: int) -> list[Outcome]:
    """Runs episodes in the environment."""
    outcomes = []
    for (env, observation), _, _ in episodes(count):
        terminated = truncated = False
        info: dict[str, Any] = {}
        while not (terminated or truncated):
            action, _ = model.predict(observation, deterministic=True)
            observation, _, terminated, truncated, info = env.step(action)
        outcomes.append((info["is_success"], info["collision"]))
    return outcomes


def run_over_ros(model: Any, count: int) -> list[Outcome]:
    """Runs the same episodes on the node."""
    import rospy
    from ros_robot import RosRobot

    from flatland.gym import Settings

    rospy.init_node("evaluate", anonymous=True, disable_signals=True)
    settings = Settings(**arguments())
    robot: RosRobot | None = None
    outcomes = []
    for (env, _), start, goal in episodes(count):
        robot = robot or RosRobot(settings, settings.find_agent(env.world))
        observation = robot.reset(start, goal)
        arrived = touched = False
        for _ in range(settings.max_steps):
            action, _ = model.predict(observation, deterministic=True)
            observation, arrived, touched = robot.step(action)
            if arrived or touched:
                break
        outcomes.append((arrived, touched))
    return outcomes


def main() -> None:
    """Runs the policy and prints the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("policy", type=Path, help="file of train_navigate.py")
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--ros", action="store_true", help="on the ROS node")
    options = parser.parse_args()
    model = PPO.load(options.policy, device="cpu")
    run: Callable[[Any, int], list[Outcome]] = run_over_ros if options.ros else run_in_python
    outcomes = run(model, options.episodes)
    for i, (success, collision) in enumerate(outcomes):
        print(i, "goal" if success else "collision" if collision else "time limit")
    rate = sum(success for success, _ in outcomes) / len(outcomes)
    print(f"success {rate:.1%} of {len(outcomes)} episodes")


if __name__ == "__main__":
    main()
