"""Internals of rospy whose change no other test would show; docs/architecture.md lists all."""

from __future__ import annotations

import inspect

import rospy.impl.rosout
from rospy.impl.paramserver import ParamServerCache


def test_cached_parameters_need_no_master() -> None:
    """`log_to_ros` stores the parameter that rospy reads for each message of `/rosout`."""
    assert 'get_param_cached("/rosout_disable_topics_generation"' in inspect.getsource(
        rospy.impl.rosout._rosout
    )
    cache = ParamServerCache()
    cache.set("/pinned", False)
    assert cache.get("/pinned") is False
