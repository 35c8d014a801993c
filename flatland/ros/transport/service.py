"""A service that is registered asynchronously."""

from __future__ import annotations

import importlib
import logging
from collections.abc import Callable
from typing import Any

import rospy
from rospy.exceptions import TransportTerminated

from flatland.node.parameters import OWN_PACKAGE
from flatland.node.transport import CallError
from flatland.ros.message_types import service_class, with_arrays
from flatland.ros.transport.registrar import Registrar

_LOG = logging.getLogger("flatland")


class _Provider(rospy.Service):  # type: ignore[misc]
    """A service of rospy that logs no error about a client that closes its connection.

    Programs that only find out whether a service exists close it before their request, and a client
    that is ended before the response.
    """

    def handle(self, transport: Any, header: dict[str, str]) -> None:
        """Handles the requests of a connection; called by rospy in a thread of its own."""
        is_persistent = header.get("persistent", "").lower() in ("1", "true")
        try:
            while header.get("probe") != "1":
                for request in transport.receive_once():
                    self._handle_request(transport, request)
                if not is_persistent:
                    return
        except TransportTerminated as error:
            _LOG.debug("a client of %s has closed its connection: %s", self.resolved_name, error)
        finally:
            transport.close()

    def error_handler(
        self, error: Exception, kind: type[Exception], value: Exception, traceback: Any
    ) -> None:
        """Logs an exception of the handler, unless the client has ended; called by rospy."""
        if not isinstance(error, TransportTerminated):
            super().error_handler(error, kind, value, traceback)


class Service:
    """Handles each request in a thread of its own.

    Attributes:
        name: Resolved name of the service.
        owner: Plugin that offers the service, for messages.
    """

    def __init__(
        self,
        registrar: Registrar,
        name: str,
        service_type: type[Any],
        handler: Callable[[Any], Any],
        *,
        owner: str = "",
    ) -> None:
        """Advertises a service asynchronously.

        Args:
            registrar: Registers the service with the ROS master.
            name: Name in the namespace of the node, global with a leading `/`.
            service_type: ROS service class.
            handler: Called with each request; returns the response. A `CallError` is reported to
                the client without a traceback in the log.
            owner: Plugin that offers the service, for messages.

        Raises:
            FlatlandError: This node already has a service of this name.
        """
        self.name: str = rospy.resolve_name(name)
        self.owner = owner
        self._registrar = registrar
        self._service_type = service_type
        self._handler = handler
        self._closed = False
        self._service: rospy.Service | None = None
        registrar.claim("service", self.name, service_type, self, shared=False)
        registrar.submit(self._open)

    @property
    def ready(self) -> bool:
        """Whether the service is registered."""
        return self._service is not None

    def close(self) -> None:
        """Unregisters the service asynchronously."""
        if self._closed:
            return
        self._closed = True
        self._registrar.release("service", self.name, self)
        self._registrar.submit(self._end)

    def _handle(self, request: Any) -> Any:
        try:
            return self._handler(request)
        except CallError as error:
            raise rospy.ServiceException(str(error)) from error

    def _open(self) -> None:
        if not self._closed:
            self._service = _Provider(self.name, self._service_type, self._handle)

    def _end(self) -> None:
        if self._service is not None:
            self._service.shutdown()


def fields_service(
    service_type: str, handler: Callable[[Any], dict[str, Any]]
) -> tuple[type[Any], Callable[[Any], Any]]:
    """Returns the class and the handler of a service whose handler returns fields.

    Args:
        service_type: `PACKAGE/NAME`, with the package `flatland` for the selected one.
        handler: Returns the fields of the response by name, see `Transport.serve`.
    """
    package, _, name = service_type.partition("/")
    if package == OWN_PACKAGE:
        base = service_class(name)
    else:
        base = getattr(importlib.import_module(f"{package}.srv"), name)

    class Served(base):  # type: ignore[misc, valid-type]
        """The service with requests and responses whose arrays are numpy arrays."""

        _request_class = with_arrays(base._request_class)
        _response_class = with_arrays(base._response_class)

    response_type = Served._response_class
    types = dict(zip(response_type.__slots__, response_type._slot_types, strict=True))

    def respond(request: Any) -> Any:
        fields = handler(request)
        return response_type(**{name: _field(types[name], value) for name, value in fields.items()})

    return Served, respond


def _field(field_type: str, value: Any) -> Any:
    """Converts a field of a response to its type of ROS."""
    from geometry_msgs.msg import Pose2D

    from flatland.ros.adapters import convert, message_field

    if field_type == "time":
        return convert.time(value)
    if field_type == "geometry_msgs/Pose2D[]":
        return [Pose2D(*pose) for pose in value]
    return message_field(field_type, value)
