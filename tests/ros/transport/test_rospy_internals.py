"""Internals of rospy whose change no other test would show; docs/architecture.md lists all."""

from __future__ import annotations

import inspect
import sys

import rospy.impl.rosout
from programs import run_program
from rospy.impl.paramserver import ParamServerCache

SEARCH_AFTER_A_SHORT_IMPORT = """
import sys
from flatland.ros.rospy_import import defer_catkin

defer_catkin()
import rospy, roslib.packages

assert "catkin_pkg" not in sys.modules and "pyparsing" not in sys.modules
[found] = roslib.packages.find_node("flatland", "flatland_server")
assert "catkin_pkg" in sys.modules
defer_catkin()
assert roslib.packages.find_node("flatland", "flatland_server") == [found]
print(found)
"""

SLOW_REGISTRATION = """
import threading, time
from flatland.ros.rospy_import import shorten_registration
import rospy
from rospy.impl.masterslave import ROSHandler

shorten_registration()
waits, answers = [], []
sleep, is_registered = time.sleep, ROSHandler._is_registered

def sleep_and_record(seconds):
    if threading.current_thread() is threading.main_thread():
        waits.append(seconds)
    sleep(seconds)

def is_registered_later(handler):
    answers.append(is_registered(handler) and len(answers) > 4)
    return answers[-1]

time.sleep, ROSHandler._is_registered = sleep_and_record, is_registered_later
rospy.init_node("late", disable_signals=True, disable_rostime=True)
assert answers[-1] and len(answers) > 5, answers
assert len(waits) >= 5 and max(waits) < 0.01, waits
rospy.signal_shutdown("")
"""


def test_cached_parameters_need_no_master() -> None:
    """`log_to_ros` stores the parameter that rospy reads for each message of `/rosout`."""
    assert 'get_param_cached("/rosout_disable_topics_generation"' in inspect.getsource(
        rospy.impl.rosout._rosout
    )
    cache = ParamServerCache()
    cache.set("/pinned", False)
    assert cache.get("/pinned") is False


def test_rospy_is_imported_without_catkin_until_a_package_is_searched(
    ros_environment: dict[str, str], server_path: str
) -> None:
    program = [sys.executable, "-c", SEARCH_AFTER_A_SHORT_IMPORT]
    assert run_program(program, env=ros_environment, check=True).stdout.strip() == server_path


def test_the_registration_is_polled_often(ros_master: dict[str, str]) -> None:
    """rospy waits for 0.1 s if the node is not registered at its first check."""
    run_program([sys.executable, "-c", SLOW_REGISTRATION], env=ros_master, check=True)
