"""The 3-D view: an RViz frame without its own controls, viewed from above, and its displays."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Final

from PyQt5.QtCore import QPoint, QRect, Qt, QTimer
from PyQt5.QtGui import QImage, QKeySequence, QPixmap
from PyQt5.QtWidgets import QAction, QMainWindow, QToolBar, QWidget

from flatland.geometry import Vector2, rotate
from flatland.viewer.bounds import Bounds
from rviz import bindings as rviz

WORLD_FRAME: Final = "map"
_FIT_FACTOR: Final = 1.06  # size of the view relative to the bounds that it shows
_LASER_COLORS: Final = (
    *("255; 70; 70", "80; 200; 255", "255; 200; 60", "120; 255; 120"),
    *("255; 120; 255", "255; 150; 80", "160; 160; 255", "80; 255; 220"),
)
_LASER_POINT_SIZE: Final = 3  # pixels
_MARKER_ARRAY_CLASS: Final = "rviz/MarkerArray"
_RESET_POLL_PERIOD: Final = 0.1  # s
_CONFIG: Final = f"""
Panels: []
Visualization Manager:
  Class: ""
  Enabled: true
  Global Options: {{Background Color: 48; 48; 48, Fixed Frame: {WORLD_FRAME}, Frame Rate: 30}}
  Displays:
    - Class: rviz/Grid
      Name: Grid
      Enabled: true
      Value: true
      Alpha: 0.12
      Cell Size: 1
      Color: 200; 200; 200
      Plane Cell Count: 100
  Tools:
    - {{Class: rviz/Interact, Hide Inactive Objects: true}}
    - {{Class: rviz/MoveCamera}}
  Views:
    Current: {{Class: rviz/TopDownOrtho, Name: Current View, Scale: 20, X: 0, Y: 0, Angle: 0}}
"""


class RvizPanel:
    """An RViz visualization frame to embed in a window.

    Attributes:
        widget: The widget to embed.
        render_panel: The part of the widget that receives the mouse events.
    """

    def __init__(self) -> None:
        """Starts RViz, which takes about one second."""
        self.widget: QMainWindow = rviz.VisualizationFrame()
        self.widget.setSplashPath("")
        with tempfile.TemporaryDirectory() as folder:
            # Without a file, RViz loads the user's own configuration.
            path = Path(folder) / "viewer.rviz"
            path.write_text(_CONFIG)
            self.widget.initialize(str(path))
        self.widget.menuBar().hide()
        self.widget.statusBar().hide()
        self.widget.setHideButtonVisibility(False)
        for bar in self.widget.findChildren(QToolBar):
            bar.hide()
        # The shortcuts of the hidden menus (save, open, quit) would still work.
        for action in self.widget.findChildren(QAction):
            action.setShortcut(QKeySequence())
        self.render_panel = _find_render_panel(self.widget)
        self._manager: Any = self.widget.getManager()
        self._tools: Any = self._manager.getToolManager()
        self._root: Any = self._manager.getRootDisplayGroup()
        self._displays: dict[str, Any] = {}
        self._laser_colors: dict[str, str] = {}
        self._elapsed = 0.0  # s of wall time since the last reset of RViz
        self._reset_timer = QTimer(self.widget)
        self._reset_timer.timeout.connect(self._check_for_reset)
        self._reset_timer.start(round(1000 * _RESET_POLL_PERIOD))

    def has_picture(self) -> bool | None:
        """Whether anything is drawn: RViz clears the view to dark grey, so not all of it is black.

        Returns:
            None if this is unknown, because the screen does not show the window.
        """
        window = self.widget.window()
        if not window.windowHandle().isExposed():
            return None
        # With the windows in it, unlike `QWidget.grab`: OGRE draws into one of its own.
        pixmap = window.screen().grabWindow(window.winId())
        scale = pixmap.devicePixelRatioF()
        corner = self.render_panel.mapTo(window, QPoint(0, 0))
        area = (corner.x(), corner.y(), self.render_panel.width(), self.render_panel.height())
        view = QRect(*(round(scale * value) for value in area))
        return None if _is_black(pixmap) else not _is_black(pixmap.copy(view))

    # -- time ------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """ROS time [s]; simulated time if `/use_sim_time` was true when RViz started."""
        time: float = self._manager.getROSTime()
        return time

    # -- displays --------------------------------------------------------------------------

    def add_markers(self, topic: str, name: str) -> None:
        """Adds a display of a MarkerArray topic."""
        properties = {"Marker Topic": topic, "Queue Size": 10}
        self._add(_MARKER_ARRAY_CLASS, topic, name, properties)

    def add_interactive_markers(self, topic: str, name: str) -> None:
        """Adds a display of interactive markers, given their update topic."""
        self._add("rviz/InteractiveMarkers", topic, name, {"Update Topic": topic})

    def add_laser(self, topic: str) -> None:
        """Adds a display of a LaserScan topic, as points in a color of its own."""
        # A laser that is removed and added again keeps its color.
        color = self._laser_colors.setdefault(
            topic, _LASER_COLORS[len(self._laser_colors) % len(_LASER_COLORS)]
        )
        properties = {
            "Topic": topic,
            "Selectable": False,
            "Style": "Points",
            "Size (Pixels)": _LASER_POINT_SIZE,
            "Color Transformer": "FlatColor",
            "Color": color,
        }
        self._add("rviz/LaserScan", topic, f"laser {topic}", properties)

    def remove(self, topic: str) -> None:
        """Removes the display of a topic.

        Raises:
            KeyError: The topic has no display.
        """
        display = self._displays.pop(topic)
        self._root.takeDisplay(display)
        display.deleteLater()

    @property
    def topics(self) -> set[str]:
        """The topics that have a display."""
        return set(self._displays)

    def _add(self, kind: str, topic: str, name: str, properties: dict[str, object]) -> None:
        display = self._manager.createDisplay(kind, name, False)
        for key, value in properties.items():
            display.subProp(key).setValue(value)
        # Enabled last, so that it subscribes only once, to the configured topic.
        display.setEnabled(True)
        self._displays[topic] = display

    def _check_for_reset(self) -> None:
        """Subscribes to all marker topics again after RViz has cleared its displays.

        RViz clears all displays when the ROS time jumps back, for example when the simulator is
        restarted. Markers of a latched topic that were received before the jump would be lost.
        """
        elapsed = self._manager.getWallClockElapsed()
        if elapsed < self._elapsed:
            for display in self._displays.values():
                if display.getClassId() == _MARKER_ARRAY_CLASS:
                    # A new subscriber receives the latched message.
                    display.setEnabled(False)
                    display.setEnabled(True)
        self._elapsed = elapsed

    # -- tools -----------------------------------------------------------------------------

    def use_interact_tool(self) -> None:
        """Shows the interactive markers; outside of them the mouse moves the camera."""
        self._tools.setCurrentTool(self._tools.getTool(0))

    def use_move_camera_tool(self) -> None:
        """Hides the interactive markers; the mouse moves the camera."""
        self._tools.setCurrentTool(self._tools.getTool(1))

    # -- view ------------------------------------------------------------------------------

    def to_world(self, point: QPoint) -> tuple[float, float]:
        """Converts a point of the render panel to world coordinates (x, y) [m]."""
        (x, y), angle, scale = self._camera()
        right = (point.x() + 0.5 - self.render_panel.width() / 2) / scale
        up = (self.render_panel.height() / 2 - point.y() - 0.5) / scale
        dx, dy = rotate((right, up), angle)
        return (x + dx, y + dy)

    def fit(self, bounds: Bounds) -> None:
        """Fits the view to a rectangle, and extends the grid below all of it."""
        view = self._view()
        width, height = bounds.size
        scale = min(
            self.render_panel.width() / max(_FIT_FACTOR * width, 1.0),
            self.render_panel.height() / max(_FIT_FACTOR * height, 1.0),
        )
        view.subProp("Scale").setValue(scale * self.render_panel.devicePixelRatioF())
        view.subProp("X").setValue(bounds.center[0])
        view.subProp("Y").setValue(bounds.center[1])
        view.subProp("Angle").setValue(0.0)
        grid = self._root.getDisplayAt(0)
        grid.subProp("Plane Cell Count").setValue(2 * round(max(width, height) / 2 * 1.5 + 10))
        grid.subProp("Offset").subProp("X").setValue(float(round(bounds.center[0])))
        grid.subProp("Offset").subProp("Y").setValue(float(round(bounds.center[1])))

    def _view(self) -> Any:
        return self._manager.getViewManager().getCurrent()

    def _camera(self) -> tuple[Vector2, float, float]:
        """Returns the center of the view [m], its angle [rad] and its scale [Qt pixels/m]."""
        x, y, angle, scale = (
            self._view().subProp(name).getValue() for name in ("X", "Y", "Angle", "Scale")
        )
        # RViz uses device pixels, Qt device-independent pixels.
        return (x, y), angle, scale / self.render_panel.devicePixelRatioF()


def _is_black(pixmap: QPixmap) -> bool:
    image = pixmap.toImage().convertToFormat(QImage.Format.Format_RGB32)
    black = QImage(image.size(), image.format())
    black.fill(Qt.GlobalColor.black)
    return bool(image == black)


def _find_render_panel(frame: QWidget) -> QWidget:
    """Finds the render panel by its class name: the bindings have no accessor for it."""
    for widget in frame.findChildren(QWidget):
        if isinstance(widget, QWidget) and widget.metaObject().className() == "rviz::RenderPanel":
            return widget
    raise RuntimeError("RViz's frame has no render panel")
