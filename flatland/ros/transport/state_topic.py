"""A latched topic that holds no message: each new subscriber gets one made for it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import rospy

from flatland.ros.publisher import Publisher
from flatland.ros.registrar import Registrar

_LOG = logging.getLogger("flatland")


class LatchedTopic(Publisher):
    """Tells its subscribers of a state: new ones as it is now, all of them when it changes.

    The message is made when it is needed: without subscribers never.
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        message_type: type[Any],
        make: Callable[[], Any],
        post: Callable[[Callable[[], object]], Future[Any]],
        *,
        on_connection: Callable[[bool], None] | None = None,
    ) -> None:
        """Advertises a topic, soon.

        Args:
            registrar: Talks to the ROS master.
            topic: Under the node's namespace, private with a leading `~`.
            message_type: The ROS message class.
            make: Makes the message of the present state; called between two steps.
            post: Runs an action between two steps.
            on_connection: Told whether anybody subscribes, whenever that may have changed; called
                in a thread of rospy.

        Raises:
            FlatlandError: This node publishes messages of another type on the topic.
        """
        self._make = make
        self._post = post
        self._newcomers: list[Callable[[Any], None]] = []
        self._reception = _Reception(self._welcome)
        super().__init__(registrar, topic, message_type, latch=True, on_connection=on_connection)

    def send(self) -> None:
        """Sends the present state to all; only in the thread that steps the world."""
        if self.connected:
            # Whoever comes from here on is in the list again, and at worst served twice.
            self._newcomers.clear()
            self.publish(self._make())

    def replace(self, make: Callable[[], Any]) -> None:
        """Tells of something else from now on; only in the thread that steps the world."""
        self._make = make
        self.send()

    def _welcome(self, publish_single: Callable[[Any], None]) -> None:
        """Hears of a subscriber, in a thread of rospy."""
        self._newcomers.append(publish_single)
        self._post(self._serve_newcomers)

    def _serve_newcomers(self) -> None:
        if self._closed or not self._newcomers:
            return
        try:
            message = self._make()
            while self._newcomers:
                self._publish_single(self._newcomers.pop(), message)
        except Exception:
            _LOG.exception("no message for a new subscriber of %s", self.topic)

    def _publish_single(self, publish: Callable[[Any], None], message: Any) -> None:
        publisher = self._publisher
        impl = publisher.impl if publisher is not None else None
        if impl is None:
            return
        impl.acquire()
        try:
            publish(message)
        except rospy.ROSException:
            # The topic was closed meanwhile, by its owner or at shutdown.
            if not self._closed and not rospy.core.is_shutdown_requested():
                raise
        finally:
            impl.release()

    # -- in the registrar's thread ---------------------------------------------------------

    def _open(self) -> None:
        super()._open()
        if self.connected:
            # Those who were faster than us, or had the topic from a publisher that ends.
            self._post(self.send)

    def _take_over(self, impl: Any) -> None:
        # Subscribers are told that the topic is latched, but rospy keeps no message: that would
        # be an old one for those who come later.
        impl.add_headers({"latching": "1"})
        impl.is_latch = False
        super()._take_over(impl)
        # Behind the listener that sets `connected`: a change after a newcomer was served would
        # else find nobody to tell.
        impl.add_subscriber_listener(self._reception)

    def _end(self) -> None:
        publisher = self._publisher
        listeners = publisher.impl.subscriber_listeners if publisher and publisher.impl else None
        if listeners is not None and self._reception in listeners:
            listeners.remove(self._reception)
        super()._end()


class _Reception(rospy.SubscribeListener):  # type: ignore[misc]
    """Tells of every new subscriber, and how to reach it alone."""

    def __init__(self, welcome: Callable[[Callable[[Any], None]], None]) -> None:
        super().__init__()
        self._welcome = welcome

    def peer_subscribe(
        self, _topic: str, _publish: Any, publish_single: Callable[[Any], None]
    ) -> None:
        """Hears of a new subscriber."""
        self._welcome(publish_single)
