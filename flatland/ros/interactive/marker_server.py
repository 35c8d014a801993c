"""Interactive marker server of ROS on non-blocking connections."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock
from typing import Any, Final

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import (
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
)

from flatland.geometry import Pose
from flatland.ros.interactive.model_handle import pose_message
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.subscriber import Subscriber

_UPDATE_QUEUE: Final = 100  # messages; a client that misses one requests the full state again

Feedback = Callable[[InteractiveMarkerFeedback, float], None]
"""Callback with feedback and the time at which it was received (`time.monotonic`) [s]."""


class MarkerServer(InteractiveMarkerServer):  # type: ignore[misc]
    """Manages the markers and their numbered updates like the base class.

    Unlike the base class, it publishes without blocking and without a timer of its own, and passes
    all feedback to the thread that steps the world. The base class sends keep-alive messages and
    arbitrates between clients in ROS time, which does not advance while the world is paused.
    """

    def __init__(
        self,
        registrar: Registrar,
        name: str,
        post: Callable[[Callable[[], object]], Future[Any]],
        *,
        pose_of: Callable[[str], Pose],
        receive: Feedback,
        on_connection: Callable[[], None],
    ) -> None:
        """Advertises the topics asynchronously.

        Args:
            registrar: Registers the topics with the ROS master.
            name: Namespace of the topics.
            post: Runs an action between two steps.
            pose_of: Returns the current pose of a marker.
            receive: Called with feedback, between two steps.
            on_connection: Called in a rospy thread when a client connects or disconnects.
        """
        # super().__init__ is not called: it opens connections and starts a timer.
        self.topic_ns = name
        self.server_id = rospy.get_name()
        self.seq_num = 0
        self.mutex = Lock()
        self.marker_contexts: dict[str, Any] = {}
        self.pending_updates: dict[str, Any] = {}
        self._pose_of = pose_of
        self._post = post
        self._receive = receive
        self.init_pub = StateTopic(
            registrar,
            f"{name}/update_full",
            InteractiveMarkerInit,
            self._full_state,
            post,
            on_connection=lambda _connected: on_connection(),
        )
        self.update_pub = Publisher(
            registrar,
            f"{name}/update",
            InteractiveMarkerUpdate,
            queue_size=_UPDATE_QUEUE,
            on_connection=lambda _connected: on_connection(),
        )
        self._feedback = Subscriber(
            registrar, f"{name}/feedback", InteractiveMarkerFeedback, self.processFeedback
        )

    def __del__(self) -> None:
        """Overrides the base class, which would delete the markers."""

    @property
    def connected(self) -> bool:
        """Whether there are clients."""
        return self.update_pub.connected or self.init_pub.connected

    def publishInit(self) -> None:  # noqa: N802
        """Publishes the full state to clients that are still initializing."""
        self.init_pub.send()

    def keep_alive(self) -> None:
        """Publishes a keep-alive message."""
        if self.update_pub.connected:
            self.keepAlive(None)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:  # noqa: N802
        """Posts feedback to the thread that steps the world; called in a rospy thread."""
        now = time.monotonic()
        self._post(lambda: self._receive(feedback, now))

    def _full_state(self) -> InteractiveMarkerInit:
        """Returns all published markers with their current poses."""
        markers = [context.int_marker for context in self.marker_contexts.values()]
        for marker in markers:
            marker.pose = pose_message(self._pose_of(marker.name))
        return InteractiveMarkerInit(self.server_id, self.seq_num, markers)
