"""Carries out the service calls of each page of the documentation.

The program `rosservice` is replaced by calls from this process, because its start takes longer than
most calls. `test_msgs_package.py` runs it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import genpy
import pytest
import rospy
import rosservice
import yaml
from geometry_msgs.msg import Twist
from programs import run_program
from sensor_msgs.msg import LaserScan

_CALL = re.compile(r"^rosservice call .*$", re.MULTILINE)
# The pages and their worlds.
PAGES = {
    "README.md": "office",
    "docs/models.md": "office",
    "docs/navigation.md": "office",
    "docs/ros.md": "office",
    "docs/viewer.md": "office",
    "docs/moving_models.md": "trailers",
}
# Prints the arguments of a call after the expansions of the shell, each followed by a null byte.
_PRINT_ARGUMENTS = """rosservice() { printf '%s\\0' "$@"; }; """


@pytest.fixture(scope="module")
def serve(module_launcher: Any, module_ros: Any, checkout: Path) -> Callable[[str], None]:
    """Starts the server of a world, unless it is running."""
    running = ""

    def start(world: str) -> None:
        nonlocal running
        if world != running:
            module_launcher.stop()
            module_launcher.server(checkout / "worlds" / world / "world.yaml")
            running = world
            if world == "office":  # One of the calls waits for these topics.
                module_ros.topic("/scan", LaserScan)
                module_ros.publisher("/cmd_vel", Twist)

    return start


@pytest.mark.parametrize(("page", "world"), PAGES.items())
def test_the_calls_of_a_page_succeed(
    serve: Callable[[str], None],
    ros: Any,
    checkout: Path,
    ros_environment: dict[str, str],
    page: str,
    world: str,
) -> None:
    serve(world)
    ros.reset()
    calls = _CALL.findall((checkout / page).read_text())
    assert calls
    for call in calls:
        command_line = ["bash", "-c", _PRINT_ARGUMENTS + call]
        printed = run_program(command_line, env=ros_environment, check=True).stdout
        command, service, *arguments = printed.split("\0")[:-1]
        assert command == "call"
        service_type = rosservice.get_service_class_by_name(service)
        request = service_type._request_class()
        genpy.message.fill_message_args(request, [yaml.safe_load(each) for each in arguments])
        response = rospy.ServiceProxy(service, service_type)(request)
        assert getattr(response, "success", True), f"{call}\n{response}"


def test_all_pages_with_calls_are_tested(checkout: Path) -> None:
    pages = [checkout / "README.md", *sorted((checkout / "docs").glob("*.md"))]
    with_calls = [
        str(page.relative_to(checkout)) for page in pages if _CALL.search(page.read_text())
    ]
    # tests/examples run all commands of these pages.
    run_by_examples = {"docs/lockstep.md", "docs/several_robots.md", "docs/write_a_plugin.md"}
    assert set(with_calls) - run_by_examples == set(PAGES)
