"""A node of ROS 2 in a domain of its own, simulators, and helpers that wait for events."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from message_queue import MessageQueue
from programs import SILENCE, Program
from room_world import write_room_world
from waiting import TIMEOUT, wait_until

from flatland.ros2.domain import reserved_domain

_BOOTSTRAP = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Ignores warnings caused by rclpy: deprecated modules, sockets that are closed late."""
    for item in items:
        for ignored in ("ignore::DeprecationWarning", "ignore::ResourceWarning"):
            item.add_marker(pytest.mark.filterwarnings(ignored))


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[int]:
    """A domain that no other test process of this machine uses."""
    with reserved_domain() as number:
        os.environ["ROS_DOMAIN_ID"] = str(number)
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        yield number


class Topic(MessageQueue):
    """The messages received on a topic since its creation."""

    def __init__(self, ros: Ros2, name: str, message_type: type[Any], profile: Any) -> None:
        super().__init__(name)
        self._ros = ros
        self._subscription = ros.run(
            lambda: ros.node.create_subscription(message_type, name, self.messages.put, profile)
        )

    def close(self) -> None:
        """Unsubscribes."""
        self._ros.run(lambda: self._ros.node.destroy_subscription(self._subscription))


class Ros2:
    """The node of the tests."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self._closers: list[Callable[[], object]] = []

    def run(self, action: Callable[[], Any]) -> Any:
        """Runs an action in the thread of the executor.

        There, nothing is destroyed while the executor waits for it, which would end the executor.
        """
        done = threading.Event()
        task = self.node.executor.create_task(action)
        task.add_done_callback(lambda _task: done.set())
        assert done.wait(TIMEOUT), "the executor is blocked"
        return task.result()

    def topic(self, name: str, message_type: type[Any], profile: Any = 10) -> Topic:
        """Subscribes to a topic until the end of the test; waits for its publisher."""
        topic = Topic(self, name, message_type, profile)
        self._closers.append(topic.close)
        wait_until(f"a publisher of {name}", lambda: self.node.count_publishers(name))
        return topic

    def publisher(self, name: str, message_type: type[Any], profile: Any = 10) -> Any:
        """Advertises a topic until the end of the test; waits for its subscriber."""
        publisher = self.run(lambda: self.node.create_publisher(message_type, name, profile))
        self._closers.append(lambda: self.run(lambda: self.node.destroy_publisher(publisher)))
        wait_until(f"a subscriber of {name}", lambda: publisher.get_subscription_count())
        return publisher

    def call(self, service: str, service_type: type[Any], **fields: object) -> Any:
        """Calls a service."""
        client = self.run(lambda: self.node.create_client(service_type, service))
        try:
            assert client.wait_for_service(TIMEOUT), f"no service {service}"
            done = threading.Event()
            future = client.call_async(service_type.Request(**fields))
            future.add_done_callback(lambda _future: done.set())
            assert done.wait(TIMEOUT), f"no response of {service}"
            return future.result()
        finally:
            self.run(lambda: self.node.destroy_client(client))

    def wait_until_ready(self, *topics: str, namespace: str = "") -> None:
        """Waits until a node has opened everything, and topics of it are connected."""
        from flatland_msgs.srv import WaitUntilReady

        name = f"{namespace}/wait_until_ready"
        answer = self.call(name, WaitUntilReady, topics=list(topics), timeout=TIMEOUT)
        assert answer.success, answer.message

    def step(self, duration: float = 0.0) -> int:
        """Calls /step_world for a time [s], by default one step; returns the new time [ns]."""
        from flatland_msgs.srv import StepWorld

        answer = self.call("/step_world", StepWorld, duration=duration)
        assert answer.success, answer.message
        return nanoseconds(answer.stamp)

    def close(self) -> None:
        """Closes all topics that the test opened."""
        while self._closers:
            self._closers.pop()()


def nanoseconds(stamp: Any) -> int:
    """Converts a `builtin_interfaces/Time`."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


@pytest.fixture(scope="session")
def executor_node(domain: int) -> Iterator[Any]:
    """A node of this process, which an executor runs in another thread."""
    import rclpy
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("flatland_tests")
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    yield node
    executor.shutdown()
    thread.join(TIMEOUT)
    node.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def ros(executor_node: Any) -> Iterator[Ros2]:
    """The node of the tests; topics are closed at the end of the test."""
    ros = Ros2(executor_node)
    yield ros
    ros.close()


@pytest.fixture(scope="module")
def module_ros(executor_node: Any) -> Iterator[Ros2]:
    """The node of the tests; topics are closed at the end of the file."""
    ros = Ros2(executor_node)
    yield ros
    ros.close()


class Launcher:
    """Starts and stops programs."""

    def __init__(self, folder: Path) -> None:
        self.environment = {
            **os.environ,
            "ROS_LOG_DIR": str(folder),
            "PYTHONUNBUFFERED": "1",
            # Lines of the log without colours and times.
            "RCUTILS_CONSOLE_OUTPUT_FORMAT": "[{severity}] [{name}]: {message}",
        }
        self._programs: list[Program] = []

    def program(
        self, *command: str | Path, environment: dict[str, str] | None = None, **options: Any
    ) -> Program:
        """Starts a program."""
        program = Program(command, env=environment or self.environment, **options)
        self._programs.append(program)
        return program

    def start(self, *arguments: str, **parameters: object) -> Program:
        """Starts a simulator with arguments of ROS, without waiting for it."""
        # On a busy machine, a node may need longer than its default to end. One that hangs logs
        # where before it is ended for its silence.
        parameters = {"shutdown_timeout": SILENCE * 2 / 3, **parameters}
        given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
        module = [sys.executable, "-m", "flatland.ros2"]
        return self.program(*module, "--ros-args", *given, *arguments)

    def server(self, ros: Ros2, world: Path, *arguments: str, **parameters: object) -> Program:
        """Starts a simulator and waits until it has opened everything."""
        program = self.start(*arguments, world_path=world, **parameters)
        namespaces = [word.split(":=")[1] for word in arguments if word.startswith("__ns:=")]
        service = f"{''.join(namespaces)}/wait_until_ready"
        wait_until(
            "a simulator",
            lambda: service in dict(ros.node.get_service_names_and_types()) or not program.running,
        )
        if not program.running:
            program.wait()
            pytest.fail(f"the simulator ended:\n{program.output}")
        ros.wait_until_ready(namespace="".join(namespaces))
        return program

    def stop(self) -> None:
        """Stops all programs that are still running."""
        for program in reversed(self._programs):
            if program.running:
                program.send(signal.SIGINT)
        for program in self._programs:
            program.wait()
            # Part of the report of a test that fails.
            print(f"{program}\n{program.output}")
        self._programs.clear()


@pytest.fixture
def launcher(domain: int, tmp_path: Path) -> Iterator[Launcher]:
    """Starts programs that are stopped at the end of the test."""
    launcher = Launcher(tmp_path)
    yield launcher
    launcher.stop()


@pytest.fixture(scope="module")
def module_launcher(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Launcher]:
    """Starts programs that are stopped at the end of the file."""
    launcher = Launcher(tmp_path_factory.mktemp("log"))
    yield launcher
    launcher.stop()


@pytest.fixture(scope="session")
def write_world(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writes a world with a room of 10 m by 10 m; see `write_room_world`."""
    return lambda *arguments, **files: write_room_world(
        tmp_path_factory.mktemp("world"), *arguments, **files
    )


@pytest.fixture(scope="session")
def checkout() -> Path:
    """The source tree that these tests stand in."""
    return Path(__file__).resolve().parents[2]
