"""Lockstep: the service `step_world` of the real node, and time that passes only on request."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from waiting import TIMEOUT, wait_until

from flatland.srv import StepWorld

STEP_NS = 5_000_000


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """A server in lockstep, for most tests of this file."""
    world = write_world("[{name: r, model: robot.model.yaml, namespace: r, pose: [3, 3, 0]}]")
    return module_launcher.server(world, lockstep=True, seed=1, shutdown_timeout=TIMEOUT)


@pytest.fixture
def step(ros: Any) -> Iterator[Callable[..., Any]]:
    """Calls `step_world` over a persistent connection."""
    rospy.wait_for_service("/step_world", TIMEOUT)
    proxy = rospy.ServiceProxy("/step_world", StepWorld, persistent=True)
    yield proxy
    proxy.close()


def test_time_stands_still_without_a_request(ros: Any, step: Any) -> None:
    clock = ros.topic("/clock", Clock)
    assert clock.next().clock.to_nsec() == 1  # 0 is no time
    # The node is ready after its first request, which is not a step.
    ros.wait_until_ready("/clock")
    assert clock.rest() == []
    answer = step(0.0)
    assert (answer.success, answer.message, answer.stamp.to_nsec()) == (True, "", STEP_NS)
    assert clock.next().clock.to_nsec() == STEP_NS
    assert clock.rest() == []


def test_commands_sent_before_a_call_take_effect_in_it(ros: Any, step: Any) -> None:
    odometry = ros.ready_topic("/r/odometry/ground_truth", Odometry)
    commands = ros.publisher("/r/cmd_vel", Twist)
    command = Twist()
    command.linear.x = 0.5
    commands.publish(command)

    def moves() -> bool:
        before = step(0.1).stamp - rospy.Duration.from_sec(0.02)
        message = odometry.until(lambda m: m.header.stamp >= before)
        return bool(message.twist.twist.linear.x > 0)

    wait_until("a moving robot", moves)  # A command is received asynchronously.
    commands.publish(Twist())
    wait_until("a robot at rest", lambda: not moves())


def test_ignored_command_gives_a_warning_on_rosout(ros: Any, server: Any) -> None:
    log = ros.topic("/rosout", Log)
    commands = ros.publisher("/r/cmd_vel", Twist)

    def warning_of_the_command() -> Log | None:
        commands.publish(Twist(linear=Vector3(x=math.nan)))  # logged at most once a second
        messages = log.rest(silence=0.1)
        return next((m for m in messages if "previous command remains" in m.msg), None)

    warning = wait_until("a warning on /rosout", warning_of_the_command)
    server.wait_for_line(r"\[WARN\].*previous command remains in effect")
    assert (warning.level, warning.name) == (Log.WARN, "/flatland_server")
    assert warning.file.endswith(".py")


def test_all_messages_of_the_steps_are_sent_without_a_further_step(ros: Any, step: Any) -> None:
    topics = {
        name: ros.ready_topic(name, message_type)
        for name, message_type in (
            ("/clock", Clock),
            ("/tf", TFMessage),
            ("/r/scan", LaserScan),
            ("/r/odometry/filtered", Odometry),
        )
    }
    now = step(0.0).stamp.to_nsec()
    for _ in range(3):
        before, now = now, step(0.1).stamp.to_nsec()
        assert now == before + 20 * STEP_NS
        clock = topics["/clock"].until(lambda m, end=now: m.clock.to_nsec() == end)
        assert clock.clock.to_nsec() == now
        # At 10 Hz and 50 Hz; stamps are those of the start of a step.
        for name, period in (("/r/scan", 20 * STEP_NS), ("/r/odometry/filtered", 4 * STEP_NS)):
            last = (now - 1) // period * period
            topics[name].until(lambda m, due=last: m.header.stamp.to_nsec() == due)
        last = (now - 1) // (4 * STEP_NS) * 4 * STEP_NS
        topics["/tf"].until(lambda m, due=last: m.transforms[0].header.stamp.to_nsec() == due)


def test_other_services_work_during_a_long_call_which_ends_with_the_node(
    ros: Any, server: Any
) -> None:
    """The last test of this file: it stops the server."""
    results: list[str] = []

    def call() -> None:
        try:
            results.append(ros.call("/step_world", StepWorld, 3600.0).message)
        except rospy.ServiceException as error:
            results.append(str(error))

    clock = ros.ready_topic("/clock", Clock)
    clock.drop()
    thread = threading.Thread(target=call)
    thread.start()
    clock.next()
    assert ros.spawn("robot.model.yaml", "late", "late", (-3, -3, 0)).success
    ros.topic("/late/scan", LaserScan).next()
    assert ros.delete("late").success
    assert not results
    assert server.stop() == 0
    thread.join(TIMEOUT)
    assert len(results) == 1
    assert any(text in results[0] for text in ("stopped after", "shutting down", "transport error"))
