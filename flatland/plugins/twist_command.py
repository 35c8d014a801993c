"""The velocity command of a drive."""

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING

from flatland.values import Twist

if TYPE_CHECKING:
    from flatland.plugin import ModelPlugin
    from flatland.ports import Command

_LOG = logging.getLogger("flatland")

WARNING_PERIOD = 1.0  # s of wall time between two warnings of one drive
# No robot gets there, and what a drive makes of it stays within the bounds of the physics.
MAX_COMMAND = 1e6


class TwistGuard:
    """Refuses commands that are no numbers, so that the last good one stays."""

    def __init__(self, owner: str) -> None:
        """Names the drive in its warnings.

        Args:
            owner: For the log, such as `plugin "drive" of model "robot"`.
        """
        self._owner = owner
        self._last_warning = -math.inf

    def __call__(self, twist: Twist) -> bool:
        """Tells whether a command may be followed; warns when not, at most once a second."""
        if (
            abs(twist.linear_x) <= MAX_COMMAND
            and abs(twist.linear_y) <= MAX_COMMAND
            and abs(twist.angular_z) <= MAX_COMMAND
        ):
            return True
        now = time.monotonic()
        if now - self._last_warning >= WARNING_PERIOD:
            self._last_warning = now
            _LOG.warning(
                "%s: %s is not finite or beyond all bounds, the last good command stays",
                self._owner,
                twist,
            )
        return False


def open_twist_command(plugin: ModelPlugin, topic: str) -> Command[Twist]:
    """Declares the velocity command of a drive.

    Unlike the reference: a NaN or infinite command is refused, it would stay in the physics.

    Args:
        plugin: The drive.
        topic: Under the model's namespace, global with a leading `/`.
    """
    guard = TwistGuard(f'plugin "{plugin.name}" of model "{plugin.model.name}"')
    return plugin.command(topic, Twist, accept=guard)
