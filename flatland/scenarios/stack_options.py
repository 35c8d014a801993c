"""How ROS nodes are controllers: what they are started by, and what they receive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Pace = Literal["lockstep", "real-time"]
PACES: Final[tuple[Pace, ...]] = ("lockstep", "real-time")
Localization = Literal["true", "stack"]
LOCALIZATIONS: Final[tuple[Localization, ...]] = ("true", "stack")
RosVersion = Literal[1, 2]


@dataclass(frozen=True, slots=True)
class StackOptions:
    """What all stacks of a suite have in common.

    Attributes:
        pace: Whether the simulated time waits for the commands of each period.
        localization: Whether the simulator sends the transform from the map to the frame of the
            odometry, or the stack does.
        goal_topic: Topic of the goals, unless there is an action; empty for the usual one, which is
            `move_base_simple/goal` in ROS 1 and `goal_pose` in ROS 2.
        goal_action: Action of the goals, such as `move_base` in ROS 1 and `navigate_to_pose` in
            ROS 2; empty for the topic.
        start_time: Wall time until the stack is ready [s].
        stamped_commands: Whether commands are `geometry_msgs/TwistStamped`, in ROS 2 only.
    """

    pace: Pace = "lockstep"
    localization: Localization = "true"
    goal_topic: str = ""
    goal_action: str = ""
    start_time: float = 60.0
    stamped_commands: bool = False


@dataclass(frozen=True, slots=True)
class StackCommand:
    """What starts a stack.

    Attributes:
        program: Path and arguments of the program.
        file: Path of the launch file; empty for another program.
        folder: The folder that it is started in.
        ros: Version of ROS of the nodes.
    """

    program: tuple[str, ...]
    file: str
    folder: str
    ros: RosVersion
