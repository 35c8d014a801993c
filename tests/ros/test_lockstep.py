"""Lockstep: the service `step_world` of the real node, and time that passes only on request."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage
from waiting import TIMEOUT, wait_until

from flatland.srv import SetRate, StepWorld

NAN, INF = float("nan"), float("inf")
STEP_NS = 5_000_000
MODELS = "[{name: r, model: robot.model.yaml, namespace: r, pose: [3, 3, 0]}]"


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    return write_world(MODELS)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    """A server in lockstep, for most tests of this file."""
    return module_launcher.server(world, lockstep=True, seed=1)


@pytest.fixture
def step(ros: Any) -> Iterator[Callable[..., Any]]:
    """Calls `step_world` over a persistent connection."""
    rospy.wait_for_service("/step_world", TIMEOUT)
    proxy = rospy.ServiceProxy("/step_world", StepWorld, persistent=True)
    yield proxy
    proxy.close()


@pytest.fixture
def raw(ros: Any) -> Iterator[Callable[..., RawSubscriber]]:
    """Subscribes to a topic without threads: what has not arrived is not received."""
    opened = []

    def subscribe(topic: str, message_type: type[Any], **options: Any) -> RawSubscriber:
        opened.append(RawSubscriber(ros.master, topic, message_type, **options))
        return opened[-1]

    yield subscribe
    for subscriber in opened:
        subscriber.close()


def stamps(messages: list[Any]) -> list[int]:
    return [message.header.stamp.to_nsec() for message in messages]


def test_time_stands_still_without_a_request(ros: Any, step: Any) -> None:
    clock = ros.topic("/clock", Clock)
    assert clock.next().clock.to_nsec() == 0
    assert clock.rest(0.5) == []
    answer = step(0.0)
    assert (answer.success, answer.message, answer.stamp.to_nsec()) == (True, "", STEP_NS)
    assert clock.next().clock.to_nsec() == STEP_NS
    assert clock.rest(0.5) == []


def test_messages_have_arrived_before_the_response(ros: Any, step: Any, raw: Any) -> None:
    clock = raw("/clock", Clock)
    scan, odometry = raw("/r/scan", LaserScan), raw("/r/odometry/filtered", Odometry)
    tf = raw("/tf", TFMessage)
    # A connection is known to the node before the response of a later call.
    wait_until("all subscribers", lambda: step(0.2).success and scan.received() and tf.received())
    step(0.1)
    for subscriber in (clock, scan, odometry, tf):
        subscriber.received()
    for _ in range(5):
        now = step(0.0).stamp.to_nsec()
        for _ in range(3):
            before, now = now, step(0.1).stamp.to_nsec()
            assert now == before + 20 * STEP_NS
            times = [message.clock.to_nsec() for message in clock.received()][-20:]
            assert times == list(range(before + STEP_NS, now + 1, STEP_NS))
            # At 10 Hz and 50 Hz; stamps are those of the start of a step.
            assert len([s for s in stamps(scan.received()) if before <= s < now]) == 1
            assert len([s for s in stamps(odometry.received()) if before <= s < now]) == 5
            assert tf.received()[-1].transforms[0].header.stamp.to_nsec() < now


def test_commands_sent_before_a_call_take_effect_in_it(ros: Any, step: Any) -> None:
    odometry = ros.topic("/r/odometry/ground_truth", Odometry)
    commands = ros.publisher("/r/cmd_vel", Twist)
    command = Twist()
    command.linear.x = 0.5
    commands.publish(command)

    def moves() -> bool:
        step(0.1)
        return bool(odometry.next().twist.twist.linear.x > 0)

    wait_until("a moving robot", moves)  # A command is received asynchronously.
    commands.publish(Twist())
    wait_until("a robot at rest", lambda: not moves())


@pytest.mark.parametrize(
    ("duration", "steps"), [(0.0, 1), (0.005, 1), (0.1, 20), (0.0050000001, 1), (1.0, 200)]
)
def test_a_duration_is_a_number_of_steps(step: Any, duration: float, steps: int) -> None:
    before = step(0.0).stamp.to_nsec()
    answer = step(duration)
    assert (answer.success, answer.message) == (True, "")
    assert answer.stamp.to_nsec() == before + steps * STEP_NS


@pytest.mark.parametrize(
    ("duration", "message"),
    [
        (-0.005, "duration must be finite and not negative [s], got -0.005"),
        (NAN, "duration must be finite and not negative [s], got nan"),
        (INF, "duration must be finite and not negative [s], got inf"),
        (-INF, "duration must be finite and not negative [s], got -inf"),
        (0.0075, "duration must be a multiple of the step size, 0.005 s, got 0.0075"),
        (1e-9, "duration must be a multiple of the step size, 0.005 s, got 1e-09"),
        (5e-324, "duration must be a multiple of the step size, 0.005 s, got 5e-324"),
        (3600.005, "duration must be at most 3600 s, got 3600.005"),
        (1e308, "duration must be at most 3600 s, got 1e+308"),
    ],
)
def test_an_invalid_duration_is_refused(step: Any, duration: float, message: str) -> None:
    before = step(0.0).stamp
    answer = step(duration)
    assert (answer.success, answer.message, answer.stamp) == (False, message, before)
    assert step(0.0).stamp.to_nsec() == before.to_nsec() + STEP_NS


def test_a_paused_world_is_stepped_and_stays_paused(ros: Any, step: Any) -> None:
    ros.call("/pause", Empty)
    before = step(0.0).stamp.to_nsec()
    assert step(0.1).stamp.to_nsec() == before + 20 * STEP_NS
    assert ros.topic("/flatland_server/paused", Bool).next().data is True
    ros.call("/resume", Empty)
    assert step(0.0).stamp.to_nsec() == before + 21 * STEP_NS


def test_clients_are_served_one_after_the_other(ros: Any, step: Any) -> None:
    before = step(0.0).stamp.to_nsec()
    answers: list[list[int]] = [[] for _ in range(4)]

    def client(mine: list[int]) -> None:
        proxy = rospy.ServiceProxy("/step_world", StepWorld, persistent=True)
        mine.extend(proxy(0.01).stamp.to_nsec() for _ in range(25))
        proxy.close()

    threads = [threading.Thread(target=client, args=(mine,)) for mine in answers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    assert all(mine == sorted(mine) for mine in answers)
    together = sorted(time for mine in answers for time in mine)
    assert together == [before + n * 2 * STEP_NS for n in range(1, 101)]


def test_other_services_work_while_a_long_call_is_carried_out(ros: Any, step: Any) -> None:
    before = step(0.0).stamp.to_nsec()
    answers: list[Any] = []
    thread = threading.Thread(target=lambda: answers.append(step(600.0)))
    clock = ros.topic("/clock", Clock)
    thread.start()
    clock.until(lambda message: message.clock.to_nsec() > before + STEP_NS)
    assert ros.spawn("robot.model.yaml", "late", "late", (-3, -3, 0)).success
    scan = ros.topic("/late/scan", LaserScan).next()
    assert ros.delete("late").success
    assert before < scan.header.stamp.to_nsec() < before + 120_000 * STEP_NS
    assert not answers
    thread.join(TIMEOUT)
    assert answers[0].success
    assert answers[0].stamp.to_nsec() == before + 120_000 * STEP_NS


def test_dropped_messages_are_reported(ros: Any, step: Any, raw: Any) -> None:
    subscriber = raw("/r/odometry/filtered", Odometry, receive_buffer=4096)
    message = wait_until("a dropped message", lambda: step(60.0).message)
    assert message.endswith(" messages of /r/odometry/filtered to /raw were dropped")
    assert int(message.split()[0]) > 0
    # What was received is complete and in order.
    received = stamps(subscriber.received())
    assert received == sorted(received)
    subscriber.close()
    wait_until("no more dropped messages", lambda: step(0.5).message == "")


def test_the_rate_cannot_be_set(ros: Any) -> None:
    answer = ros.call("/set_rate", SetRate, 100.0)
    assert answer.success is False
    assert "the rate cannot be set in lockstep" in answer.message


def test_diagnostics_name_the_lockstep(ros: Any) -> None:
    topic = ros.topic("/diagnostics", DiagnosticArray)
    message = topic.next()
    (status,) = [each for each in message.status if each.name.endswith(": simulation")]
    values = {value.key: value.value for value in status.values}
    assert status.message.startswith("lockstep: ")
    assert values["update rate [Hz]"] == "on request"
    assert "target real-time factor" not in values


def test_shutdown_ends_a_long_call(launcher: Any, ros: Any, world: Path, server: Any) -> None:
    server.stop()
    process = launcher.server(world, lockstep=True)
    results: list[str] = []

    def call() -> None:
        try:
            answer = ros.call("/step_world", StepWorld, 3600.0)
            results.append(answer.message)
        except rospy.ServiceException as error:
            results.append(str(error))

    clock = ros.topic("/clock", Clock)
    thread = threading.Thread(target=call)
    thread.start()
    clock.until(lambda message: message.clock.to_nsec() > 0)
    assert process.stop() == 0
    thread.join(TIMEOUT)
    assert len(results) == 1
    assert any(text in results[0] for text in ("stopped after", "shutting down", "transport error"))


class TestOtherServers:
    """Other servers replace the one of this file from here on."""

    def test_steps_of_a_running_world_are_additional(
        self, launcher: Any, ros: Any, world: Path
    ) -> None:
        launcher.server(world, update_rate=1e-3)  # The second step is due after 1000 s.
        clock = ros.topic("/clock", Clock)
        clock.until(lambda message: message.clock.to_nsec() == STEP_NS)
        answer = ros.call("/step_world", StepWorld, 0.1)
        assert (answer.success, answer.stamp.to_nsec()) == (True, 21 * STEP_NS)
        ros.call("/pause", Empty)
        assert ros.call("/step_world", StepWorld, 0.0).stamp.to_nsec() == 22 * STEP_NS

    def test_a_limited_clock_is_published_before_the_response(
        self, launcher: Any, ros: Any, raw: Any, world: Path
    ) -> None:
        launcher.server(world, lockstep=True, clock_rate=0.1)
        clock = raw("/clock", Clock)
        assert clock.next().clock.to_nsec() == 0
        for number in range(1, 4):
            stamp = ros.call("/step_world", StepWorld, 0.1).stamp
            assert stamp.to_nsec() == number * 20 * STEP_NS
            assert clock.received()[-1].clock == stamp

    def test_wall_time(self, launcher: Any, ros: Any, world: Path) -> None:
        launcher.server(world, lockstep=True, use_sim_time=False)
        before = rospy.Time.from_sec(time.time())
        answer = ros.call("/step_world", StepWorld, 0.01)
        assert answer.success
        assert abs((answer.stamp - before).to_sec()) < TIMEOUT

    def test_launch_argument(self, launcher: Any, ros: Any, world: Path) -> None:
        for package in ("flatland", "flatland_server"):
            process = launcher.launch(
                package,
                "server.launch",
                f"world_path:={world}",
                "show_viz:=false",
                "lockstep:=true",
            )
            clock = ros.topic("/clock", Clock)
            process.wait_for_line(r"loaded ")
            assert ros.call("/step_world", StepWorld, 0.0).stamp.to_nsec() == STEP_NS
            assert clock.rest(0.5)[-1].clock.to_nsec() == STEP_NS
            clock.close()
            process.stop()

    def test_lockstep_excludes_a_benchmark(self, launcher: Any, world: Path) -> None:
        process = launcher.start(world_path=world, lockstep=True, benchmark_duration=1)
        assert process.wait() == 1
        (line,) = [line for line in process.lines if "[FATAL]" in line]
        assert 'Invalid parameter "~lockstep": it must be false with "~benchmark_duration"' in line
