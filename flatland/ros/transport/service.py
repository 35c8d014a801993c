"""A service that is registered asynchronously."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, TypeVar

import rospy

from flatland.ros.transport.registrar import Registrar
from flatland.runtime.requests import Requests

_POLL_PERIOD: Final = 0.2  # s between two checks of a request that waits

R = TypeVar("R")


class Service:
    """Handles each request in a thread of its own.

    Attributes:
        name: Resolved name of the service.
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
            handler: Called with each request; returns the response.
            owner: Plugin that offers the service, for messages.

        Raises:
            FlatlandError: This node already has a service of this name.
        """
        self.name: str = rospy.resolve_name(name)
        self._registrar = registrar
        self._service_type = service_type
        self._handler = handler
        self._owner = owner
        self._closed = False
        self._service: rospy.Service | None = None
        registrar.claim("service", self.name, service_type, owner, shared=False)
        registrar.submit(self._open)

    def close(self) -> None:
        """Unregisters the service asynchronously."""
        if self._closed:
            return
        self._closed = True
        self._registrar.release("service", self.name, self._owner)
        self._registrar.submit(self._end)

    def _open(self) -> None:
        if not self._closed:
            self._service = rospy.Service(self.name, self._service_type, self._handler)

    def _end(self) -> None:
        if self._service is not None:
            self._service.shutdown()


def wait_for(future: Future[R], requests: Requests) -> R:
    """Waits in the thread of a service until the simulation has handled a request.

    Args:
        future: Result of the request.
        requests: The queue of the request.

    Raises:
        rospy.ServiceException: The node shuts down first, or a plugin blocks the simulation; in
            the latter case, the request is withdrawn.
    """
    while True:
        try:
            return future.result(timeout=_POLL_PERIOD)
        except TimeoutError:
            if future.done():
                raise
            if rospy.core.is_shutdown_requested():
                raise rospy.ServiceException("the simulator is shutting down") from None
            if requests.blocked_by and future.cancel():
                raise rospy.ServiceException(
                    f"the simulation is blocked: {requests.blocked_by} does not return"
                ) from None
