#!/usr/bin/env python3
r"""Runs a trained policy in plain Python, or on the ROS node in lockstep, and counts its successes.

With --table, the controllers of flatland.gym and the policy, if one is given, are compared.

All use the same episodes. For ROS, start the simulator first:
  roslaunch flatland server.launch show_viz:=false lockstep:=true \
    world_path:=$(rospack find flatland)/worlds/learning/navigate.yaml
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from navigation import EVALUATION_SEED, NAME, actions_of, arguments, make_many, make_one

from flatland.gym import evaluate, make_vec
from flatland.gym.controllers import CONTROLLERS

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


def print_table(model: Any, count: int) -> None:
    """Runs the same episodes with all controllers and a policy, and prints their rates.

    Args:
        model: The policy, None for the controllers only.
        count: Number of episodes.
    """
    print(f"{count} episodes of {NAME}")
    print("controller  goal    collision  other   steps to the goal")
    for name in [*CONTROLLERS, *(["policy"] if model is not None else [])]:
        if name == "policy":
            envs = make_many(64)
            choose = actions_of(model)
        else:
            envs = make_vec(NAME, 64, autoreset_mode="SameStep")
            choose = CONTROLLERS[name](envs)
        found = evaluate(choose, envs, count, EVALUATION_SEED)
        envs.close()
        rates = found.success_rate, found.collision_rate, found.rest_rate
        print("{:10s}  {:6.1%}  {:9.1%}  {:6.1%}".format(name, *rates), end="")
        print(f"  {found.mean_steps:17.0f}", flush=True)


def main() -> None:
    """Runs the policy and prints the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("policy", type=Path, nargs="?", help="file of train_navigate.py")
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--ros", action="store_true", help="on the ROS node")
    parser.add_argument("--table", action="store_true", help="compare with the controllers")
    options = parser.parse_args()
    if options.policy is None and not options.table:
        parser.error("a policy is required, except with --table")
    if options.table and options.ros:
        parser.error("--table is not possible with --ros")
    model: Any = None
    if options.policy is not None:
        from stable_baselines3 import PPO  # not required for the controllers

        model = PPO.load(options.policy, device="cpu")
    if options.table:
        print_table(model, options.episodes)
        return
    run: Callable[[Any, int], list[Outcome]] = run_over_ros if options.ros else run_in_python
    outcomes = run(model, options.episodes)
    for i, (success, collision) in enumerate(outcomes):
        print(i, "goal" if success else "collision" if collision else "time limit")
    rate = sum(success for success, _ in outcomes) / len(outcomes)
    print(f"success {rate:.1%} of {len(outcomes)} episodes")


if __name__ == "__main__":
    main()
