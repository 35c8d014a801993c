"""Access to ROS for plugins, as `self.ros`, for everything that ports do not cover."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

import rospy

from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.graph_names import resolve_topic
from flatland.plugin_api.plugin import FlatlandPlugin, describe
from flatland.ros.message_types import service_class
from flatland.ros.transport.publisher import Publisher
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service, wait_for
from flatland.ros.transport.subscriber import Subscriber

_LOG = logging.getLogger("flatland")

_REQUIRED: Final = object()


class PluginRos:
    """Topics, services and parameters of one plugin, in the namespace of its model.

    A name that starts with `/` is global. Callbacks run between two steps, in the thread that
    steps the world. Everything that the plugin leaves open is closed with the plugin.
    """

    def __init__(
        self,
        plugin: FlatlandPlugin,
        registrar: Registrar,
        post: Callable[[Callable[[], object]], Future[Any]],
        shutting_down: Callable[[], bool],
    ) -> None:
        """Provides access for a plugin.

        Args:
            plugin: The plugin.
            registrar: Registers topics and services with the ROS master.
            post: Runs an action between two steps.
            shutting_down: Returns whether the node is about to close all connections.
        """
        self._plugin = plugin
        self._owner = describe(plugin)
        self._registrar = registrar
        self._post = post
        self._shutting_down = shutting_down
        self._closers: list[Callable[[], None]] = []
        self._closed = False

    def advertise(
        self, topic: str, message_type: type[Any], *, queue_size: int = 1, latch: bool = False
    ) -> Publisher:
        """Advertises a topic.

        Args:
            topic: Name in the namespace of the model.
            message_type: ROS message class.
            queue_size: Maximum number of messages queued for a slow subscriber.
            latch: Whether a new subscriber receives the last message when it connects.

        Returns:
            The publisher; its `publish` never blocks.

        Raises:
            FlatlandError: The topic is not a legal name, or has another type.
        """
        publisher = Publisher(
            self._registrar,
            self._resolve(topic),
            message_type,
            queue_size=queue_size,
            latch=latch,
            owner=self._owner,
        )
        self._closers.append(publisher.close)
        return publisher

    def subscribe(
        self, topic: str, message_type: type[Any], callback: Callable[[Any], object]
    ) -> Subscriber:
        """Subscribes to a topic.

        Args:
            topic: Name in the namespace of the model.
            message_type: ROS message class.
            callback: Called with each message between two steps; its exceptions are logged.

        Returns:
            The subscription; its `close` ends it.

        Raises:
            FlatlandError: The topic is not a legal name, or has another type.
        """

        def call(message: Any) -> None:
            if not self._closed:
                try:
                    with self._plugin.world.requests.plugin_code():
                        callback(message)
                except PLUGIN_FAULTS:
                    _LOG.exception("%s: callback of topic %s raised", self._owner, topic)

        subscriber = Subscriber(
            self._registrar,
            self._resolve(topic),
            message_type,
            lambda message: self._post(lambda: call(message)),
            owner=self._owner,
        )
        self._closers.append(subscriber.close)
        return subscriber

    def advertise_service(
        self, name: str, service_type: type[Any] | str, handler: Callable[[Any], Any]
    ) -> Service:
        """Advertises a service.

        Args:
            name: Name in the namespace of the model.
            service_type: ROS service class, or the name of a service of flatland.
            handler: Called with each request between two steps; returns the response. Its
                exceptions are reported to the client.

        Returns:
            The service; its `close` ends it.

        Raises:
            FlatlandError: The name is not legal, or this node already has the service.
        """

        def run(request: Any) -> Any:
            if self._closed:
                raise rospy.ServiceException(f"service {name}: its model was deleted")
            try:
                with self._plugin.world.requests.plugin_code():
                    return handler(request)
            except SystemExit as error:
                raise rospy.ServiceException(f"service {name} raised {error!r}") from error

        service = Service(
            self._registrar,
            self._resolve(name),
            service_class(service_type) if isinstance(service_type, str) else service_type,
            lambda request: wait_for(self._post(lambda: run(request)), self._plugin.world.requests),
            owner=self._owner,
        )
        self._closers.append(service.close)
        return service

    def param(self, name: str, default: Any = _REQUIRED) -> Any:
        """Returns a ROS parameter.

        Args:
            name: Name in the namespace of the model.
            default: Returned if the parameter is not set.

        Raises:
            PluginError: The parameter is not set, and no default is given.
        """
        resolved = rospy.resolve_name(self._resolve(name))
        if not rospy.has_param(resolved):
            if default is _REQUIRED:
                raise PluginError(f'ROS parameter "{resolved}" is not set')
            return default
        return rospy.get_param(resolved)

    def close(self) -> None:
        """Closes everything that the plugin opened, the last first; idempotent."""
        self._closed = True
        while self._closers:
            close = self._closers.pop()
            if not self._shutting_down():
                try:
                    close()
                except PLUGIN_FAULTS:
                    _LOG.exception("%s: cannot close a connection", self._owner)

    def _resolve(self, name: str) -> str:
        try:
            return resolve_topic(name, self._plugin.namespace)
        except ValueError as error:
            raise PluginError(str(error)) from None
