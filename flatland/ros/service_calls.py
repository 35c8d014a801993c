"""The common part of the services of the node: requests, their results and their errors."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, TypeVar

import rospy

from flatland.entities.model import Model
from flatland.errors import BatchError, FlatlandError
from flatland.geometry import Pose
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
            raise CallError(text, error.index if isinstance(error, BatchError) else -1) from error
        except Exception as error:
            _LOG.exception("unexpected internal error in a service call")
            raise CallError(f"{type(error).__name__}: {error}") from error
        finally:
            self.registrar.flush(REGISTRATION_TIMEOUT)


def describe_displacement(model: Model | None, requested: Pose) -> str:
    """Describes a pose that differs from the requested one; empty if it does not."""
    if model is None or model.displacement == (0.0, 0.0):
        return ""
    dx, dy = model.displacement
    x, y, theta = requested[0] + dx, requested[1] + dy, requested[2]
    return (
        f'the requested pose is blocked: model "{model.name}" was put at '
        f"({x:.3f}, {y:.3f}, {theta:.3f}), {math.hypot(dx, dy):.3f} m away"
    )


def pose_of(message: Any) -> Pose:
    """Converts a `geometry_msgs/Pose2D`."""
    return (message.x, message.y, message.theta)
