"""The protocol of interactive markers on non-blocking connections, in serialized form.

A client receives the full state on `update_full`, and numbered changes on `update`. A client starts
to display markers when the number of a full state is the number of an update that was received, and
starts again if a number is missing. Keep-alive messages repeat the last number.
"""

from __future__ import annotations

import time
from io import BytesIO
from typing import Any, Final

import rospy
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
)

from flatland.entities.model import Model
from flatland.geometry import Pose
from flatland.node.adapters.receivers import planar_pose
from flatland.node.handles import SERVER_NAME, Event, Feedback, Handles
from flatland.node.values import ReceivedPose
from flatland.ros.adapters.writer import RosWriter
from flatland.ros.interactive.model_handle import model_handle
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.state_topic import StateTopic
from flatland.ros.transport.subscriber import Subscriber
from flatland.runtime.requests import Post

CONNECTING_TIME: Final = 3.0
"""Time after a new connection in which each update is followed by the full state [s]."""
FULL_STATE_PERIOD: Final = 1.0
"""Time between two full states afterwards [s], for clients that need longer."""
_UPDATE_QUEUE: Final = 100  # messages; a client that misses one requests the full state again

_EVENTS: Final = {
    InteractiveMarkerFeedback.KEEP_ALIVE: Event.KEEP_ALIVE,
    InteractiveMarkerFeedback.MOUSE_DOWN: Event.PRESS,
    InteractiveMarkerFeedback.POSE_UPDATE: Event.MOVE,
    InteractiveMarkerFeedback.MOUSE_UP: Event.RELEASE,
    InteractiveMarkerFeedback.MENU_SELECT: Event.MENU,
}


class MarkerServer:
    """Manages interactive markers and publishes their changes.

    All methods must be called in the thread that steps the world.
    """

    def __init__(self, registrar: Registrar, post: Post, handles: Handles) -> None:
        """Advertises the topics asynchronously.

        Args:
            registrar: Registers the topics with the ROS master.
            post: Runs an action between two steps.
            handles: Returns the poses of the markers, and receives feedback.
        """
        self._server_id: str = rospy.get_name()
        self._number = 0  # of the last update
        self._markers: dict[str, _PackedMarker] = {}
        # Changes since the last update: markers added or replaced, moved, erased.
        self._inserted: dict[str, None] = {}
        self._moved: dict[str, None] = {}
        self._erased: list[str] = []
        self._pose_of = handles.pose_of
        self._post = post
        self._handles = handles
        self._connecting_until = 0.0  # s, `time.monotonic`
        self._full_state_due = 0.0
        self._full_state_is_outdated = False  # for those who have subscribed to it for long
        self._init = StateTopic(
            registrar,
            f"{SERVER_NAME}/update_full",
            InteractiveMarkerInit,
            self._full_state,
            post,
            on_connection=self._connection_changed,
        )
        self._update = Publisher(
            registrar,
            f"{SERVER_NAME}/update",
            InteractiveMarkerUpdate,
            queue_size=_UPDATE_QUEUE,
            on_connection=self._connection_changed,
        )
        self._feedback = Subscriber(
            registrar, f"{SERVER_NAME}/feedback", InteractiveMarkerFeedback, self._receive_feedback
        )

    @property
    def connected(self) -> bool:
        """Whether there are clients."""
        return self._update.connected or self._init.connected

    # -- changes ---------------------------------------------------------------------------

    def insert(self, model: Model, name: str) -> None:
        """Adds or replaces the marker of a model; takes effect with the next update."""
        self._markers[name] = _PackedMarker(model_handle(model, name))
        self._inserted[name] = None

    def move(self, name: str) -> None:
        """Publishes the current pose of a marker with the next update."""
        if name not in self._inserted:
            self._moved[name] = None

    def erase(self, name: str) -> None:
        """Removes a marker; takes effect with the next update."""
        del self._markers[name]
        self._moved.pop(name, None)
        if name in self._inserted:
            del self._inserted[name]  # The marker has not been published.
        else:
            self._erased.append(name)

    def apply_changes(self) -> None:
        """Publishes one update with all changes since the last one, if any."""
        if not (self._inserted or self._moved or self._erased):
            return
        self._number += 1
        if self._update.connected:
            self._update.publish_serialized(self._changes())
        only_moved = not (self._inserted or self._erased)
        self._inserted.clear()
        self._moved.clear()
        # A name that was erased may have been inserted again.
        self._erased.clear()
        self._send_full_state(only_moved)

    def keep_alive(self) -> None:
        """Publishes a keep-alive message, and the full state if it was omitted."""
        if self._full_state_is_outdated:
            self._send_full_state(False)
        if self._update.connected:
            to = self._head(InteractiveMarkerUpdate.KEEP_ALIVE)
            to.pack("I", 0, 0, 0)
            self._update.publish_serialized(bytes(to.data))

    def _send_full_state(self, only_moved: bool) -> None:
        """Publishes the full state, but not after each of many updates in which markers only move.

        Clients unsubscribe once they have a full state that matches the updates.
        """
        now = time.monotonic()
        if only_moved and self._connecting_until < now < self._full_state_due:
            self._full_state_is_outdated = True
            return
        self._full_state_is_outdated = False
        self._full_state_due = now + FULL_STATE_PERIOD
        self._init.send()

    # -- messages --------------------------------------------------------------------------

    def _head(self, kind: int | None = None) -> RosWriter:
        """Returns a message with the server, its number and, for an update, its type."""
        to = RosWriter()
        to.text(self._server_id)
        to.pack("Q", self._number)
        if kind is not None:
            to.pack("B", kind)
        return to

    def _changes(self) -> bytes:
        markers, pose_of = self._markers, self._pose_of
        to = self._head(InteractiveMarkerUpdate.UPDATE)
        to.count(len(self._inserted))
        for name in self._inserted:
            to.data += markers[name].at(pose_of(name))
        to.count(len(self._moved))
        for name in self._moved:
            to.data += markers[name].pose_update(pose_of(name))
        to.texts([name for name in self._erased if name not in markers])
        return bytes(to.data)

    def _full_state(self) -> bytes:
        """Returns all markers that have been published, with their current poses."""
        published = [
            (name, marker) for name, marker in self._markers.items() if name not in self._inserted
        ]
        to = self._head()
        to.count(len(published))
        for name, marker in published:
            to.data += marker.at(self._pose_of(name))
        return bytes(to.data)

    # -- in rospy's threads ----------------------------------------------------------------

    def _connection_changed(self, _connected: bool) -> None:
        self._connecting_until = time.monotonic() + CONNECTING_TIME
        self._handles.connection_changed()

    def _receive_feedback(self, message: InteractiveMarkerFeedback) -> None:
        """Posts feedback to the thread that steps the world."""
        feedback = Feedback(
            message.marker_name,
            message.client_id,
            _EVENTS.get(message.event_type, Event.OTHER),
            message.menu_entry_id,
            ReceivedPose(message.header.frame_id.lstrip("/"), planar_pose(message.pose)),
            time.monotonic(),
        )
        self._post(lambda: self._handles.receive(feedback))


class _PackedMarker:
    """A serialized interactive marker, and the serialized update of its pose."""

    def __init__(self, marker: InteractiveMarker) -> None:
        head = RosWriter()
        head.header(0, marker.header.frame_id)
        self._pose_offset = len(head.data)
        self._marker = _serialized(marker)
        update = InteractiveMarkerPose(marker.header, marker.pose, marker.name)
        self._pose_update = _serialized(update)

    def at(self, pose: Pose) -> bytes:
        """Returns the marker at a pose."""
        return self._replace(self._marker, pose)

    def pose_update(self, pose: Pose) -> bytes:
        """Returns the change of the pose alone."""
        return self._replace(self._pose_update, pose)

    def _replace(self, data: bytes, pose: Pose) -> bytes:
        to = RosWriter()
        to.pose(*pose)
        packed = to.data
        start = self._pose_offset
        return b"".join((data[:start], packed, data[start + len(packed) :]))


def _serialized(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
