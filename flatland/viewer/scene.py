"""The picture: RViz without its panels, seen from above, and the displays in it."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Final

from PyQt5.QtCore import QPoint, QTimer
from PyQt5.QtGui import QKeySequence
from PyQt5.QtWidgets import QAction, QMainWindow, QToolBar, QWidget

from flatland.geometry import Vector2, rotate
from flatland.viewer.bounds import Bounds
from rviz import bindings as rviz

WORLD_FRAME: Final = "map"
_MARGIN: Final = 1.06  # of the view, around what it is to show
_LASER_COLORS: Final = (
    *("255; 70; 70", "80; 200; 255", "255; 200; 60", "120; 255; 120"),
    *("255; 120; 255", "255; 150; 80", "160; 160; 255", "80; 255; 220"),
)
_LASER_PIXELS: Final = 3
_MARKERS: Final = "rviz/MarkerArray"
_LOOK_EVERY: Final = 100  # ms between two looks at whether RViz has begun anew
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


class Scene:
    """RViz's render panel, for a window to put somewhere.

    Attributes:
        widget: What to put there.
        panel: The widget that gets the mouse's events.
    """

    def __init__(self) -> None:
        """Starts RViz; takes a second or so."""
        self.widget: QMainWindow = rviz.VisualizationFrame()
        self.widget.setSplashPath("")
        with tempfile.TemporaryDirectory() as folder:
            # Without a file it would first show what the user's own RViz shows.
            path = Path(folder) / "viewer.rviz"
            path.write_text(_CONFIG)
            self.widget.initialize(str(path))
        self.widget.menuBar().hide()
        self.widget.statusBar().hide()
        self.widget.setHideButtonVisibility(False)
        for bar in self.widget.findChildren(QToolBar):
            bar.hide()
        # Keys of menus that nobody sees: saving and loading configurations, quitting.
        for action in self.widget.findChildren(QAction):
            action.setShortcut(QKeySequence())
        self.panel = _find_panel(self.widget)
        self._manager: Any = self.widget.getManager()
        self._tools: Any = self._manager.getToolManager()
        self._root: Any = self._manager.getRootDisplayGroup()
        self._displays: dict[str, Any] = {}
        self._lasers_seen: dict[str, str] = {}
        self._age = 0.0  # s of wall time since RViz began
        self._watch = QTimer(self.widget)
        self._watch.timeout.connect(self._look_for_reset)
        self._watch.start(_LOOK_EVERY)

    # -- time ------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """ROS time [s]: the simulated one, if `/use_sim_time` was set at the start."""
        time: float = self._manager.getROSTime()
        return time

    @property
    def frames(self) -> int:
        """How many pictures were drawn."""
        count: int = self._manager.getFrameCount()
        return count

    # -- displays --------------------------------------------------------------------------

    def add_markers(self, topic: str, name: str) -> None:
        """Shows a MarkerArray topic."""
        self._add(_MARKERS, topic, name, {"Marker Topic": topic, "Queue Size": 10})

    def add_interactive_markers(self, topic: str, name: str) -> None:
        """Shows interactive markers by their update topic."""
        self._add("rviz/InteractiveMarkers", topic, name, {"Update Topic": topic})

    def add_laser(self, topic: str) -> None:
        """Shows a LaserScan topic as points, in a colour of its own."""
        # A laser that comes back has its old colour.
        color = self._lasers_seen.setdefault(
            topic, _LASER_COLORS[len(self._lasers_seen) % len(_LASER_COLORS)]
        )
        properties = {
            "Topic": topic,
            "Selectable": False,
            "Style": "Points",
            "Size (Pixels)": _LASER_PIXELS,
            "Color Transformer": "FlatColor",
            "Color": color,
        }
        self._add("rviz/LaserScan", topic, f"laser {topic}", properties)

    def remove(self, topic: str) -> None:
        """Takes away the display of a topic."""
        display = self._displays.pop(topic)
        self._root.takeDisplay(display)
        display.deleteLater()

    @property
    def topics(self) -> set[str]:
        """The topics that are shown."""
        return set(self._displays)

    def _add(self, kind: str, topic: str, name: str, properties: dict[str, object]) -> None:
        display = self._manager.createDisplay(kind, name, False)
        for key, value in properties.items():
            display.subProp(key).setValue(value)
        # Only now, so that it subscribes once and to the right topic.
        display.setEnabled(True)
        self._displays[topic] = display

    def _look_for_reset(self) -> None:
        """Gets those markers again that RViz forgot.

        When the time goes back, as it does with the next simulator, RViz clears all displays. A
        marker of a latched topic that came before the new time did would not come again.
        """
        age = self._manager.getWallClockElapsed()
        if age < self._age:
            for display in self._displays.values():
                if display.getClassId() == _MARKERS:
                    # A new subscriber gets the latched message.
                    display.setEnabled(False)
                    display.setEnabled(True)
        self._age = age

    # -- tools -----------------------------------------------------------------------------

    def use_interact_tool(self) -> None:
        """Shows the interactive markers; elsewhere the mouse moves the camera."""
        self._tools.setCurrentTool(self._tools.getTool(0))

    def use_camera_tool(self) -> None:
        """Hides the interactive markers; the mouse moves the camera."""
        self._tools.setCurrentTool(self._tools.getTool(1))

    # -- view ------------------------------------------------------------------------------

    def to_world(self, point: QPoint) -> tuple[float, float]:
        """Returns the place in the world frame [m] below a point of the panel."""
        (x, y), angle, scale = self._camera()
        right = (point.x() + 0.5 - self.panel.width() / 2) / scale
        up = (self.panel.height() / 2 - point.y() - 0.5) / scale
        dx, dy = rotate((right, up), angle)
        return (x + dx, y + dy)

    def to_panel(self, x: float, y: float) -> QPoint:
        """Returns the point of the panel that shows a place in the world frame [m]."""
        center, angle, scale = self._camera()
        right, up = rotate((x - center[0], y - center[1]), -angle)
        return QPoint(
            round(self.panel.width() / 2 + right * scale - 0.5),
            round(self.panel.height() / 2 - up * scale - 0.5),
        )

    def fit(self, bounds: Bounds) -> None:
        """Shows a part of the world, and the grid below all of it."""
        view = self._view()
        width, height = bounds.size
        scale = min(
            self.panel.width() / max(_MARGIN * width, 1.0),
            self.panel.height() / max(_MARGIN * height, 1.0),
        )
        view.subProp("Scale").setValue(scale * self.panel.devicePixelRatioF())
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
        """Returns the view's centre [m], its angle [rad] and Qt's pixels in a metre."""
        x, y, angle, scale = (
            self._view().subProp(name).getValue() for name in ("X", "Y", "Angle", "Scale")
        )
        # RViz counts the screen's pixels, Qt its own.
        return (x, y), angle, scale / self.panel.devicePixelRatioF()


def _find_panel(frame: QWidget) -> QWidget:
    """Finds the render panel: the bindings have no name for it."""
    for widget in frame.findChildren(QWidget):
        if isinstance(widget, QWidget) and widget.metaObject().className() == "rviz::RenderPanel":
            return widget
    raise RuntimeError("RViz's window has no render panel")
