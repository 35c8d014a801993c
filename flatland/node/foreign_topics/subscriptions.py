"""What the node receives for the viewer: messages of topics, and transforms."""

from __future__ import annotations

import contextlib
import logging
from collections import deque
from concurrent.futures import CancelledError
from typing import Any, Final

from flatland.errors import FlatlandError
from flatland.geometry import quaternion_from_yaw
from flatland.node.frame_tree import FrameTree, transform
from flatland.node.transport import Transport
from flatland.node.values import FrameParents
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

MAX_QUEUED: Final = 1000  # messages of a topic of which all matter, between two updates
_SEED_TIMEOUT: Final = 1.0  # s; a paused world answers, one whose plugin blocks does not


class TopicSubscription:
    """Keeps the newest messages of a topic until they are taken.

    It ends when a plugin subscribes to the topic with another message class.

    Attributes:
        latest: The newest message, None if there is none.
    """

    def __init__(
        self, transport: Transport, topic: str, message_type: type[Any], *, keeps_all: bool
    ) -> None:
        """Subscribes asynchronously.

        Args:
            transport: Subscribes.
            topic: Resolved name of the topic.
            message_type: The message class.
            keeps_all: Whether to keep up to `MAX_QUEUED` messages instead of the newest only.

        Raises:
            FlatlandError: The node subscribes to the topic with another type.
        """
        self.latest: Any = None
        self._messages: deque[Any] = deque(maxlen=MAX_QUEUED if keeps_all else 1)
        self._subscriber = transport.subscribe(topic, message_type, self._receive, gives_way=True)

    @property
    def closed(self) -> bool:
        """Whether the subscription has ended."""
        return self._subscriber.closed

    def _receive(self, message: Any) -> None:
        """Keeps a message; called in a thread that must not be delayed."""
        self.latest = message
        self._messages.append(message)

    def take(self) -> list[Any]:
        """Returns the messages since the last call."""
        taken = []
        with contextlib.suppress(IndexError):
            while True:
                taken.append(self._messages.popleft())
        return taken

    def close(self) -> None:
        """Unsubscribes asynchronously."""
        self._subscriber.close()


class TransformSubscription:
    """Receives the transforms of all nodes into a tree."""

    def __init__(self, transport: Transport, simulation: Simulation, frames: FrameTree) -> None:
        """Subscribes asynchronously, and takes the transforms of the own world.

        A paused world sends no transforms.

        Args:
            transport: Subscribes.
            simulation: Simulation of the world.
            frames: Receives the transforms.
        """
        self._frames = frames
        world = simulation.world
        # A closed world raises an error or cancels the request.
        with contextlib.suppress(TimeoutError, CancelledError, FlatlandError):
            latest = simulation.post(lambda: list(world.transforms.values()))
            for each in latest.result(_SEED_TIMEOUT):
                rotation = quaternion_from_yaw(each.yaw, each.roll)
                frames.set(each.parent, each.child, transform((each.x, each.y, 0.0), rotation))
        # The class that the node uses for other subscribers of the same topics.
        message_type, _ = transport.receivable(FrameParents)
        self._subscribers = []
        for topic in ("/tf", "/tf_static"):
            try:
                subscriber = transport.subscribe(topic, message_type, self._receive, gives_way=True)
            except FlatlandError as error:
                _LOG.warning("web viewer: transforms are missing: %s", error)
            else:
                self._subscribers.append(subscriber)

    @property
    def closed(self) -> bool:
        """Whether a subscription has given way to one with another message class."""
        return any(subscriber.closed for subscriber in self._subscribers)

    def _receive(self, message: Any) -> None:
        for each in message.transforms:
            p, q = each.transform.translation, each.transform.rotation
            matrix = transform((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
            self._frames.set(each.header.frame_id, each.child_frame_id, matrix)

    def close(self) -> None:
        """Unsubscribes asynchronously."""
        for subscriber in self._subscribers:
            subscriber.close()
        self._frames.clear()
