"""The thread that registers topics and services, without a node of the simulator."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.ros.transport.registrar import Registrar


@pytest.fixture
def registrar(ros: Any) -> Iterator[Registrar]:
    """A registrar that is connected to the ROS master of the tests."""
    registrar = Registrar()
    yield registrar
    assert registrar.flush(TIMEOUT)  # rospy keeps a topic that is not closed, with its type.
    registrar.close(TIMEOUT)
