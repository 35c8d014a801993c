"""Entry point of the viewer: checks the requirements, opens the window, runs the event loop."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from flatland.ros.rospy_import import defer_catkin
from flatland.ros_addresses import master_address
from flatland.streams import accept_any_text
from flatland.viewer.restarts import STOP_SIGNALS, run_with_restarts, stop_signals_blocked

if TYPE_CHECKING:
    from flatland.viewer.rviz_panel import RvizPanel

_LOG = logging.getLogger("flatland")
NODE_NAME: Final = "flatland_viz"
SIMULATOR_NODE_NAME: Final = "flatland_server"
_USE_SIM_TIME: Final = "/use_sim_time"
_BLANK_CHECKS: Final = 10
_BLANK_CHECK_PERIOD: Final = 1000  # ms


def main() -> int:
    """Runs the viewer, and starts it again if RViz crashes.

    Returns:
        The exit code: 0 after the window was closed or a stop signal was received, 1 if the
        viewer cannot start. The reason is then in the log.
    """
    return run_with_restarts(_run)


def _run(disable_restarts: Callable[[], None], is_last_start: bool) -> int:
    accept_any_text()
    defer_catkin()
    import rosgraph
    import rospy

    try:
        uri = rosgraph.get_master_uri()
        master_address(uri)
        online = rosgraph.is_master_online()
    except ValueError as error:
        print(f"flatland_viz: {error} (from ROS_MASTER_URI)", file=sys.stderr)
        return 1
    if not online:
        # rospy.init_node would wait for the master without showing a window or a message.
        print(f"flatland_viz: no ROS master at {uri}: start the simulator first", file=sys.stderr)
        return 1
    from flatland.ros.logs import log_to_ros, log_without_file

    log_without_file()
    with stop_signals_blocked():
        # Anonymous, so that several viewers can run. RViz reads the simulated time, rospy does not.
        rospy.init_node(NODE_NAME, anonymous=True, disable_signals=True, disable_rostime=True)
    log_to_ros()
    error_text = _startup_error()
    if error_text:
        _LOG.critical("the viewer cannot start: %s. The simulator continues without it", error_text)
        rospy.signal_shutdown("the viewer cannot start")
        return 1
    if not rospy.has_param(_USE_SIM_TIME):
        # RViz reads the parameter only once, at its start, and server.launch may run later.
        rospy.set_param(_USE_SIM_TIME, True)
        _LOG.info("set %s to true, as server.launch does", _USE_SIM_TIME)
    return _show_window(disable_restarts, is_last_start)


def _startup_error() -> str:
    """Returns why the viewer cannot start, empty if it can."""
    # RViz renders through X11, also on a Wayland desktop.
    os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
    error_text = _display_error()
    if error_text:
        return error_text
    try:
        importlib.import_module("PyQt5.QtWidgets")
        # Importing `rviz` is not sufficient: any folder of that name is a namespace package.
        importlib.import_module("rviz.librviz_sip")
    except ImportError as error:
        return (
            f"PyQt5 and RViz's Python bindings are required (python3-pyqt5, python3-rviz): {error}"
        )
    return ""


def _display_error() -> str:
    """Returns why the X display cannot be used, empty if it can.

    Qt aborts the process if it cannot open the display, RViz if the display has no OpenGL.
    """
    if os.environ["QT_QPA_PLATFORM"] != "xcb":
        return ""
    name = os.environ.get("DISPLAY", "")
    if not name:
        return "there is no display (DISPLAY is not set)"
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError as error:
        return f"the X11 client library is required: {error}"
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return f"the display {name} cannot be opened"
    output_arguments = (ctypes.byref(ctypes.c_int()) for _ in range(3))
    has_glx = x11.XQueryExtension(ctypes.c_void_p(display), b"GLX", *output_arguments)
    x11.XCloseDisplay(display)
    return "" if has_glx else f"the display {name} has no OpenGL (GLX extension)"


def _show_window(disable_restarts: Callable[[], None], is_last_start: bool) -> int:
    # A signal must not interrupt the initialization of RViz, which installs its own handlers. They
    # must not run in another thread either, where the signal would be lost.
    with stop_signals_blocked():
        import rospy
        from PyQt5.QtCore import QTimer
        from PyQt5.QtWidgets import QApplication

        from flatland.viewer.ros_link import RosLink
        from flatland.viewer.simulator_client import SimulatorClient
        from flatland.viewer.window import ViewerWindow

        app = QApplication(["flatland"])
        link = RosLink(SimulatorClient(rospy.resolve_name(SIMULATOR_NODE_NAME)))
        window = ViewerWindow(link)
        # Python runs signal handlers between bytecodes: the timer of the status bar ensures that
        # Python code runs regularly.
        for number in STOP_SIGNALS:
            signal.signal(number, lambda *_: app.quit())
        rospy.on_shutdown(app.quit)
        window.show()
        link.start()
        if not is_last_start:
            _crash_if_blank(window.rviz_panel)
        # Unblocked inside the event loop: `quit` has no effect before it runs.
        QTimer.singleShot(0, _unblock_stop_signals)
        app.exec_()
        disable_restarts()
    link.close()
    return 0


def _crash_if_blank(panel: RvizPanel) -> None:
    """Aborts this process if RViz draws nothing, which can happen at its start on a busy machine.

    Nothing else reports it: Qt ignores errors of the X server.
    """
    from PyQt5.QtCore import QTimer

    timer = QTimer(panel.widget)
    blank = 0  # checks; RViz draws several frames between two of them, however slow the machine is

    def check() -> None:
        nonlocal blank
        has_picture = panel.has_picture()
        if has_picture:
            timer.stop()
        elif has_picture is not None:
            blank += 1
        if blank == _BLANK_CHECKS:
            _LOG.error("RViz draws nothing")
            os.abort()

    timer.timeout.connect(check)
    timer.start(_BLANK_CHECK_PERIOD)


def _unblock_stop_signals() -> None:
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
