"""What a plugin finds as `self.ros`: ROS itself, for what ports cannot say."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

import rospy

from flatland.errors import PLUGIN_FAULTS, PluginError
from flatland.graph_names import resolve_topic
from flatland.plugin_api.plugin import FlatlandPlugin, describe
from flatland.ros.publisher import Publisher
from flatland.ros.registrar import Registrar
from flatland.ros.transport.service import Service, wait_for
from flatland.ros.transport.subscriber import Subscriber

_LOG = logging.getLogger("flatland")

_REQUIRED: Final = object()


class PluginRos:
    """Topics, services and parameters of one plugin, under its model's namespace.

    A name that starts with `/` is global. Callbacks run in the thread that steps the world,
    between two steps. Everything ends with the plugin, also what it forgot to close.
    """

    def __init__(
        self,
        plugin: FlatlandPlugin,
        registrar: Registrar,
        post: Callable[[Callable[[], object]], Future[Any]],
        shutting_down: Callable[[], bool],
    ) -> None:
        """Opens nothing yet.

        Args:
            plugin: Whose access this is.
            registrar: Talks to the ROS master.
            post: Runs an action between two steps.
            shutting_down: Tells whether the node ends, and all connections with it.
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
        """Advertises a topic; `publish` of what it returns never waits for a subscriber.

        Args:
            topic: Under the model's namespace.
            message_type: The ROS message class.
            queue_size: How many messages wait for a subscriber that reads slowly.
            latch: Whether a new subscriber gets the last message at once.

        Raises:
            FlatlandError: The topic is no legal name, or carries another type.
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
        """Calls a function with each message of a topic; `close` of the result ends it.

        Args:
            topic: Under the model's namespace.
            message_type: The ROS message class.
            callback: Called between two steps; what it raises is logged.

        Raises:
            FlatlandError: The topic is no legal name, or carries another type.
        """

        def call(message: Any) -> None:
            if not self._closed:
                try:
                    callback(message)
                except PLUGIN_FAULTS:
                    _LOG.exception("plugin %r: callback of %s raised", self._plugin.name, topic)

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
        self, name: str, service_type: type[Any], handler: Callable[[Any], Any]
    ) -> Service:
        """Offers a service; `close` of the result ends it.

        Args:
            name: Under the model's namespace.
            service_type: The ROS service class.
            handler: Called between two steps with the request, returns the response. What it
                raises is the caller's error.

        Raises:
            FlatlandError: The service has no legal name, or this node has it already.
        """

        def run(request: Any) -> Any:
            if self._closed:
                raise rospy.ServiceException(f"service {name} is gone with its model")
            try:
                return handler(request)
            except SystemExit as error:
                raise rospy.ServiceException(f"service {name} ended with {error!r}") from error

        service = Service(
            self._registrar,
            self._resolve(name),
            service_type,
            lambda request: wait_for(self._post(lambda: run(request))),
            owner=self._owner,
        )
        self._closers.append(service.close)
        return service

    def param(self, name: str, default: Any = _REQUIRED) -> Any:
        """Returns a ROS parameter.

        Args:
            name: Under the model's namespace.
            default: Returned where the parameter is not set.

        Raises:
            PluginError: It is not set, and there is no default.
        """
        resolved = rospy.resolve_name(self._resolve(name))
        if not rospy.has_param(resolved):
            if default is _REQUIRED:
                raise PluginError(f'ROS parameter "{resolved}" is not set')
            return default
        return rospy.get_param(resolved)

    def close(self) -> None:
        """Ends everything that the plugin opened, last first; a second call does nothing."""
        self._closed = True
        while self._closers:
            close = self._closers.pop()
            if not self._shutting_down():
                try:
                    close()
                except PLUGIN_FAULTS:
                    _LOG.exception("plugin %r: a connection did not close", self._plugin.name)

    def _resolve(self, name: str) -> str:
        try:
            return resolve_topic(name, self._plugin.namespace)
        except ValueError as error:
            raise PluginError(str(error)) from None
