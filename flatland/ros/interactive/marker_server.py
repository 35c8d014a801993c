"""Debian's server of interactive markers, on connections that never wait."""

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
from flatland.ros.publisher import Publisher
from flatland.ros.registrar import Registrar
from flatland.ros.transport.state_topic import LatchedTopic
from flatland.ros.transport.subscriber import Subscriber

_UPDATE_QUEUE: Final = 100  # messages; a client that misses one starts anew

Feedback = Callable[[InteractiveMarkerFeedback, float], None]
"""Takes feedback and the time of `time.monotonic` at which it came."""


class MarkerServer(InteractiveMarkerServer):  # type: ignore[misc]
    """Keeps the markers and their numbered updates as the base class does.

    Unlike it, this one sends nothing by itself, neither waits nor needs threads to send, and hands
    all feedback to the thread that steps the world. The base class keeps clients alive, and
    arbitrates between them, in ROS time, which stands still while the world is paused.
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
        """Advertises the topics, soon.

        Args:
            registrar: Talks to the ROS master.
            name: Namespace of the topics.
            post: Runs an action between two steps.
            pose_of: Gives the present pose of a marker.
            receive: Called between two steps.
            on_connection: Called when a client comes or goes, in a thread of rospy.
        """
        # Not super().__init__, which opens the connections and starts a timer.
        self.topic_ns = name
        self.server_id = rospy.get_name()
        self.seq_num = 0
        self.mutex = Lock()
        self.marker_contexts: dict[str, Any] = {}
        self.pending_updates: dict[str, Any] = {}
        self._pose_of = pose_of
        self._post = post
        self._receive = receive
        self.init_pub = LatchedTopic(
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
        """Leaves the markers alone: the topics are gone when the process ends."""

    @property
    def connected(self) -> bool:
        """Whether anybody listens."""
        return self.update_pub.connected or self.init_pub.connected

    def publishInit(self) -> None:  # noqa: N802
        """Sends the full state to those who still wait for it."""
        self.init_pub.send()

    def keep_alive(self) -> None:
        """Tells the clients that the server is there."""
        if self.update_pub.connected:
            self.keepAlive(None)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:  # noqa: N802
        """Takes feedback, in a thread of rospy."""
        now = time.monotonic()
        self._post(lambda: self._receive(feedback, now))

    def _full_state(self) -> InteractiveMarkerInit:
        """Makes the message of all markers that were sent, where they are now."""
        markers = [context.int_marker for context in self.marker_contexts.values()]
        for marker in markers:
            marker.pose = pose_message(self._pose_of(marker.name))
        return InteractiveMarkerInit(self.server_id, self.seq_num, markers)
