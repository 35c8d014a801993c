"""Access to ROS for plugins, as `self.ros`, for everything that ports do not cover."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final

from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.graph_names import resolve_topic
from flatland.node.transport import CallError, Connection, Publisher, Transport
from flatland.plugin_api.plugin import FlatlandPlugin, describe
from flatland.runtime.requests import Post, Requests

_LOG = logging.getLogger("flatland")

_REQUIRED: Final = object()


class PluginRos:
    """Topics, services and parameters of one plugin, in the namespace of its model.

    A name that starts with `/` is global. Callbacks run between two steps, in the thread that
    steps the world. Everything that the plugin leaves open is closed with the plugin.

    Attributes:
        used: Whether the plugin has opened a topic or a service.
    """

    def __init__(
        self,
        plugin: FlatlandPlugin,
        transport: Transport,
        requests: Requests,
        post: Post,
        shutting_down: Callable[[], bool],
    ) -> None:
        """Provides access for a plugin.

        Args:
            plugin: The plugin.
            transport: Publishes, subscribes and serves.
            requests: The requests of the world.
            post: Runs an action between two steps.
            shutting_down: Returns whether the node is about to close all connections.
        """
        self._plugin = plugin
        self._requests = requests
        self._owner = describe(plugin)
        self._transport = transport
        self._post = post
        self._shutting_down = shutting_down
        self.used = False
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
        publisher = self._transport.advertise(
            self._resolve(topic),
            message_type,
            queue_size=queue_size,
            latch=latch,
            owner=self._owner,
        )
        self._opened(publisher)
        return publisher

    def subscribe(
        self, topic: str, message_type: type[Any], callback: Callable[[Any], object]
    ) -> Connection:
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
                    with self._requests.plugin_code():
                        callback(message)
                except PLUGIN_FAULTS:
                    _LOG.exception("%s: callback of topic %s raised", self._owner, topic)

        subscriber = self._transport.subscribe(
            self._resolve(topic),
            message_type,
            lambda message: self._post(lambda: call(message)),
            owner=self._owner,
        )
        self._opened(subscriber)
        return subscriber

    def advertise_service(
        self, name: str, service_type: type[Any] | str, handler: Callable[[Any], Any]
    ) -> Connection:
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
        transport = self._transport

        def run(request: Any) -> Any:
            if self._closed:
                raise CallError(f"service {name}: its model was deleted")
            try:
                with self._requests.plugin_code():
                    return handler(request)
            except SystemExit as error:
                raise CallError(f"service {name} raised {error!r}") from error

        service = transport.serve(
            self._resolve(name),
            transport.service_class(service_type)
            if isinstance(service_type, str)
            else service_type,
            lambda request: transport.wait_for(self._post(lambda: run(request)), self._requests),
            owner=self._owner,
        )
        self._opened(service)
        return service

    def param(self, name: str, default: Any = _REQUIRED) -> Any:
        """Returns a ROS parameter.

        Args:
            name: Name in the namespace of the model.
            default: Returned if the parameter is not set.

        Raises:
            PluginError: The parameter is not set, and no default is given.
        """
        resolved = self._transport.resolve(self._resolve(name))
        value = self._transport.parameter(resolved)
        if value is None:
            if default is _REQUIRED:
                raise PluginError(f'ROS parameter "{resolved}" is not set')
            return default
        return value

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

    def _opened(self, connection: Connection) -> None:
        self.used = True
        self._closers.append(connection.close)

    def _resolve(self, name: str) -> str:
        try:
            return resolve_topic(name, self._plugin.namespace)
        except ValueError as error:
            raise PluginError(str(error)) from None
