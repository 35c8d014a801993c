"""Places a model with the mouse: events of the render panel on their way to RViz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from PyQt5.QtCore import QEvent, QObject, QPoint, Qt, pyqtSignal
from PyQt5.QtGui import QCursor, QMouseEvent

from flatland.viewer.outline import Outline
from flatland.viewer.placement import Placement, Stage
from flatland.viewer.preview import at_pose, no_markers, preview_markers
from flatland.viewer.scene import WORLD_FRAME, Scene


class SpawnTool(QObject):
    """Takes the left button while a model is being placed; the others still move the camera.

    Attributes:
        active: Whether a model is being placed.
    """

    placed = pyqtSignal(object)  # the pose: (x, y, theta) in the world frame [m, rad]
    stage_changed = pyqtSignal(object)  # Stage
    ended = pyqtSignal()  # after `placed`, or cancelled

    def __init__(self, scene: Scene, show: Callable[[Any], None]) -> None:
        """Waits for `start`.

        Args:
            scene: Whose mouse it takes.
            show: Shows a MarkerArray as the preview.
        """
        super().__init__()
        self._scene = scene
        self._show = show
        self._placement = Placement()
        self._markers: list[Any] = []
        self.active = False

    def start(self, outlines: Sequence[Outline]) -> None:
        """Lets the outline of a model follow the mouse."""
        self._placement = Placement()
        self._markers = preview_markers(outlines, WORLD_FRAME)
        panel = self._scene.panel
        if not self.active:
            self.active = True
            panel.installEventFilter(self)
        self._move(panel.mapFromGlobal(QCursor.pos()))
        self.stage_changed.emit(self._placement.stage)

    def cancel(self) -> None:
        """Stops without placing; does nothing when no model is being placed."""
        if self.active:
            self._end()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        """Handles what the mouse does; True keeps an event from RViz."""
        kind = event.type()
        if not isinstance(event, QMouseEvent):
            return False
        if kind == QEvent.Type.MouseMove:
            self._move(event.pos())
            return bool(event.buttons() & Qt.MouseButton.LeftButton)
        if event.button() != Qt.MouseButton.LeftButton:
            return False
        # A double click is two clicks: the model keeps its heading.
        if kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick):
            self._click(event)
        return True

    def _move(self, point: QPoint) -> None:
        self._placement.move(*self._scene.to_world(point))
        self._show(at_pose(self._markers, self._placement.pose))

    def _click(self, event: QMouseEvent) -> None:
        self._placement.click(*self._scene.to_world(event.pos()))
        self.stage_changed.emit(self._placement.stage)
        if self._placement.stage is Stage.DONE:
            pose = self._placement.pose
            self._end()
            self.placed.emit(pose)
        else:
            self._show(at_pose(self._markers, self._placement.pose))

    def _end(self) -> None:
        self.active = False
        self._scene.panel.removeEventFilter(self)
        self._show(no_markers())
        self.ended.emit()
