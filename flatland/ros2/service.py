"""A service, each request of which is handled in a thread of its own."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from flatland.errors import FlatlandError
from flatland.foreign_texts import text_of
from flatland.node.names import sendable_text
from flatland.node.transport import CallError
from flatland.ros2 import convert
from flatland.ros2.adapters import message_field
from flatland.ros2.endpoints import Endpoints, Shared, User, destroy_later, expanded
from flatland.ros2.message_types import service_class

_LOG = logging.getLogger("flatland")


class Service(User):
    """A service of the node, until `close`."""

    def __init__(
        self,
        endpoints: Endpoints,
        name: str,
        service_type: type[Any],
        handler: Callable[[Any], Any],
        *,
        owner: str = "",
    ) -> None:
        """Offers a service.

        Args:
            endpoints: The connections of the node.
            name: Name in the namespace of the node, global with a leading `/`.
            service_type: ROS service class.
            handler: Called with each request in a thread of its own; returns the response.
            owner: Plugin that offers the service, for messages.

        Raises:
            FlatlandError: This node has a service of this name, or the name is not legal.
        """
        super().__init__(owner)
        node = endpoints.node
        try:
            self.name = str(node.resolve_service_name(expanded(name)))
        except ValueError as error:
            raise FlatlandError(f'illegal name of a service, "{name}": {error}') from error
        self._endpoints = endpoints
        self._shared = endpoints.join(
            "service",
            self.name,
            service_type,
            self,
            lambda: _SharedService(node, expanded(name), self.name, service_type, handler),
        )
        # A reset of the world keeps services open, with the handlers of new plugins.
        self._shared.handler = handler

    def close(self) -> None:
        """Ends the service."""
        if not self.closed:
            self.closed = True
            self._endpoints.leave(self._shared, self)


_Pending = tuple[Any, Any]
"""A request, and an empty response to it."""


class _SharedService(Shared):
    """A service of rclpy."""

    def __init__(
        self,
        node: Node,
        name: str,
        resolved: str,
        service_type: type[Any],
        handler: Callable[[Any], Any],
    ) -> None:
        super().__init__("service", resolved, service_type)
        self._node = node
        self.handler = handler
        self._name = name  # which rclpy resolves
        self._is_open = threading.Event()
        self._service: Any = None

    def open(self) -> None:
        """Offers the service."""
        self._service = self._node.create_service(self.type, self._name, self._accept)
        # Instead of a coroutine, whose result the executor does not send in all versions: the
        # executor passes what `_accept` returns, and the sender, to this function.
        self._send_response = self._service.send_response
        self._service.send_response = self._start
        self._is_open.set()

    def _accept(self, request: Any, response: Any) -> _Pending:
        """Returns the arguments; called by the executor with each request."""
        self._is_open.wait()
        return request, response

    def destroy(self) -> None:
        """Ends the service."""
        destroy_later(self._node, self._node.destroy_service, self._service)

    def _start(self, pending: _Pending, sender: Any) -> None:
        """Handles a request in another thread, while the executor goes on.

        Args:
            pending: The request, and an empty response.
            sender: Identifies the request.
        """
        threading.Thread(
            target=self._respond, args=(pending, sender), name="flatland-service", daemon=True
        ).start()

    def _respond(self, pending: _Pending, sender: Any) -> None:
        response = self._handle(*pending)
        try:
            self._send_response(response, sender)
        except InvalidHandle:
            pass  # The service has been closed.
        except Exception:  # for example, a response of another type
            _LOG.exception("service %s: cannot send the response", self.key[1])

    def _handle(self, request: Any, response: Any) -> Any:
        """Returns the response; one that states the failure if the handler raises.

        ROS 2 has no response for an error of a service, and the client would wait forever.
        """
        try:
            return self.handler(request)
        except CallError as error:
            text = str(error)
        except Exception as error:
            _LOG.exception("service %s raised", self.key[1])
            text = sendable_text(f"{type(error).__name__}: {text_of(error)}")
        if hasattr(response, "message"):
            response.message = text
        else:
            _LOG.error("service %s failed: %s", self.key[1], text)
        return response


def fields_service(
    name: str, handler: Callable[[Any], dict[str, Any]]
) -> tuple[type[Any], Callable[[Any], Any]]:
    """Returns the class and the handler of a service whose handler returns fields.

    Args:
        name: `PACKAGE/NAME`, see `service_class`.
        handler: Returns the fields of the response by name, see `Transport.serve`.
    """
    found = service_class(name)
    types = found.Response.get_fields_and_field_types()

    def respond(request: Any) -> Any:
        fields = handler(request)
        return found.Response(**{name: _field(types[name], each) for name, each in fields.items()})

    return found, respond


def _field(field_type: str, value: Any) -> Any:
    """Converts a field of a response to its type of ROS."""
    if field_type == "builtin_interfaces/Time":
        return convert.time(value)
    if field_type == "sequence<geometry_msgs/Pose2D>":
        from geometry_msgs.msg import Pose2D

        return [Pose2D(x=x, y=y, theta=theta) for x, y, theta in value]
    return message_field(field_type, value)
