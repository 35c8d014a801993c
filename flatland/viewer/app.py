"""Starts the viewer: checks what it needs, makes the window, runs until it is closed."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import signal
import sys
from typing import Final

_LOG = logging.getLogger("flatland")
NODE_NAME: Final = "flatland_viz"
SERVER_NAME: Final = "flatland_server"
_USE_SIM_TIME: Final = "/use_sim_time"
_STOP_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


def main() -> int:
    """Runs the viewer.

    Returns:
        The exit code: 0 after the window was closed or a stop was asked for, 1 when the viewer
        cannot start, for a reason that the log tells.
    """
    # Told to stop while it starts, as when the simulator fails, it says nothing.
    for number in _STOP_SIGNALS:
        signal.signal(number, lambda *_: sys.exit(0))
    import rosgraph
    import rospy

    try:
        online = rosgraph.is_master_online()
    except ValueError as error:
        print(f"flatland_viz: {error} (from ROS_MASTER_URI)", file=sys.stderr)
        return 1
    if not online:
        # rospy would wait for it, without a window and without a word.
        uri = rosgraph.get_master_uri()
        print(f"flatland_viz: no ROS master at {uri}: start the simulator first", file=sys.stderr)
        return 1
    # Each viewer is a node of its own, unless it is given a name. The time comes from RViz.
    rospy.init_node(NODE_NAME, anonymous=True, disable_signals=True, disable_rostime=True)
    from flatland.ros.logs import log_to_ros

    log_to_ros()
    reason = _why_not()
    if reason:
        _LOG.critical("the viewer cannot start: %s. The simulator runs on without it", reason)
        rospy.signal_shutdown("the viewer cannot start")
        return 1
    if not rospy.has_param(_USE_SIM_TIME):
        # RViz looks only once, now: server.launch may come later.
        rospy.set_param(_USE_SIM_TIME, True)
        _LOG.info("%s is set to true, as server.launch does", _USE_SIM_TIME)
    return _run()


def _why_not() -> str:
    """Returns what keeps the viewer from starting, empty when nothing does."""
    # RViz draws through X11, also where the desktop itself is another one.
    os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
    reason = _why_no_display()
    if reason:
        return reason
    try:
        importlib.import_module("PyQt5.QtWidgets")
        # Not just rviz: a folder of that name is enough for that.
        importlib.import_module("rviz.librviz_sip")
    except ImportError as error:
        return f"it needs PyQt5 and RViz's Python bindings (python3-pyqt5, python3-rviz): {error}"
    return ""


def _why_no_display() -> str:
    """Tries the X server: Qt and RViz would abort the process without one, and without OpenGL."""
    if os.environ["QT_QPA_PLATFORM"] != "xcb":
        return ""
    name = os.environ.get("DISPLAY", "")
    if not name:
        return "there is no display (DISPLAY is not set)"
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError as error:
        return f"it needs an X11 client library: {error}"
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return f"the display {name} cannot be opened"
    numbers = (ctypes.byref(ctypes.c_int()) for _ in range(3))
    draws = x11.XQueryExtension(ctypes.c_void_p(display), b"GLX", *numbers)
    x11.XCloseDisplay(display)
    return "" if draws else f"the display {name} has no OpenGL (its extension GLX)"


def _run() -> int:
    import rospy
    from PyQt5.QtCore import QTimer
    from PyQt5.QtWidgets import QApplication

    from flatland.viewer.ros_link import RosLink
    from flatland.viewer.server import Server
    from flatland.viewer.window import ViewerWindow

    # RViz must not be left half made, and it brings signal handlers of its own.
    signal.pthread_sigmask(signal.SIG_BLOCK, _STOP_SIGNALS)
    app = QApplication(["flatland"])
    link = RosLink(Server(rospy.resolve_name(SERVER_NAME)))
    window = ViewerWindow(link)
    # The status line's clock wakes Python often enough for handlers to run.
    for number in _STOP_SIGNALS:
        signal.signal(number, lambda *_: app.quit())
    rospy.on_shutdown(app.quit)
    window.show()
    link.start()
    # Once the application runs: it does not hear of a stop before.
    QTimer.singleShot(0, _take_signals)
    app.exec_()
    link.close()
    return 0


def _take_signals() -> None:
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOP_SIGNALS)
