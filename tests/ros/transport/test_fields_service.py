"""Services whose handlers return fields by name."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rospy
from geometry_msgs.msg import Pose2D

from flatland.node.clock import set_stamps
from flatland.ros.transport.service import fields_service
from flatland.srv import SpawnModels, StepWorld


@pytest.fixture
def wall_time() -> Iterator[None]:
    """Stamps that differ from simulated times, as with `~use_sim_time:=false`."""
    set_stamps(lambda time_ns: time_ns + 1_000_000_001)
    yield
    set_stamps(None)


def test_times_are_converted_to_stamps_of_the_node(wall_time: None) -> None:
    service_type, handle = fields_service("flatland/StepWorld", lambda _: {"stamp": 5})
    response = handle(service_type._request_class())
    assert response.stamp == rospy.Time(1, 6)
    assert service_type._md5sum == StepWorld._md5sum


def test_poses_are_converted() -> None:
    service_type, handle = fields_service(
        "flatland/SpawnModels", lambda _: {"index": -1, "poses": [(1.0, 2.0, 3.0)]}
    )
    response = handle(service_type._request_class())
    assert response.poses == [Pose2D(1, 2, 3)]
    assert (response.success, response.message, response.index) == (False, "", -1)
    assert service_type._type == SpawnModels._type
