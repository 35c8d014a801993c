"""What the services of the node have in common: requests, their results and their errors."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

import rospy

from flatland.errors import FlatlandError
from flatland.ros.names import sendable_text
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import wait_for
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

REGISTRATION_TIMEOUT: Final = 5.0
"""Limit of wall time for the registration of the topics of new models [s]."""

R = TypeVar("R")


class CallError(Exception):
    """A service call failed; the text is the message of the response.

    Attributes:
        index: Index of the item of the request that caused the failure; -1 if there is none.
    """

    def __init__(self, text: str, index: int = -1) -> None:
        """Initializes the error."""
        super().__init__(sendable_text(text))
        self.index = index


class ServiceCalls:
    """Carries out service calls in the thread that steps the world.

    Attributes:
        registrar: Registers topics and services.
        simulation: The simulation.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation) -> None:
        """Stores the attributes."""
        self.registrar = registrar
        self.simulation = simulation

    def carry_out(self, action: Callable[[], R]) -> R:
        """Runs an action between two steps; called in the thread of a service.

        Returns:
            What the action returned.

        Raises:
            CallError: The action raised, or the simulation does not carry it out.
        """
        return self.result(self.simulation.post(action))

    def result(self, done: Future[R]) -> R:
        """Waits for a request.

        A client may use the topics of a model as soon as it receives the response: they are
        registered when this function returns.

        Args:
            done: Result of the request.

        Raises:
            CallError: The request failed, or the simulation does not carry it out.
        """
        try:
            return wait_for(done, self.simulation.world.requests)
        except (FlatlandError, rospy.ServiceException) as error:
            text = error.text_with_hint if isinstance(error, FlatlandError) else str(error)
            index = getattr(error, "index", None)
            raise CallError(text, -1 if index is None else index) from error
        except Exception as error:
            _LOG.exception("unexpected internal error in a service call")
            raise CallError(f"{type(error).__name__}: {error}") from error
        finally:
            self.registrar.flush(REGISTRATION_TIMEOUT)
