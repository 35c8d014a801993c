"""The service `set_appearance`."""

from __future__ import annotations

from typing import Any, Final

from flatland.ros.message_types import service_class
from flatland.ros.service_calls import CallError, ServiceCalls
from flatland.ros.transport.service import Service

SERVICE: Final = "set_appearance"


class AppearanceService:
    """Changes colours, layers and visibility of models on behalf of other nodes."""

    def __init__(self, calls: ServiceCalls) -> None:
        """Advertises the service asynchronously.

        Args:
            calls: Carries out the calls.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._world = calls.simulation.world
        service = service_class("SetAppearance")
        request = service._request_class
        self._visible: dict[int, bool | None] = {
            request.KEEP: None,
            request.SHOW: True,
            request.HIDE: False,
        }
        Service(calls.registrar, SERVICE, service, self._serve)

    # rospy converts the returned fields to the response class of the service.

    def _serve(self, request: Any) -> tuple[bool, str]:
        if request.visible not in self._visible:
            return False, f"visible must be 0 (KEEP), 1 (SHOW) or -1 (HIDE), got {request.visible}"
        try:
            self._calls.carry_out(
                lambda: self._world.set_appearance(
                    request.model,
                    request.body,
                    color=request.color or None,
                    layers=request.layers or None,
                    visible=self._visible[request.visible],
                )
            )
        except CallError as error:
            return False, str(error)
        return True, ""
