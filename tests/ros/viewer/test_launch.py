"""The viewer and RViz as started by server.launch, and their start-up errors."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import numpy as np
import pytest
import rosgraph
import rosnode
import yaml
from rosgraph_msgs.msg import Clock

PROGRAM = shutil.which("flatland_viz") or "flatland_viz"
BLUE, CYAN, RED = (0, 0, 255), (0, 255, 255), (255, 70, 70)
# The 3-D view between RViz's panels; the icon of one of its tools is magenta as well.
RVIZ_PANEL = {"x": 366, "y": 64, "width": 816, "height": 636}

# A viewer whose view is black at the first start: without grid, on a black background.
BLACK_AT_FIRST = """
import os
import sys
from pathlib import Path
from flatland.viewer import app, rviz_panel, window

aborted, abort = Path(sys.argv[1]), os.abort

class Panel(rviz_panel.RvizPanel):
    def __init__(self):
        # RViz may also crash by itself, and start again.
        if not aborted.exists():
            for text, other in ("48; 48; 48", "0; 0; 0"), ("Alpha: 0.12", "Alpha: 0"):
                rviz_panel._CONFIG = rviz_panel._CONFIG.replace(text, other)
        super().__init__()

def abort_once():
    aborted.touch()
    abort()

os.abort = abort_once
window.RvizPanel = Panel
sys.exit(app.main())
"""


@pytest.fixture(autouse=True)
def clean_parameters() -> Iterator[None]:
    """Deletes the parameters of a launch, so that they do not affect the next server."""
    yield
    with contextlib.suppress(rosgraph.MasterException):
        rosgraph.Master("/flatland_tests").deleteParam("/flatland_server")


def nodes() -> list[str]:
    return [name.split("_1")[0] for name in rosnode.get_node_names()]


def process_id(node: str) -> int:
    """Returns the process of a node."""
    proxy: Any = ServerProxy(rosgraph.Master("/flatland_tests").lookupNode(node))
    return int(proxy.getPid("/flatland_tests")[2])


def subscriptions(node: str) -> set[str]:
    _, subscribers, _ = rosgraph.Master("/flatland_tests").getSystemState()
    return {topic for topic, names in subscribers if node in names}


def launch_rviz(
    on_screen: Any, room: Path, screenshot: Callable[..., Any], eventually: Callable[..., Any]
) -> Any:
    """Starts the simulator and RViz, again if RViz crashes, as it does in 1 of 100 starts."""
    wanted = {
        *("/tf", "/scan", "/odometry/filtered", "/interactive_model_markers/update"),
        *(f"/flatland_server/debug/all_{kind}" for kind in ("layers", "layers_3d", "models")),
    }
    launch = on_screen.launch("flatland", "server.launch", f"world_path:={room}", "use_rviz:=true")

    def has_died() -> bool:
        return re.search(r"rviz-\d+. process has died", launch.output) is not None

    eventually("all subscriptions of RViz", lambda: has_died() or subscriptions("/rviz") >= wanted)
    if screenshot(lambda picture: True, RVIZ_PANEL, has_ended=has_died) is not None:
        return launch
    launch.stop()
    return launch_rviz(on_screen, room, screenshot, eventually)


def test_rviz_displays_everything_without_user_input(
    on_screen: Any,
    ros: Any,
    room: Path,
    screen: Any,
    screenshot: Callable[..., Any],
    eventually: Callable[..., Any],
) -> None:
    launch = launch_rviz(on_screen, room, screenshot, eventually)

    def shows_scan_and_robot(picture: Any) -> bool:
        # Seen from above, the scan is on the walls and the robot is at its pose.
        scan = picture.places(RED)
        assert len(scan) > 30
        assert (np.abs(np.abs(scan).max(axis=1) - 5.0) < 0.15).mean() > 0.9
        x, y = picture.at(4, 4)
        assert np.abs(picture.image[int(y), int(x)].astype(int) - 48).max() < 40
        ring = picture.places(BLUE)
        assert len(ring) > 0
        assert np.median(ring, axis=0) == pytest.approx((-2, 1), abs=0.1)
        return True

    screenshot(shows_scan_and_robot, RVIZ_PANEL)
    assert "/rviz" in nodes()
    assert "process[flatland_viz" not in launch.output
    # The tool that moves the camera hides the handle, which covers the robot.
    screen.click(500, 200)
    screen.key("m")
    screenshot(lambda picture: len(picture.near(BLUE, -2, 1, 0.4)) > 80, RVIZ_PANEL)
    # Spawned models appear, and deleted models disappear.
    assert ros.spawn(room.parent / "crate.model.yaml", "crate", "", (2, -2, 0)).success

    def shows_crate(picture: Any) -> bool:
        crate = picture.near(CYAN, 2, -2, 0.7)
        assert len(crate) > 10
        assert crate.min(axis=0) == pytest.approx((1.5, -2.25), abs=0.15)
        assert crate.max(axis=0) == pytest.approx((2.5, -1.75), abs=0.15)
        return True

    screenshot(shows_crate, RVIZ_PANEL)
    assert ros.delete("crate").success
    screenshot(lambda picture: not len(picture.near(CYAN, 2, -2, 0.7)), RVIZ_PANEL)
    assert launch.stop() == 0


def test_all_displays_are_enabled_in_the_rviz_configuration(ros: Any, checkout: Path) -> None:
    del ros
    config = yaml.safe_load((checkout / "rviz" / "flatland.rviz").read_text())
    displays = list(config["Visualization Manager"]["Displays"])
    for group in displays:
        displays += group.get("Displays", [])
    kinds = [display["Class"].removeprefix("rviz/") for display in displays]
    for kind, least in {"MarkerArray": 3, "LaserScan": 2, "Odometry": 2, "TF": 1}.items():
        assert kinds.count(kind) >= least, kind
    for display in displays:
        assert (display["Enabled"], display["Value"]) == (True, True), display["Name"]


def test_viewer_starts_with_the_simulator_and_after_a_crash_and_can_be_closed_alone(
    on_screen: Any,
    ros: Any,
    room: Path,
    screen: Any,
    screenshot: Callable[..., Any],
    eventually: Callable[..., Any],
) -> None:
    # With the names of the reference, so that the types of the debug topics are those of
    # flatland_msgs.
    launch = on_screen.launch("flatland_server", "server.launch", f"world_path:={room}")
    screenshot(lambda picture: len(picture.places(BLUE)) > 10)
    crashed = process_id("/flatland_viz")
    os.kill(crashed, signal.SIGSEGV)
    launch.wait_for_line(r"RViz or OpenGL has crashed \(SIGSEGV\); the viewer starts again")

    def shows_robot_again(picture: Any) -> bool:
        with contextlib.suppress(OSError):  # the crashed node is still registered
            return process_id("/flatland_viz") != crashed and len(picture.places(BLUE)) > 10
        return False

    screenshot(shows_robot_again)

    def has_ended() -> bool:
        screen.click(600, 600)  # Without a window manager, a click gives the window the focus.
        screen.key("ctrl+q")
        return (
            re.search(r"flatland_viz-\d+. process has finished cleanly", launch.output) is not None
        )

    eventually("end of the viewer", has_ended, poll_period=1.0)
    assert "Traceback" not in launch.output
    assert ros.topic("/clock", Clock).take(20)
    assert launch.stop() == 0


def test_viewer_starts_again_if_rviz_draws_nothing(
    on_screen: Any, ros: Any, screen: Any, tmp_path: Path, eventually: Callable[..., Any]
) -> None:
    del ros
    viewer = on_screen.program(sys.executable, "-c", BLACK_AT_FIRST, str(tmp_path / "aborted"))
    viewer.wait_for_line("RViz draws nothing")
    viewer.wait_for_line(r"RViz or OpenGL has crashed \(SIGABRT\); the viewer starts again")
    eventually("grey view", lambda: (screen.picture() == 48).all(axis=2).mean() > 0.5)
    viewer.send(signal.SIGINT)
    assert viewer.wait() == 0


def test_viewer_exits_on_a_signal_during_start(on_screen: Any) -> None:
    viewer = on_screen.program(PROGRAM, XDG_RUNTIME_DIR="")
    viewer.wait_for_line("XDG_RUNTIME_DIR not set")  # logged by Qt just before RViz starts
    viewer.send(signal.SIGTERM)
    assert viewer.wait() == 0
    assert "Traceback" not in viewer.output


def test_a_signal_is_not_lost_while_rviz_starts(
    on_screen: Any, ros: Any, eventually: Callable[..., Any]
) -> None:
    del ros
    before = set(rosnode.get_node_names())
    viewer = on_screen.program(PROGRAM)
    # RViz has a node and signal handlers of its own, which a thread of the viewer could run.
    eventually(
        "node of RViz",
        lambda: any("/rviz_" in name for name in set(rosnode.get_node_names()) - before),
        poll_period=0.005,
    )
    viewer.send(signal.SIGINT)
    assert viewer.wait() == 0


def test_viewer_reports_why_it_cannot_start(launcher: Any, screen: Any, tmp_path: Path) -> None:
    def error_of(**environment: str) -> str:
        viewer = launcher.program(PROGRAM, **environment)
        assert viewer.wait() == 1
        assert "Traceback" not in viewer.output
        return str(viewer.output)

    assert "the display :4711 cannot be opened" in error_of(DISPLAY=":4711")
    no_master = error_of(ROS_MASTER_URI="http://127.0.0.1:1", DISPLAY=screen.display)
    assert "no ROS master at http://127.0.0.1:1" in no_master
    without_glx = type(screen)(640, 480, "-extension", "GLX")
    try:
        reason = f"the display {without_glx.display} has no OpenGL"
        assert reason in error_of(DISPLAY=without_glx.display)
    finally:
        without_glx.close()
    # A package `rviz` without bindings, found before the real one.
    (tmp_path / "rviz").mkdir()
    (tmp_path / "rviz" / "__init__.py").touch()
    path = f"{tmp_path}:{launcher.environment.get('PYTHONPATH', '')}"
    assert "python3-rviz" in error_of(PYTHONPATH=path, DISPLAY=screen.display)
