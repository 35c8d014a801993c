"""The window: the picture, the tool bar above it and the status below."""

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

from flatland.srv import SetRate, SpawnModel
from flatland.viewer.bounds import Bounds, union
from flatland.viewer.outline import Outline, read_outline
from flatland.viewer.placement import Stage
from flatland.viewer.ros_link import RosLink
from flatland.viewer.scene import Scene
from flatland.viewer.server import ServerState
from flatland.viewer.spawn_dialog import SpawnChoice, SpawnDialog
from flatland.viewer.spawn_tool import SpawnTool
from flatland.viewer.status import Status

_LOG = logging.getLogger("flatland")
_Icon = QStyle.StandardPixmap
_ICONS: Final = "/usr/share/rviz/icons/classes"
_HINTS: Final = {
    Stage.PLACE: "Click where the model is to stand. Escape cancels.",
    Stage.TURN: "Move the mouse to turn the model, click to spawn it. Escape cancels.",
}
_SETTLED_AFTER: Final = 200  # ms after models came or went
_SPACE: Final = 3.0  # m around models in a world without walls
_CAMERA_HINT: Final = "Left button: turn. Middle button, or Shift and left: move. Wheel: zoom."


class ViewerWindow(QMainWindow):
    """Shows a simulator and offers its services."""

    def __init__(self, link: RosLink) -> None:
        """Makes the window and starts RViz in it.

        Args:
            link: To the simulator; its signals move the window, `start` is the caller's affair.
        """
        super().__init__()
        self.setWindowTitle("flatland")
        self.resize(1200, 800)
        self.scene = Scene()
        self.status = Status(lambda: self.scene.time)
        self._link = link
        self._preview = rospy.Publisher("~preview", MarkerArray, queue_size=2, latch=True)
        self.spawn_tool = SpawnTool(self.scene, self._preview.publish)
        self._models: set[str] = set()
        self._bounds: dict[str, Bounds] = {}  # by the topic of their layer
        self._model_bounds: Bounds | None = None
        self._lasers: set[str] = set()
        self._folder = ""
        self._choice = SpawnChoice()
        self._dialog: SpawnDialog | None = None
        # Until the user moves the camera it follows what there is to see.
        self._fits = True
        # Many may come at once.
        self._models_changed = QTimer(self)
        self._models_changed.setSingleShot(True)
        self._models_changed.setInterval(_SETTLED_AFTER)
        self._models_changed.timeout.connect(link.measure_models)
        self._make_actions()
        self.setCentralWidget(self.scene.widget)
        self.setStatusBar(self.status)
        self.scene.add_interactive_markers(
            link.server.resolve("interactive_model_markers/update"), "Move Objects"
        )
        self.scene.add_markers(rospy.resolve_name("~preview"), "preview")
        self.scene.use_interact_tool()
        self.scene.panel.installEventFilter(self)
        self._connect()

    # -- set-up ----------------------------------------------------------------------------

    def _make_actions(self) -> None:
        tools = QActionGroup(self)
        style = self.style()
        self.interact = QAction(QIcon(f"{_ICONS}/Interact.png"), "Interact", tools)
        self.interact.setToolTip("show handles to drag, turn and delete the models (I)")
        self.interact.setShortcut("I")
        self.move_camera = QAction(QIcon(f"{_ICONS}/MoveCamera.png"), "Move camera", tools)
        self.move_camera.setToolTip(f"hide the handles (M). {_CAMERA_HINT}")
        self.move_camera.setShortcut("M")
        self.whole_world = QAction(style.standardIcon(_Icon.SP_DesktopIcon), "Whole world", self)
        self.whole_world.setToolTip("show all layers and models (F)")
        self.whole_world.setShortcut("F")
        self.toggle_pause = QAction(self)
        self.toggle_pause.setShortcut("Space")
        self.spawn = QAction(QIcon(f"{_ICONS}/../plus.png"), "Spawn model", tools)
        self.spawn.setToolTip("put a new model into the world (S)")
        self.spawn.setShortcut("S")
        for tool in (self.interact, self.move_camera, self.spawn):
            tool.setCheckable(True)
        self.interact.setChecked(True)
        bar = QToolBar("Tools")
        bar.setMovable(False)
        bar.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        bar.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        bar.addActions([self.interact, self.move_camera, self.whole_world])
        bar.addSeparator()
        bar.addAction(self.toggle_pause)
        bar.addSeparator()
        bar.addAction(self.spawn)
        self.addToolBar(bar)
        for action, name in (
            (self.interact, "interact"),
            (self.move_camera, "move_camera"),
            (self.whole_world, "whole_world"),
            (self.toggle_pause, "toggle_pause"),
            (self.spawn, "spawn"),
        ):
            bar.widgetForAction(action).setObjectName(name)
        self._show_paused(False)

    def _connect(self) -> None:
        link = self._link
        link.debug_topics.connect(self._show_topics)
        link.layer_bounds.connect(self._show_bounds)
        link.model_bounds.connect(self._show_model_bounds)
        link.paused.connect(self._show_paused)
        link.state.connect(self._show_state)
        self.interact.triggered.connect(self._use_tool)
        self.move_camera.triggered.connect(self._use_tool)
        self.whole_world.triggered.connect(self._show_whole_world)
        self.toggle_pause.triggered.connect(self._toggle_pause)
        self.spawn.triggered.connect(self._ask_for_model)
        self.spawn_tool.stage_changed.connect(lambda stage: self._hint(_HINTS.get(stage, "")))
        self.spawn_tool.placed.connect(self._spawn)
        self.spawn_tool.ended.connect(self._leave_spawn_tool)
        self.status.rate_wanted.connect(self._set_rate)
        QShortcut(QKeySequence(Qt.Key.Key_Escape), self, self._cancel)
        quit_action = QAction("Quit", self)
        quit_action.setShortcut("Ctrl+Q")
        quit_action.triggered.connect(self._quit)
        self.addAction(quit_action)

    # -- what the simulator tells ----------------------------------------------------------

    def _show_topics(self, topics: list[str]) -> None:
        """Adds and removes displays until there is one for each debug topic."""
        wanted = {self._link.server.debug_topic(topic): topic for topic in topics}
        prefix = self._link.server.debug_topic("")
        for topic in self.scene.topics - wanted.keys():
            if topic.startswith(prefix):
                self.scene.remove(topic)
        for topic in sorted(wanted.keys() - self.scene.topics):
            self.scene.add_markers(topic, wanted[topic])
        self._models = {
            topic.removeprefix("model/") for topic in topics if topic.startswith("model/")
        }
        left = {topic: bounds for topic, bounds in self._bounds.items() if topic in topics}
        if self._bounds and not left:
            self._fits = True  # It is another world.
            self._model_bounds = None
        self._bounds = left
        self._models_changed.start()

    def _show_bounds(self, layer: str, bounds: Bounds | None) -> None:
        self._bounds.pop(layer, None)
        if bounds is not None:
            self._bounds[layer] = bounds
        self._fit()

    def _show_model_bounds(self, bounds: Bounds | None) -> None:
        self._model_bounds = bounds
        self._fit()

    def _fit(self) -> None:
        """Shows all layers and models, unless the user has moved the camera."""
        parts = list(self._bounds.values())
        if self._model_bounds is not None:
            # Without walls, there is some space to drive in.
            parts.append(self._model_bounds.grown(0.0 if parts else _SPACE))
        if self._fits and parts:
            self.scene.fit(union(parts))

    def _show_paused(self, paused: bool) -> None:
        icon, text = (_Icon.SP_MediaPause, "Pause")
        if paused:
            icon, text = (_Icon.SP_MediaPlay, "Resume")
        self.toggle_pause.setIcon(self.style().standardIcon(icon))
        self.toggle_pause.setText(text)
        self.toggle_pause.setToolTip(f"{text.lower()} the simulation (space bar)")
        self.status.show_paused(paused)

    def _show_state(self, state: ServerState) -> None:
        self.status.show_state(state)
        if not state.running:
            self._show_paused(False)
        self._folder = os.path.dirname(state.world_path)  # noqa: PTH120 - "" stays ""
        wanted = set(state.lasers)
        for topic in self._lasers - wanted:
            self.scene.remove(topic)
        for topic in sorted(wanted - self._lasers):
            self.scene.add_laser(topic)
        self._lasers = wanted

    # -- tools -----------------------------------------------------------------------------

    def _use_tool(self) -> None:
        self.spawn_tool.cancel()
        if self.interact.isChecked():
            self.scene.use_interact_tool()
        else:
            self.scene.use_camera_tool()
            self._hint(_CAMERA_HINT)

    def _show_whole_world(self) -> None:
        self._fits = True
        self._fit()
        self._link.measure_models()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        """Notes that the user took the camera, and keeps keys from RViz."""
        if event.type() in (QEvent.Type.MouseButtonPress, QEvent.Type.Wheel):
            self._fits = False
        elif event.type() == QEvent.Type.Resize:
            self._fit()
        # RViz's keys change its tools, and the tool bar would not know.
        return bool(event.type() == QEvent.Type.KeyPress)

    def _hint(self, text: str) -> None:
        self.status.showMessage(text)

    def _complain(self, title: str, text: str) -> None:
        """Shows an error in a dialog that waits for nobody."""
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
            self._complain("Pause", reason)

        self._link.call(
            "toggle_pause",
            Empty,
            on_success=lambda _response: self.toggle_pause.setEnabled(True),
            on_failure=fail,
        )

    def _set_rate(self, rate: float) -> None:
        def fail(reason: str) -> None:
            self.status.show_last_state()
            self.status.say(f"The rate cannot be set: {reason}")

        self._link.call(
            "set_rate", SetRate, rate, on_success=lambda _response: None, on_failure=fail
        )

    # -- spawning --------------------------------------------------------------------------

    def _ask_for_model(self) -> None:
        self.spawn_tool.cancel()
        self.spawn.setChecked(True)
        if self._dialog is not None:
            self._dialog.raise_()
            return
        self._dialog = SpawnDialog(self, self._choice, self._folder, self._models)
        self._dialog.chosen.connect(self._read_model)
        self._dialog.finished.connect(self._close_dialog)
        self._dialog.open()

    def _close_dialog(self, answer: int) -> None:
        if self._dialog is not None:
            self._dialog.deleteLater()
            self._dialog = None
        if answer == QDialog.DialogCode.Rejected:
            self._leave_spawn_tool()

    def _read_model(self, choice: SpawnChoice) -> None:
        self._choice = choice

        def fail(reason: str) -> None:
            self._leave_spawn_tool()
            self._complain("Spawn model", reason)

        self._link.in_background(
            lambda: read_outline(choice.path, self._link.parameter, name=choice.name),
            self._place_model,
            fail,
        )

    def _place_model(self, outlines: list[Outline]) -> None:
        # The handles of other models are in the way of the mouse.
        self.scene.use_camera_tool()
        self.spawn.setChecked(True)
        self.spawn_tool.start(outlines)

    def _spawn(self, pose: Any) -> None:
        from geometry_msgs.msg import Pose2D

        choice = self._choice
        self._link.call(
            "spawn_model",
            SpawnModel,
            choice.path,
            choice.name,
            choice.name,
            Pose2D(*pose),
            on_success=lambda response: self.status.say(
                response.message or f"Spawned {choice.name}"
            ),
            on_failure=lambda reason: self._complain("Spawn model", reason),
        )

    def _quit(self) -> None:
        self.close()

    def _cancel(self) -> None:
        self.spawn_tool.cancel()

    def _leave_spawn_tool(self) -> None:
        self._hint("")
        self.interact.setChecked(True)
        self.scene.use_interact_tool()
