"""Services that are registered asynchronously, called by a client of the same process."""

from __future__ import annotations

from typing import Any

import pytest
import rospy
from std_srvs.srv import SetBool, SetBoolResponse
from waiting import TIMEOUT

from flatland.errors import FlatlandError
from flatland.node.transport import CallError
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.service import Service

NAME = "/flatland_tests/switch"


def answer(request: Any) -> SetBoolResponse:
    """Refuses to switch off."""
    if not request.data:
        raise CallError("it must remain on")
    return SetBoolResponse(success=True, message="on")


def providers(ros: Any) -> list[str]:
    """Returns the nodes that offer the service."""
    return [
        node for name, nodes in ros.master.getSystemState()[2] if name == NAME for node in nodes
    ]


def test_a_service_is_offered_until_it_is_closed(registrar: Registrar, ros: Any) -> None:
    service = Service(registrar, NAME, SetBool, answer, owner="switch of model")
    assert registrar.flush(TIMEOUT)
    assert service.ready
    assert (service.name, service.owner) == (NAME, "switch of model")
    assert len(providers(ros)) == 1
    call = rospy.ServiceProxy(NAME, SetBool)
    assert call(True) == SetBoolResponse(success=True, message="on")
    with pytest.raises(rospy.ServiceException, match="it must remain on"):
        call(False)
    with pytest.raises(FlatlandError):
        Service(registrar, NAME, SetBool, answer)
    for _ in range(2):
        service.close()
    assert registrar.flush(TIMEOUT)
    assert providers(ros) == []
    # The name is available again.
    again = Service(registrar, NAME, SetBool, answer)
    assert registrar.flush(TIMEOUT)
    assert rospy.ServiceProxy(NAME, SetBool)(True).success
    again.close()
    assert registrar.flush(TIMEOUT)


def test_a_service_that_is_closed_before_its_registration_is_never_offered(
    registrar: Registrar, ros: Any
) -> None:
    opened: list[Service] = []

    def open_and_close() -> None:
        # In the thread of the registrar: the registration waits behind this action.
        opened.append(Service(registrar, NAME, SetBool, answer))
        opened[0].close()

    registrar.submit(open_and_close)
    assert registrar.flush(TIMEOUT)
    assert registrar.flush(TIMEOUT)  # also what the action has submitted
    assert not opened[0].ready
    assert providers(ros) == []
