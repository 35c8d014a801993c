"""A ROS master for the tests, nodes as started by roslaunch, and helpers that wait for events."""

from __future__ import annotations

import contextlib
import gc
import os
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from free_ports import free_port

pytest.importorskip("rospy", reason="ROS is not installed")
pytest.importorskip("flatland.msg", reason="the messages are not built")

import rosgraph
import roslib.packages
import rospy
from forked_ros import Forks
from message_queue import MessageQueue
from plugin_manifests import write_plugins
from programs import Program
from room_world import LAYER, write_room_world
from waiting import TIMEOUT, wait_until

import flatland
from flatland.srv import DeleteModel, MoveModel, ResetWorld, SpawnModel, StepWorld, WaitUntilReady


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Ignores warnings caused by rospy: deprecated functions, sockets that are closed late."""
    own = f"{Path(__file__).parent}/"
    for item in items:
        if str(item.path).startswith(own):
            for ignored in ("ignore::DeprecationWarning", "ignore::ResourceWarning"):
                item.add_marker(pytest.mark.filterwarnings(ignored))


def _collect_garbage() -> None:
    """Finalizes the sockets that rospy left open, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gc.collect()


# s; until a publisher is advertised again. A subscriber may miss a publisher of this process that
# is advertised while rospy still closes the connection to the previous one.
_ADVERTISE_TIMEOUT = 10.0


class Topic(MessageQueue):
    """The messages received on a topic since its creation."""

    def __init__(self, name: str, message_type: type[Any]) -> None:
        super().__init__(name)
        self._subscriber = rospy.Subscriber(name, message_type, self.messages.put)

    @property
    def connected(self) -> bool:
        """Whether a publisher has accepted the connection."""
        # rospy lists a connection before the publisher accepts it with its header.
        return any(connection.header for connection in self._subscriber.impl.connections)

    def close(self) -> None:
        """Unsubscribes."""
        self._subscriber.unregister()


class Ros:
    """The node of the tests, and its view of other nodes."""

    def __init__(self) -> None:
        self.master = rosgraph.Master("/flatland_tests")
        self._closers: list[Callable[[], None]] = []

    def topic(self, name: str, message_type: type[Any]) -> Topic:
        """Subscribes to a topic until the end of the test; waits for its publisher."""
        topic = Topic(name, message_type)
        self._closers.append(topic.close)
        wait_until(f"a publisher of {name}", lambda: topic.connected)
        return topic

    def publisher(self, name: str, message_type: type[Any]) -> rospy.Publisher:
        """Advertises a topic until the end of the test; waits for its subscriber."""

        def advertise() -> rospy.Publisher | None:
            publisher = rospy.Publisher(name, message_type, queue_size=10)
            end = time.monotonic() + _ADVERTISE_TIMEOUT
            while not publisher.get_num_connections():
                if time.monotonic() > end:
                    publisher.unregister()
                    return None
                time.sleep(0.01)
            self._closers.append(publisher.unregister)
            return publisher

        return wait_until(f"a subscriber of {name}", advertise)

    def call(self, name: str, service_type: type[Any], *arguments: Any) -> Any:
        """Calls a service."""
        rospy.wait_for_service(name, TIMEOUT)
        return rospy.ServiceProxy(name, service_type)(*arguments)

    def spawn(
        self,
        path: Path | str,
        name: str,
        ns: str = "",
        pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Any:
        """Calls /spawn_model."""
        from geometry_msgs.msg import Pose2D

        return self.call("/spawn_model", SpawnModel, str(path), name, ns, Pose2D(*pose))

    def delete(self, name: str) -> Any:
        """Calls /delete_model."""
        return self.call("/delete_model", DeleteModel, name)

    def move(self, name: str, pose: tuple[float, float, float]) -> Any:
        """Calls /move_model."""
        from geometry_msgs.msg import Pose2D

        return self.call("/move_model", MoveModel, name, Pose2D(*pose))

    def step(self, duration: float = 0.0) -> int:
        """Calls /step_world for a time [s], by default one step; returns the new time [ns]."""
        answer = self.call("/step_world", StepWorld, duration)
        assert answer.success, answer.message
        return int(answer.stamp.to_nsec())

    def wait_until_ready(self, *topics: str, node: str = "/flatland_server") -> None:
        """Waits until a node has registered everything, and topics of it are connected."""
        name = rosgraph.names.namespace(node) + "wait_until_ready"
        answer = self.call(name, WaitUntilReady, topics, TIMEOUT)
        assert answer.success, answer.message

    def ready_topic(self, name: str, message_type: type[Any]) -> Topic:
        """Subscribes as `topic`; the node sends all messages from its next step on."""
        topic = self.topic(name, message_type)
        self.wait_until_ready(name)
        return topic

    def step_until(self, what: str, condition: Callable[[], Any], duration: float = 0.1) -> Any:
        """Steps until the node has received what this process has published."""
        return wait_until(what, lambda: self.step(duration) and condition())

    def reset(self) -> None:
        """Calls /reset_world with the same seed."""
        answer = self.call("/reset_world", ResetWorld, False, -1)
        assert (answer.success, answer.message) == (True, "")

    def registered(self, node: str = "/flatland_server") -> dict[str, set[str]]:
        """Returns what a running node has registered, once nothing is being registered.

        Without the interactive markers, the pause state and the diagnostics of each node.
        """
        self.wait_until_ready(node=node)
        of_each_node = re.compile(rf"/interactive_model_markers/|^{node}/paused$|^/diagnostics$")
        return {
            kind: {name for name in names if not of_each_node.search(name)}
            for kind, names in self.registered_now(node).items()
        }

    def registered_now(self, node: str = "/flatland_server") -> dict[str, set[str]]:
        """Returns the publishers, subscribers and services that a node has registered."""
        state = self.master.getSystemState()
        kinds = ("publishers", "subscribers", "services")
        return {
            kind: {name for name, nodes in entries if node in nodes}
            for kind, entries in zip(kinds, state, strict=True)
        }

    def connected_topics(self, node: str = "/flatland_server", of: str = "") -> set[str]:
        """Returns the topics of a node that nodes whose names start with `of` have joined."""
        api = ServerProxy(self.master.lookupNode(node))
        _, _, connections = api.getBusInfo("/flatland_tests")
        return {topic for _, other, _, _, topic, *_ in connections if other.startswith(of)}

    def types(self) -> dict[str, str]:
        """Returns the message type of each topic."""
        return dict(self.master.getTopicTypes())

    def close(self) -> None:
        """Closes all topics that the test opened."""
        while self._closers:
            self._closers.pop()()


@pytest.fixture(scope="session")
def ros_environment(checkout: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of ROS programs: a free port for the master, and the package under test."""
    folder = tmp_path_factory.mktemp("ros")
    port = free_port()
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(folder),
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_ETC_DIR": os.environ.get("ROS_ETC_DIR", "/etc/ros"),
        "ROS_VERSION": "1",
        "ROS_PYTHON_VERSION": "3",
        "ROS_DISTRO": os.environ.get("ROS_DISTRO", "Debian"),
        "PYTHONUNBUFFERED": "1",
    }
    environment.pop("ROS_HOSTNAME", None)
    package = Path(flatland.__file__).resolve().parent
    if package.parent == checkout:
        environment["PYTHONPATH"] = f"{checkout}:{os.environ.get('PYTHONPATH', '')}"
        environment["ROS_PACKAGE_PATH"] = f"{_overlay(checkout, folder)}:/usr/share"
    elif "ROS_PACKAGE_PATH" not in environment:
        environment["ROS_PACKAGE_PATH"] = f"{sys.prefix}/share:/usr/share"
    return environment


def _overlay(checkout: Path, folder: Path) -> Path:
    """Creates the layout of the installed packages, with links into the source tree."""
    share = folder / "share"
    for package in (checkout / "catkin" / "flatland", *(checkout / "compat").iterdir()):
        installed = share / package.name
        (installed / "scripts").mkdir(parents=True)
        data = ("package.xml", "flatland_plugins.xml", "launch", "msg", "rviz", "srv", "worlds")
        for name in data:
            if (package / name).exists():
                (installed / name).symlink_to(package / name)
        for script in (package / "scripts").glob("*"):
            if script.is_file():
                starter = installed / "scripts" / script.name
                starter.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{script}" "$@"\n')
                starter.chmod(0o755)
    return share


@pytest.fixture(scope="session")
def ros_master(ros_environment: dict[str, str]) -> Iterator[dict[str, str]]:
    """A running roscore with this process as a node; yields the environment."""
    port = ros_environment["ROS_MASTER_URI"].rsplit(":", 1)[1]
    core = Program(["roscore", "-p", port], env=ros_environment)
    names = [name for name in ros_environment if name.startswith("ROS_")]
    os.environ.update({name: ros_environment[name] for name in names})
    try:
        core.wait_for_line("started core service")
        rosgraph.Master("/flatland_tests").setParam("/use_sim_time", True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # Without ROS time, because this process measures and waits in wall time.
            rospy.init_node("flatland_tests", disable_signals=True, disable_rostime=True)
        yield ros_environment
        rospy.signal_shutdown("the tests are over")
    finally:
        core.send(signal.SIGINT)
        core.wait()
        _collect_garbage()


@pytest.fixture
def ros(ros_master: dict[str, str]) -> Iterator[Ros]:
    """The node of the tests; topics are closed at the end of the test."""
    del ros_master
    ros = Ros()
    yield ros
    ros.close()


@pytest.fixture(scope="module")
def module_ros(ros_master: dict[str, str]) -> Iterator[Ros]:
    """The node of the tests; topics are closed at the end of the file."""
    del ros_master
    ros = Ros()
    yield ros
    ros.close()


@pytest.fixture(scope="session")
def server_path(ros_environment: dict[str, str]) -> str:
    """The program that roslaunch starts as flatland_server."""
    paths = ros_environment["ROS_PACKAGE_PATH"].split(":")
    import rospkg

    found = roslib.packages.find_node("flatland", "flatland_server", rospkg.RosPack(paths))
    assert found, f"no flatland_server in {paths}"
    return str(found[0])


@pytest.fixture(scope="session")
def forks(
    ros_environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Forks]:
    """A process that forks programs."""
    forks = Forks(tmp_path_factory.mktemp("forks"), ros_environment)
    yield forks
    forks.stop()


class Launcher:
    """Starts and stops nodes and launch files."""

    def __init__(self, environment: dict[str, str], server: str, forks: Forks) -> None:
        self.environment = environment
        self._server = server
        self._forks = forks
        self._processes: list[Program] = []

    def add_plugins(self, folder: Path, source: str, module: str) -> None:
        """Writes a module to a folder and makes nodes find its plugins, as `test::NAME`."""
        manifest = write_plugins(folder, source, module)
        self.environment = {**self.environment, "FLATLAND_PLUGIN_PATH": manifest}

    def program(self, *command: str, **environment: str) -> Program:
        """Starts a program."""
        environment = {**self.environment, **environment}
        process = Program(command, env=environment, process=self._forks.start(command, environment))
        self._processes.append(process)
        return process

    def node(self, *arguments: str) -> Program:
        """Starts a server with a command line."""
        return self.program(self._server, *arguments)

    def start(self, *arguments: str, **parameters: object) -> Program:
        """Starts a server with private parameters, without waiting for it."""
        clear = rosgraph.Master("/flatland_tests")
        for node in ("/flatland_server", "/flatland_benchmark"):
            with contextlib.suppress(rosgraph.MasterException):
                clear.deleteParam(node)
        # On a busy machine, a node may need longer than its default to end.
        parameters = {"shutdown_timeout": TIMEOUT, **parameters}
        given = [f"_{name}:={value}" for name, value in parameters.items()]
        return self.node(*arguments, *given)

    def server(self, world: Path, *arguments: str, **parameters: object) -> Program:
        """Starts a server and waits until it has opened all its topics and services."""
        process = self.start(*arguments, world_path=world, **parameters)
        wait_until_server_is_ready(process)
        return process

    def launch(self, *arguments: str) -> Program:
        """Starts roslaunch."""
        return self.program("roslaunch", *arguments)

    def stop(self) -> None:
        """Stops all programs that are still running."""
        for process in reversed(self._processes):
            if process.running:
                process.send(signal.SIGINT)
        for process in self._processes:
            process.wait()
            # Part of the report of a test that fails.
            print(f"{process}\n{process.output}")
        self._processes.clear()


def wait_until_server_is_ready(process: Program) -> None:
    """Waits until a server has opened all its topics and services."""

    def ready() -> bool:
        if not process.running:
            process.wait()
            pytest.fail(f"the server ended:\n{process.output}")
        # The service may be that of an earlier server, which has ended without unregistering it.
        with contextlib.suppress(rospy.ServiceException):
            return bool(
                rospy.ServiceProxy("/wait_until_ready", WaitUntilReady)([], TIMEOUT).success
            )
        return False

    wait_until("a server that is ready", ready)


@pytest.fixture
def launcher(ros_master: dict[str, str], server_path: str, forks: Forks) -> Iterator[Launcher]:
    """Starts nodes that are stopped at the end of the test."""
    launcher = Launcher(ros_master, server_path, forks)
    yield launcher
    launcher.stop()


@pytest.fixture(scope="module")
def module_launcher(
    ros_master: dict[str, str], server_path: str, forks: Forks
) -> Iterator[Launcher]:
    """Starts nodes that are stopped at the end of the file."""
    launcher = Launcher(ros_master, server_path, forks)
    yield launcher
    launcher.stop()


@pytest.fixture(scope="session")
def write_world(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writes a world with a room of 10 m by 10 m, from models as YAML and more files by name."""

    def write(
        models: str = "[]", plugins: str = "[]", layers: str = f"[{LAYER}]", **files: str
    ) -> Path:
        folder = tmp_path_factory.mktemp("world")
        return write_room_world(folder, models, plugins, layers, **files)

    return write


@pytest.fixture(scope="session")
def eventually() -> Callable[..., Any]:
    """Waits until a condition holds: `eventually("name", condition)`."""
    return wait_until
