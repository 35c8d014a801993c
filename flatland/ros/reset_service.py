"""The service `reset_world`, which returns the world to its state after loading."""

from __future__ import annotations

from typing import Any, Final

from flatland.ros.message_types import service_class
from flatland.ros.service_calls import CallError, ServiceCalls
from flatland.ros.transport.service import Service

SERVICE: Final = "reset_world"
KEEP_SEED: Final = -1


class ResetService:
    """Resets the world; topics that exist before and after stay registered."""

    def __init__(self, calls: ServiceCalls) -> None:
        """Advertises the service asynchronously.

        Args:
            calls: Carries out the calls.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._world = calls.simulation.world
        Service(calls.registrar, SERVICE, service_class("ResetWorld"), self._serve)

    def _serve(self, request: Any) -> tuple[bool, str]:
        if request.seed < KEEP_SEED:
            return False, f"seed must be at least 0, or -1 for the current one, got {request.seed}"
        seed = None if request.seed == KEEP_SEED else request.seed

        def reset() -> None:
            with self._calls.registrar.closing_last():
                self._world.reset(seed=seed, keep_time=request.keep_time)

        try:
            self._calls.carry_out(reset)
        except CallError as error:
            return False, str(error)
        return True, ""
