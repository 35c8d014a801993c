"""The connection of a run to ROS 1, with a master of its own; requires rospy."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING, Any, Final

from flatland.node.values import WORLD_FRAME
from flatland.ros.transport import inbound
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ros_transport import RosTransport
from flatland.timekeeper import NANOSECONDS

if TYPE_CHECKING:
    from flatland.node.transport import Transport
    from flatland.ros.transport.subscriber import Subscriber
    from flatland.scenarios.stack_link import Route

_NODE: Final = "flatland_server"
_CLOSE_TIMEOUT: Final = 2.0  # s
_TF_TIME: Final = 10.0  # s of transforms that are kept


class Ros1:
    """A ROS master in a thread, and the node of this process.

    Attributes:
        environment: Variables of the environment of nodes.
    """

    def __init__(self) -> None:
        """Starts the master on a free port; rospy can be initialized once per process."""
        self.environment = {"ROS_HOSTNAME": "localhost"}
        os.environ.update(self.environment)
        os.environ.pop("ROS_IP", None)
        os.environ.pop("ROS_NAMESPACE", None)
        import rospy
        from rosmaster.master import Master

        self._master = Master(0)
        self._master.start()
        self.environment["ROS_MASTER_URI"] = os.environ["ROS_MASTER_URI"] = self._master.uri
        inbound.install()
        rospy.init_node(_NODE, argv=[], disable_signals=True, disable_rostime=True)
        rospy.set_param("/use_sim_time", True)
        self._registrar = Registrar()

    def listen(self) -> None:
        """Receives transforms from now on; the clock must have been set."""
        import rospy
        import tf2_ros

        self._transforms = tf2_ros.Buffer(rospy.Duration(_TF_TIME), debug=False)
        self._listener = tf2_ros.TransformListener(self._transforms)

    def transport(self, route: Route) -> Transport:
        """Returns the transport of the node."""
        return _RoutedTransport(self._registrar, route)

    def position(self, frame: str, stamp_ns: int) -> tuple[float, float] | None:
        """Returns the position of a frame in the map by `/tf` [m]; None if it is not known.

        Args:
            frame: The frame.
            stamp_ns: Simulated time [ns].
        """
        import rospy
        import tf2_ros

        stamp = rospy.Time(*divmod(stamp_ns, NANOSECONDS))
        try:
            found = self._transforms.lookup_transform(WORLD_FRAME, frame, stamp)
        except tf2_ros.TransformException:
            return None
        translation = found.transform.translation
        return (translation.x, translation.y)

    def close(self) -> None:
        """Ends the node and the master."""
        import rospy

        self._registrar.close(_CLOSE_TIMEOUT)
        ending = threading.Thread(target=rospy.signal_shutdown, args=("end of run",), daemon=True)
        ending.start()
        ending.join(_CLOSE_TIMEOUT)
        self._master.stop()


class _RoutedTransport(RosTransport):
    """A transport in which another function may receive the messages of a topic."""

    def __init__(self, registrar: Registrar, route: Route) -> None:
        super().__init__(registrar)
        self._route = route

    def subscribe(
        self, topic: str, message_type: type[Any], *rest: Any, **options: Any
    ) -> Subscriber:
        """Calls a function with each message of a topic, in a rospy thread."""
        receive, *others = rest
        routed = self._route(self.resolve(topic), receive)
        return super().subscribe(topic, message_type, routed, *others, **options)
