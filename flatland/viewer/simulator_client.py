"""The simulator as seen through the ROS master: its names, topics and parameters."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import urlsplit

import rosgraph
import rospy

from flatland.node.parameters import ParameterError, read_parameters

_LASER_TYPE: Final = "sensor_msgs/LaserScan"
_CONNECT_TIMEOUT: Final = 1.0  # s


@dataclass(frozen=True, slots=True)
class SimulatorState:
    """State of the simulator according to the ROS master.

    Attributes:
        running: Whether the simulator is registered and accepts connections.
        lasers: Topics of its laser scans, sorted.
        update_rate: Requested number of steps per second of wall time [Hz], 0 for as fast as
            possible.
        step_size: Simulated time of a step [s].
        world_path: Path of the world file, empty if unknown.
    """

    running: bool
    lasers: tuple[str, ...] = ()
    update_rate: float = 200.0
    step_size: float = 0.005
    world_path: str = ""


class SimulatorClient:
    """Resolves the names of one simulator and queries its state.

    Attributes:
        node: Name of the simulator's node.
    """

    def __init__(self, node: str) -> None:
        """Creates a client of a node, for example `/flatland_server`."""
        self.node = node
        self._master = rosgraph.Master(rospy.get_name())

    def resolve(self, name: str) -> str:
        """Resolves a name as the simulator's node does: `~` is its private namespace."""
        resolved: str = rosgraph.names.resolve_name(name, self.node)
        return resolved

    def debug_topic(self, topic: str) -> str:
        """Returns the resolved name of an entry of `~debug/topics`."""
        return self.resolve(f"~debug/{topic}")

    def query_state(self) -> SimulatorState:
        """Queries the state from the ROS master; blocks until the master has replied."""
        try:
            publishers, _, services = self._master.getSystemState()
            if not any(self.node in nodes for _, nodes in (*publishers, *services)):
                return SimulatorState(running=False)
            # A killed node stays registered, but does not accept connections.
            uri = urlsplit(self._master.lookupNode(self.node))
            socket.create_connection((uri.hostname, uri.port), _CONNECT_TIMEOUT).close()
            types = dict(self._master.getTopicTypes())
            private = self._private_parameters()
        except (rosgraph.MasterException, OSError):
            return SimulatorState(running=False)
        published = (topic for topic, nodes in publishers if self.node in nodes)
        lasers = tuple(sorted(topic for topic in published if types.get(topic) == _LASER_TYPE))
        try:
            parameters = read_parameters(private.get)
        except ParameterError:
            return SimulatorState(True, lasers)
        return SimulatorState(
            True, lasers, parameters.update_rate, parameters.step_size, parameters.world_path
        )

    def _private_parameters(self) -> dict[str, Any]:
        try:
            parameters = self._master.getParam(self.node)
        except rosgraph.MasterError:
            return {}
        return parameters if isinstance(parameters, dict) else {}
