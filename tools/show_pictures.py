"""Captures the images of the viewer and of RViz in README.md and docs/, on a virtual screen.

Requires the environment of setup.bash. The ROS master is started by this program. navigation.png is
captured only if amcl and move_base are on ROS_PACKAGE_PATH, see examples/navigation/README.md.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from draw_pictures import FURNITURE
from picture_folder import picture_folder
from virtual_screen import Image, VirtualScreen, missing_programs

_CHECKOUT = Path(__file__).resolve().parent.parent
_OFFICE = _CHECKOUT / "worlds" / "office"
_NAVIGATION = _CHECKOUT / "examples" / "navigation"
_NAVIGATION_NODES = ("amcl", "move_base")
_SIZE = (1200, 800)  # of the windows of the viewer and of RViz [px]
_ARROW_COLOR = (255, 217, 26)  # of the heading arrow in the viewer
_FROM_ABOVE = "{Class: rviz/TopDownOrtho, Scale: 34, X: -3, Y: 0.3, Angle: 0}"
_ROUTE = "{Class: rviz/TopDownOrtho, Scale: 46, X: -0.3, Y: -0.6, Angle: 0}"
_GOAL = (4.0, 3.0)  # position in the office [m], with a heading of 0
_ON_THE_WAY = -1.5  # y at which the image is captured [m]
_IN_3D = (
    "{Class: rviz/Orbit, Distance: 24, Focal Point: {X: -1.5, Y: -1, Z: 0}, Pitch: 0.85, Yaw: 4.4}"
)
_SPAWN_BUTTON = (525, 20)  # position in the window of the viewer [px]
_FIRST_FIELD = 24  # distance of the first field from the top of the spawn dialog [px]
_TIMEOUT = 60.0  # s
_DRAWING_TIME = 1.5  # time in which RViz draws a change [s]


def main(arguments: list[str]) -> int:
    """Captures all images."""
    folder = picture_folder(str(__doc__), arguments)
    missing = missing_programs()
    if missing:
        print(f"not installed: {', '.join(missing)} (make setup-dev installs them)")
        return 1
    screen = VirtualScreen(*_SIZE)
    try:
        _capture_navigation(screen, folder / "navigation.png")
        with _simulator(screen) as environment:
            _spawn_furniture()
            _drive(3.0)
            _capture_viewer(screen, folder / "viewer.png")
            _capture_rviz(screen, environment, _FROM_ABOVE, folder / "rviz.png")
            _capture_rviz(screen, environment, _IN_3D, folder / "walls.png")
    finally:
        screen.close()
    return 0


@contextmanager
def _simulator(screen: VirtualScreen) -> Iterator[dict[str, str]]:
    """Runs the office and the viewer with a separate ROS master."""
    port = _new_master()
    environment = {**os.environ, **screen.environment}
    command = ["roslaunch", "-p", port, "flatland", "server.launch", "seed:=1"]
    with _running(command, environment):
        import rosgraph
        import rospy

        _wait("ROS master", rosgraph.is_master_online)
        rospy.init_node("pictures", disable_rostime=True, disable_signals=True)
        yield environment
        rospy.signal_shutdown("all images are saved")


def _new_master() -> str:
    """Sets the variables of a ROS master on an unused port, and returns the port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1")
    return str(port)


@contextmanager
def _running(command: list[str], environment: dict[str, str]) -> Iterator[None]:
    log = subprocess.DEVNULL
    process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)  # noqa: S603
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def _wait(what: str, condition: Callable[[], Any]) -> None:
    end = time.monotonic() + _TIMEOUT
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not available within {_TIMEOUT:g} s")
        time.sleep(0.1)


def _spawn_furniture() -> None:
    """Adds furniture to the office."""
    import rospy
    from geometry_msgs.msg import Pose2D

    from flatland.srv import SpawnModel

    rospy.wait_for_service("/spawn_model", _TIMEOUT)
    spawn = rospy.ServiceProxy("/spawn_model", SpawnModel)
    for number, (kind, pose) in enumerate(FURNITURE, start=1):
        response = spawn(str(_OFFICE / f"{kind}.model.yaml"), f"{kind}_{number}", "", Pose2D(*pose))
        if not response.success:
            raise RuntimeError(response.message)


def _drive(seconds: float) -> None:
    """Drives both robots along a curve."""
    import rospy
    from geometry_msgs.msg import Twist

    robots = {
        rospy.Publisher("/cmd_vel", Twist, queue_size=1): (0.4, 0.12),
        rospy.Publisher("/tricycle/cmd_vel", Twist, queue_size=1): (0.7, 0.03),
    }
    for robot, (speed, turn) in robots.items():
        _wait("subscriber of the commands", robot.get_num_connections)
        command = Twist()
        command.linear.x, command.angular.z = speed, turn
        robot.publish(command)
    time.sleep(seconds)
    for robot in robots:
        robot.publish(Twist())


def _capture_viewer(screen: VirtualScreen, path: Path) -> None:
    """Captures the viewer while a model is being placed."""
    _wait("view of the office", lambda: (screen.picture().max(axis=2) > 150).mean() > 0.02)
    width, height = _SIZE
    for _ in range(4):
        screen.click(0.5 * width, 0.5 * height, button=4)
    _drag(screen, (0.5 * width, 0.5 * height), (0.58 * width, 0.5 * height))
    screen.click(*_SPAWN_BUTTON)
    _wait("spawn dialog", lambda: screen.area_of("Spawn model"))
    left, top, width_of_dialog, _ = screen.area_of("Spawn model")
    screen.click(left + width_of_dialog / 2, top + _FIRST_FIELD)
    screen.key("ctrl+a")
    screen.type(str(_OFFICE / "tricycle.model.yaml"))
    screen.key("Return")
    screen.move(0.88 * width, 0.8 * height)
    _wait("preview of the model", lambda: _has_color(screen.picture(), _ARROW_COLOR))
    screen.click(0.875 * width, 0.72 * height)
    screen.move(0.94 * width, 0.712 * height)
    time.sleep(_DRAWING_TIME)
    _save(screen, path)
    screen.key("Escape", "ctrl+q")


def _capture_rviz(
    screen: VirtualScreen, environment: dict[str, str], view: str, path: Path
) -> None:
    """Captures a part of the office in RViz, with the trajectories of the robots."""
    with tempfile.TemporaryDirectory() as folder:
        config = _with_view(_CHECKOUT / "rviz" / "flatland.rviz", view, Path(folder))
        with _running(["rviz", "-d", str(config)], environment):
            _wait("view of RViz", lambda: (screen.picture()[100:600, 400:1100] > 0).all())
            time.sleep(2 * _DRAWING_TIME)
            _drive(4.0)
            time.sleep(_DRAWING_TIME)
            _save(screen, path)


def _with_view(config: Path, view: str, folder: Path) -> Path:
    """Writes a copy of a configuration of RViz with another view; returns its path."""
    before, rest = config.read_text().split("    Current:\n")
    after = rest[rest.index("    Saved:\n") :]
    copy = folder / "picture.rviz"
    copy.write_text(f"{before}    Current: {view}\n{after}")
    return copy


def _capture_navigation(screen: VirtualScreen, path: Path) -> None:
    """Captures the office robot on its way to a goal, in the RViz of examples/navigation."""
    import rospkg

    packages = rospkg.RosPack().list()
    if missing := [node for node in _NAVIGATION_NODES if node not in packages]:
        print(f"{path}: not captured, not on ROS_PACKAGE_PATH: {', '.join(missing)}")
        return
    port = _new_master()
    package_path = f"{_NAVIGATION}:{os.environ['ROS_PACKAGE_PATH']}"
    environment = {**os.environ, **screen.environment, "ROS_PACKAGE_PATH": package_path}
    with tempfile.TemporaryDirectory() as folder:
        config = _with_view(_NAVIGATION / "rviz" / "navigation.rviz", _ROUTE, Path(folder))
        launch = ["roslaunch", "-p", port, "flatland_navigation", "navigation.launch", "seed:=1"]
        with _running([*launch, f"rviz_config:={config}"], environment):
            code = "import show_pictures as p; p.send_goal()"
            subprocess.run(  # noqa: S603 - a process of its own, because it is a node of this master
                [sys.executable, "-c", code], env=environment, cwd=Path(__file__).parent, check=True
            )
            _save(screen, path)


def send_goal() -> None:
    """Sends the robot to the goal and returns when it is on the way."""
    import rospy
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import OccupancyGrid, Odometry

    rospy.init_node("goal", disable_rostime=True)
    for topic in ("/map", "/move_base/local_costmap/costmap"):
        rospy.wait_for_message(topic, OccupancyGrid, _TIMEOUT)
    time.sleep(4 * _DRAWING_TIME)  # RViz starts
    publisher = rospy.Publisher("/move_base_simple/goal", PoseStamped, queue_size=1)
    _wait("move_base", publisher.get_num_connections)
    goal = PoseStamped()
    goal.header.frame_id = "map"
    goal.pose.position.x, goal.pose.position.y = _GOAL
    goal.pose.orientation.w = 1.0
    publisher.publish(goal)

    def position() -> float:
        truth = rospy.wait_for_message("/odometry/ground_truth", Odometry, _TIMEOUT)
        return float(truth.pose.pose.position.y)

    _wait("the robot on its way", lambda: position() > _ON_THE_WAY)


def _has_color(image: Image, color: tuple[int, int, int]) -> bool:
    """Returns whether an image contains a colour, within a tolerance."""
    return bool((np.abs(image.astype(int) - color).max(axis=2) < 25).sum() > 20)


def _drag(screen: VirtualScreen, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Moves the camera with the middle button."""
    screen.move(*start)
    screen.press(2)
    for step in range(1, 5):
        screen.move(*(a + (b - a) * step / 4 for a, b in zip(start, end, strict=True)))
    screen.release(2)


def _save(screen: VirtualScreen, path: Path) -> None:
    image = screen.picture()[:, :, ::-1]
    cv2.imwrite(str(path), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
