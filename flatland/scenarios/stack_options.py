"""How ROS nodes are controllers: what they are started by, and what they receive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Pace = Literal["lockstep", "real-time"]
PACES: Final[tuple[Pace, ...]] = ("lockstep", "real-time")
Localization = Literal["true", "stack"]
LOCALIZATIONS: Final[tuple[Localization, ...]] = ("true", "stack")
GOAL_TOPIC: Final = "move_base_simple/goal"


@dataclass(frozen=True, slots=True)
class StackOptions:
    """What all stacks of a suite have in common.

    Attributes:
        pace: Whether the simulated time waits for the commands of each period.
        localization: Whether the simulator sends the transform from the map to the frame of the
            odometry, or the stack does.
        goal_topic: Topic of the goals, unless there is an action.
        goal_action: Action of the goals, such as `move_base`; empty for the topic.
        start_time: Wall time until the stack is ready [s].
    """

    pace: Pace = "lockstep"
    localization: Localization = "true"
    goal_topic: str = GOAL_TOPIC
    goal_action: str = ""
    start_time: float = 60.0


@dataclass(frozen=True, slots=True)
class StackCommand:
    """What starts a stack.

    Attributes:
        program: Path and arguments of the program.
        file: Path of the launch file; empty for another program.
        folder: The folder that it is started in.
    """

    program: tuple[str, ...]
    file: str
    folder: str
