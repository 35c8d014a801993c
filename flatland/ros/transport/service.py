"""A service that is registered without waiting for the ROS master."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import rospy

from flatland.ros.registrar import Registrar


class Service:
    """Answers requests, each in a thread of its own.

    Attributes:
        name: The resolved name of the service.
    """

    def __init__(
        self,
        registrar: Registrar,
        name: str,
        service_type: type[Any],
        handler: Callable[[Any], Any],
    ) -> None:
        """Offers a service, soon.

        Args:
            registrar: Talks to the ROS master.
            name: Under the node's namespace, global with a leading `/`.
            service_type: The ROS service class.
            handler: Called with each request, returns the response.

        Raises:
            FlatlandError: This node has a service of that name.
        """
        self.name: str = rospy.resolve_name(name)
        self._registrar = registrar
        self._service_type = service_type
        self._handler = handler
        self._closed = False
        self._service: rospy.Service | None = None
        registrar.claim("service", self.name, service_type, shared=False)
        registrar.submit(self._open)

    def close(self) -> None:
        """Ends the service, soon."""
        if self._closed:
            return
        self._closed = True
        self._registrar.release("service", self.name)
        self._registrar.submit(self._end)

    def _open(self) -> None:
        if not self._closed:
            self._service = rospy.Service(self.name, self._service_type, self._handler)

    def _end(self) -> None:
        if self._service is not None:
            self._service.shutdown()


def wait_for(future: Future[Any]) -> Any:
    """Waits in a service's thread for what the simulation's thread makes of a request.

    Raises:
        rospy.ServiceException: The node shuts down first.
    """
    while True:
        try:
            return future.result(timeout=0.2)
        except TimeoutError:
            if future.done():
                raise
            if rospy.core.is_shutdown_requested():
                raise rospy.ServiceException("the simulator is shutting down") from None
