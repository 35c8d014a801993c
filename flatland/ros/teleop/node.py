"""The node `teleop_key`: publishes velocities while keys of the terminal are held."""

from __future__ import annotations

import contextlib
import logging
import os
import select
import sys
import time
from typing import TYPE_CHECKING, Any, Final

from flatland.node.parameters import ParameterError, TeleopParameters, read_table
from flatland.ros.rospy_import import defer_catkin
from flatland.ros.teleop.held_key import HeldKey, decode
from flatland.ros.teleop.terminal import KeyInput, StopRequests
from flatland.ros_addresses import master_address
from flatland.streams import accept_any_text

if TYPE_CHECKING:
    from flatland.ros.transport.publisher import Publisher

_LOG = logging.getLogger("flatland")

NODE_NAME: Final = "teleop_key"
USAGE: Final = """\
Hold a key to drive; let it go to stop.

    q  w  e      w or up      forwards       q, e   forwards in an arc
    a  s  d      s or down    backwards      z, c   backwards in an arc
    z     c      a or left    turn left      space  stop at once
                 d or right   turn right     + -    faster, slower

Ctrl-C ends the program."""

_END_KEYS: Final = ("\x03", "\x04")  # Ctrl-C, if it is no signal, and Ctrl-D
_STATUS_PERIOD: Final = 0.5  # s
_REGISTRATION_TIMEOUT: Final = 5.0  # s


def main() -> int:
    """Runs the node.

    Returns:
        The exit code: 0 after a requested stop, 1 if the node cannot start.
    """
    accept_any_text()
    if not sys.stdin.isatty():
        return _fail(
            "the standard input is not a terminal: start it in a terminal, by "
            "`rosrun flatland teleop_key` or `roslaunch flatland teleop.launch`"
        )
    defer_catkin()
    import rosgraph
    import rospy

    try:
        uri = rosgraph.get_master_uri()
        master_address(uri)
        if not rosgraph.is_master_online():
            return _fail(f"no ROS master at {uri}: start the simulator first")
    except ValueError as error:
        return _fail(f"{error} (from ROS_MASTER_URI)")
    # Without ROS time, so that it also works while the simulated time stands still.
    from flatland.ros.logs import log_to_ros, log_without_file

    log_without_file()
    rospy.init_node(NODE_NAME, anonymous=True, disable_signals=True, disable_rostime=True)
    log_to_ros()
    try:
        parameters = read_table(TeleopParameters, lambda name: rospy.get_param(f"~{name}", None))
    except ParameterError as error:
        _LOG.critical("%s", error)
        rospy.signal_shutdown("invalid parameter")
        return 1
    stop = StopRequests()
    rospy.on_shutdown(stop.request)
    try:
        _teleoperate(parameters, stop)
    finally:
        rospy.signal_shutdown("end of the teleoperation")
    return 0


def _teleoperate(parameters: TeleopParameters, stop: StopRequests) -> None:
    from geometry_msgs.msg import Twist

    from flatland.ros.transport.publisher import Publisher
    from flatland.ros.transport.registrar import Registrar

    registrar = Registrar()
    publisher = Publisher(registrar, "cmd_vel", Twist)
    registrar.flush(_REGISTRATION_TIMEOUT)
    keys = HeldKey(
        parameters.max_linear,
        parameters.max_angular,
        repeat_delay=parameters.repeat_delay,
        key_timeout=parameters.key_timeout,
    )
    teleoperation = _Teleoperation(keys, publisher, Twist, 1.0 / parameters.rate)
    _write(f"{USAGE}\n")
    try:
        with KeyInput(sys.stdin.fileno()) as key_input:
            teleoperation.run(key_input, stop)
    finally:
        # Also if the program fails, since the robot keeps the last command.
        teleoperation.stop()
        _write("\n")


class _Teleoperation:
    """Publishes the velocity of the held key at a rate, and zero once when it is released."""

    def __init__(
        self, keys: HeldKey, publisher: Publisher, message_type: type[Any], period: float
    ) -> None:
        self._keys = keys
        self._publisher = publisher
        self._message_type = message_type
        self._period = period
        self._velocity = (0.0, 0.0)
        self._due = 0.0
        self._status = ""

    def run(self, key_input: KeyInput, stop: StopRequests) -> None:
        """Reads keys until a stop is requested or the terminal is closed."""
        rest = b""
        while True:
            now = time.monotonic()
            self._update(now)
            timeout = _STATUS_PERIOD
            if self._velocity != (0.0, 0.0):
                timeout = max(0.0, min(self._due - now, self._keys.remaining(now)))
            watched: list[KeyInput | StopRequests] = [key_input, stop]
            ready, _, _ = select.select(watched, [], [], timeout)
            if stop in ready:
                return
            if key_input not in ready:
                rest = b""  # An escape key, not the start of a sequence.
                continue
            data = key_input.read()
            if not data:
                return
            pressed, rest = decode(rest + data)
            for key in pressed:
                if key in _END_KEYS:
                    return
                self._keys.press(key, time.monotonic())

    def stop(self) -> None:
        """Publishes zero if the last velocity was another one."""
        if self._velocity != (0.0, 0.0):
            self._publish((0.0, 0.0))

    def _update(self, now: float) -> None:
        velocity = self._keys.velocity(now)
        changed = velocity != self._velocity
        if changed or (velocity != (0.0, 0.0) and now >= self._due):
            self._due = now + self._period
            self._publish(velocity)
        self._show()

    def _publish(self, velocity: tuple[float, float]) -> None:
        message = self._message_type()
        message.linear.x, message.angular.z = velocity
        self._publisher.publish(message)
        self._velocity = velocity

    def _show(self) -> None:
        keys, topic = self._keys, self._publisher.topic
        connection = "" if self._publisher.connected else " (no subscriber)"
        linear, angular = self._velocity
        status = (
            f"{topic}{connection}: {linear:+.2f} m/s {angular:+.2f} rad/s, speed "
            f"{keys.scale:.0%} ({keys.linear:.2f} m/s, {keys.angular:.2f} rad/s)"
        )
        if status != self._status:
            self._status = status
            _write(f"\r\x1b[K{status}")


def _write(text: str) -> None:
    """Writes to the terminal without a buffer; has no effect once it is closed."""
    with contextlib.suppress(OSError):
        os.write(sys.stdout.fileno(), text.encode())


def _fail(text: str) -> int:
    print(f"{NODE_NAME}: {text}", file=sys.stderr)
    return 1
