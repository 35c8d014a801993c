"""The main window: tool bar, 3-D view and status bar."""

from __future__ import annotations

import logging
import os
from typing import Any, Final

import rospy
from PyQt5.QtCore import QEvent, QObject, Qt, QTimer
from PyQt5.QtGui import QIcon, QKeySequence
from PyQt5.QtWidgets import (
    QAction,
    QActionGroup,
    QDialog,
    QMainWindow,
    QMessageBox,
    QShortcut,
    QStyle,
    QToolBar,
)
from std_srvs.srv import Empty
from visualization_msgs.msg import MarkerArray

from flatland.ros.message_types import service_class
from flatland.viewer.bounds import Bounds, union
from flatland.viewer.outline import Outline, read_outline
from flatland.viewer.placement import Stage
from flatland.viewer.ros_link import RosLink
from flatland.viewer.rviz_panel import RvizPanel
from flatland.viewer.simulator_client import SimulatorState
from flatland.viewer.spawn_dialog import SpawnChoice, SpawnDialog
from flatland.viewer.spawn_tool import SpawnTool
from flatland.viewer.status_bar import StatusBar

_LOG = logging.getLogger("flatland")
_Icon = QStyle.StandardPixmap
_ICONS: Final = "/usr/share/rviz/icons/classes"
_HINTS: Final = {
    Stage.POSITION: "Click to set the position of the model. Escape cancels.",
    Stage.HEADING: "Move to set the heading, click to spawn. Escape cancels.",
}
_CAMERA_HINT: Final = "Left button: rotate. Middle button or Shift+left: pan. Wheel: zoom."
_MODEL_BOUNDS_DELAY: Final = 200  # ms from the last change of the list of models
_EMPTY_WORLD_MARGIN: Final = 3.0  # m around the models in a world without layers


class ViewerWindow(QMainWindow):
    """Displays a simulator and gives access to its services."""

    def __init__(self, link: RosLink) -> None:
        """Creates the window and starts RViz in it.

        Args:
            link: Connection to the simulator; the caller starts it.
        """
        super().__init__()
        self.setWindowTitle("flatland")
        self.resize(1200, 800)
        self.rviz_panel = RvizPanel()
        self.status_bar = StatusBar(lambda: self.rviz_panel.time)
        self._link = link
        self._preview = rospy.Publisher("~preview", MarkerArray, queue_size=2, latch=True)
        self.spawn_tool = SpawnTool(self.rviz_panel, self._preview.publish)
        self._models: set[str] = set()
        self._layer_bounds: dict[str, Bounds] = {}  # by debug topic
        self._model_bounds: Bounds | None = None
        self._lasers: set[str] = set()
        self._world_folder = ""
        self._choice = SpawnChoice()
        self._dialog: SpawnDialog | None = None
        # The view fits the world until the user moves the camera.
        self._auto_fit = True
        # Several models that change in quick succession cause one update of the bounds.
        self._model_bounds_timer = QTimer(self)
        self._model_bounds_timer.setSingleShot(True)
        self._model_bounds_timer.setInterval(_MODEL_BOUNDS_DELAY)
        self._model_bounds_timer.timeout.connect(link.request_model_bounds)
        self._create_actions()
        self.setCentralWidget(self.rviz_panel.widget)
        self.setStatusBar(self.status_bar)
        self.rviz_panel.add_interactive_markers(
            link.simulator.resolve("interactive_model_markers/update"), "Move Objects"
        )
        self.rviz_panel.add_markers(rospy.resolve_name("~preview"), "preview")
        self.rviz_panel.use_interact_tool()
        self.rviz_panel.render_panel.installEventFilter(self)
        self._connect_signals()

    # -- set-up ----------------------------------------------------------------------------

    def _create_actions(self) -> None:
        tools = QActionGroup(self)
        style = self.style()
        self.interact = QAction(QIcon(f"{_ICONS}/Interact.png"), "Interact", tools)
        self.interact.setToolTip("Show handles to move, rotate and delete models (I)")
        self.interact.setShortcut("I")
        self.move_camera = QAction(QIcon(f"{_ICONS}/MoveCamera.png"), "Move camera", tools)
        self.move_camera.setToolTip(f"Hide the handles (M). {_CAMERA_HINT}")
        self.move_camera.setShortcut("M")
        self.zoom_to_fit = QAction(style.standardIcon(_Icon.SP_DesktopIcon), "Zoom to fit", self)
        self.zoom_to_fit.setToolTip("Fit the view to all layers and models (F)")
        self.zoom_to_fit.setShortcut("F")
        self.toggle_pause = QAction(self)
        self.toggle_pause.setShortcut("Space")
        self.spawn = QAction(QIcon(f"{_ICONS}/../plus.png"), "Spawn model", tools)
        self.spawn.setToolTip("Add a model to the world (S)")
        self.spawn.setShortcut("S")
        for tool in (self.interact, self.move_camera, self.spawn):
            tool.setCheckable(True)
        self.interact.setChecked(True)
        bar = QToolBar("Tools")
        bar.setMovable(False)
        bar.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        bar.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        bar.addActions([self.interact, self.move_camera, self.zoom_to_fit])
        bar.addSeparator()
        bar.addAction(self.toggle_pause)
        bar.addSeparator()
        bar.addAction(self.spawn)
        self.addToolBar(bar)
        for action, name in (
            (self.interact, "interact"),
            (self.move_camera, "move_camera"),
            (self.zoom_to_fit, "zoom_to_fit"),
            (self.toggle_pause, "toggle_pause"),
            (self.spawn, "spawn"),
        ):
            bar.widgetForAction(action).setObjectName(name)
        self._show_paused(False)

    def _connect_signals(self) -> None:
        link = self._link
        link.debug_topics.connect(self._update_marker_displays)
        link.layer_bounds.connect(self._set_layer_bounds)
        link.model_bounds.connect(self._set_model_bounds)
        link.paused.connect(self._show_paused)
        link.state.connect(self._show_state)
        self.interact.triggered.connect(self._select_tool)
        self.move_camera.triggered.connect(self._select_tool)
        self.zoom_to_fit.triggered.connect(self._zoom_to_fit)
        self.toggle_pause.triggered.connect(self._toggle_pause)
        self.spawn.triggered.connect(self._open_spawn_dialog)
        self.spawn_tool.stage_changed.connect(lambda stage: self._show_hint(_HINTS.get(stage, "")))
        self.spawn_tool.placed.connect(self._spawn)
        self.spawn_tool.ended.connect(self._leave_spawn_tool)
        self.status_bar.rate_requested.connect(self._set_rate)
        QShortcut(QKeySequence(Qt.Key.Key_Escape), self, self._cancel)
        quit_action = QAction("Quit", self)
        quit_action.setShortcut("Ctrl+Q")
        quit_action.triggered.connect(self._quit)
        self.addAction(quit_action)

    # -- state of the simulator ------------------------------------------------------------

    def _update_marker_displays(self, topics: list[str]) -> None:
        """Adds and removes displays so that there is one for each debug topic."""
        names = {self._link.simulator.debug_topic(topic): topic for topic in topics}
        prefix = self._link.simulator.debug_topic("")
        for topic in self.rviz_panel.topics - names.keys():
            if topic.startswith(prefix):
                self.rviz_panel.remove(topic)
        for topic in sorted(names.keys() - self.rviz_panel.topics):
            self.rviz_panel.add_markers(topic, names[topic])
        self._models = {
            topic.removeprefix("model/") for topic in topics if topic.startswith("model/")
        }
        if self._dialog is not None:
            self._dialog.set_existing(self._models)
        remaining = {topic: value for topic, value in self._layer_bounds.items() if topic in topics}
        if self._layer_bounds and not remaining:
            # No layer is left: another world was loaded.
            self._auto_fit = True
            self._model_bounds = None
        self._layer_bounds = remaining
        self._model_bounds_timer.start()

    def _set_layer_bounds(self, layer: str, bounds: Bounds | None) -> None:
        self._layer_bounds.pop(layer, None)
        if bounds is not None:
            self._layer_bounds[layer] = bounds
        self._fit()

    def _set_model_bounds(self, bounds: Bounds | None) -> None:
        self._model_bounds = bounds
        self._fit()

    def _fit(self) -> None:
        """Fits the view to all layers and models, unless the user has moved the camera."""
        parts = list(self._layer_bounds.values())
        if self._model_bounds is not None:
            margin = 0.0 if parts else _EMPTY_WORLD_MARGIN
            parts.append(self._model_bounds.expanded(margin))
        if self._auto_fit and parts:
            self.rviz_panel.fit(union(parts))

    def _show_paused(self, paused: bool) -> None:
        icon, text = (_Icon.SP_MediaPause, "Pause")
        if paused:
            icon, text = (_Icon.SP_MediaPlay, "Resume")
        self.toggle_pause.setIcon(self.style().standardIcon(icon))
        self.toggle_pause.setText(text)
        self.toggle_pause.setToolTip(f"{text} the simulation (Space)")
        self.status_bar.show_paused(paused)

    def _show_state(self, state: SimulatorState) -> None:
        self.status_bar.show_state(state)
        if not state.running:
            self._show_paused(False)
        self._world_folder = os.path.dirname(state.world_path)  # noqa: PTH120 - "" stays ""
        lasers = set(state.lasers)
        for topic in self._lasers - lasers:
            self.rviz_panel.remove(topic)
        for topic in sorted(lasers - self._lasers):
            self.rviz_panel.add_laser(topic)
        self._lasers = lasers

    # -- tools -----------------------------------------------------------------------------

    def _select_tool(self) -> None:
        self.spawn_tool.cancel()
        if self.interact.isChecked():
            self.rviz_panel.use_interact_tool()
        else:
            self.rviz_panel.use_move_camera_tool()
            self._show_hint(_CAMERA_HINT)

    def _zoom_to_fit(self) -> None:
        self._auto_fit = True
        self._fit()
        self._link.request_model_bounds()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        """Stops fitting the view when the user moves the camera, and hides key events from RViz."""
        if event.type() in (QEvent.Type.MouseButtonPress, QEvent.Type.Wheel):
            self._auto_fit = False
        elif event.type() == QEvent.Type.Resize:
            self._fit()
        # RViz's shortcuts would change its tool without updating the tool bar.
        return bool(event.type() == QEvent.Type.KeyPress)

    def _show_hint(self, text: str) -> None:
        self.status_bar.showMessage(text)

    def _show_error(self, title: str, text: str) -> None:
        """Logs an error and shows it in a dialog, without waiting for the dialog to be closed."""
        _LOG.warning("%s: %s", title, text)
        box = QMessageBox(self)
        box.setIcon(QMessageBox.Icon.Warning)
        box.setWindowTitle(title)
        box.setText(text)
        box.setTextFormat(Qt.TextFormat.PlainText)
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.open()

    # -- services --------------------------------------------------------------------------

    def _toggle_pause(self) -> None:
        self.toggle_pause.setEnabled(False)

        def fail(reason: str) -> None:
            self.toggle_pause.setEnabled(True)
            self._show_error("Pause/Resume", reason)

        self._link.call(
            "toggle_pause",
            Empty,
            on_success=lambda _response: self.toggle_pause.setEnabled(True),
            on_failure=fail,
        )

    def _set_rate(self, rate: float) -> None:
        def fail(reason: str) -> None:
            self.status_bar.reset_rate()
            self.status_bar.show_temporary_message(f"Cannot set the update rate: {reason}")

        self._link.call(
            "set_rate",
            service_class("SetRate"),
            rate,
            on_success=lambda _response: None,
            on_failure=fail,
        )

    # -- spawning --------------------------------------------------------------------------

    def _open_spawn_dialog(self) -> None:
        self.spawn_tool.cancel()
        self.spawn.setChecked(True)
        if self._dialog is not None:
            self._dialog.raise_()
            return
        self._dialog = SpawnDialog(self, self._choice, self._world_folder, self._models)
        self._dialog.chosen.connect(self._read_outline)
        self._dialog.finished.connect(self._close_spawn_dialog)
        self._dialog.open()

    def _close_spawn_dialog(self, result: int) -> None:
        if self._dialog is not None:
            self._dialog.deleteLater()
            self._dialog = None
        if result == QDialog.DialogCode.Rejected:
            self._leave_spawn_tool()

    def _read_outline(self, choice: SpawnChoice) -> None:
        self._choice = choice

        def fail(reason: str) -> None:
            self._leave_spawn_tool()
            self._show_error("Spawn model", reason)

        self._link.run_in_background(
            lambda: read_outline(choice.path, self._link.parameter, name=choice.name),
            self._start_spawn_tool,
            fail,
        )

    def _start_spawn_tool(self, outlines: list[Outline]) -> None:
        # The handles of other models would receive the mouse events.
        self.rviz_panel.use_move_camera_tool()
        self.spawn.setChecked(True)
        self.spawn_tool.start(outlines)

    def _spawn(self, pose: Any) -> None:
        from geometry_msgs.msg import Pose2D

        choice = self._choice
        self._link.call(
            "spawn_model",
            service_class("SpawnModel"),
            choice.path,
            choice.name,
            choice.name,
            Pose2D(*pose),
            on_success=lambda response: self.status_bar.show_temporary_message(
                response.message or f"Spawned {choice.name}"
            ),
            on_failure=lambda reason: self._show_error("Spawn model", reason),
        )

    def _quit(self) -> None:
        self.close()

    def _cancel(self) -> None:
        self.spawn_tool.cancel()

    def _leave_spawn_tool(self) -> None:
        self._show_hint("")
        self.interact.setChecked(True)
        self.rviz_panel.use_interact_tool()
