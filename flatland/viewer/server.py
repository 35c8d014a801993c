"""The simulator as the ROS master knows it: its names, topics and parameters."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import urlsplit

import rosgraph
import rospy

from flatland.ros.parameters import ParameterError, read_parameters

_LASER_TYPE: Final = "sensor_msgs/LaserScan"
_PATIENCE: Final = 1.0  # s


@dataclass(frozen=True, slots=True)
class ServerState:
    """What the master says of the simulator.

    Attributes:
        running: Whether it is registered, and there.
        lasers: Topics of its laser scans, sorted.
        update_rate: Steps in a second of wall time that it is asked for [Hz], 0 for as many as
            possible.
        step_size: Simulated time of a step [s].
        world_path: The world file, empty if unknown.
    """

    running: bool
    lasers: tuple[str, ...] = ()
    update_rate: float = 200.0
    step_size: float = 0.005
    world_path: str = ""


class Server:
    """Names of one simulator.

    Attributes:
        node: Name of its node.
    """

    def __init__(self, node: str) -> None:
        """Names the simulator by its node, such as `/flatland_server`."""
        self.node = node
        self._master = rosgraph.Master(rospy.get_name())

    def resolve(self, name: str) -> str:
        """Returns a name as the simulator's node resolves it: `~` is its private namespace."""
        resolved: str = rosgraph.names.resolve_name(name, self.node)
        return resolved

    def debug_topic(self, topic: str) -> str:
        """Returns the full name of a topic of `~debug/topics`."""
        return self.resolve(f"~debug/{topic}")

    def look(self) -> ServerState:
        """Asks the master; takes as long as the master does."""
        try:
            publishers, _, services = self._master.getSystemState()
            if not any(self.node in nodes for _, nodes in (*publishers, *services)):
                return ServerState(running=False)
            # The master knows nothing of one that was killed.
            uri = urlsplit(self._master.lookupNode(self.node))
            socket.create_connection((uri.hostname, uri.port), _PATIENCE).close()
            types = dict(self._master.getTopicTypes())
            private = self._parameters()
        except (rosgraph.MasterException, OSError):
            return ServerState(running=False)
        ours = (topic for topic, nodes in publishers if self.node in nodes)
        lasers = tuple(sorted(topic for topic in ours if types.get(topic) == _LASER_TYPE))
        try:
            told = read_parameters(private.get)
        except ParameterError:
            return ServerState(True, lasers)
        return ServerState(True, lasers, told.update_rate, told.step_size, told.world_path)

    def _parameters(self) -> dict[str, Any]:
        """Returns the node's private parameters."""
        try:
            parameters = self._master.getParam(self.node)
        except rosgraph.MasterError:
            return {}
        return parameters if isinstance(parameters, dict) else {}
