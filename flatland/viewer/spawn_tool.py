"""The spawn tool: handles mouse events of the render panel before RViz to place a model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from PyQt5.QtCore import QEvent, QObject, QPoint, Qt, pyqtSignal
from PyQt5.QtGui import QCursor, QMouseEvent

from flatland.viewer.outline import Outline
from flatland.viewer.placement import Placement, Stage
from flatland.viewer.preview import at_pose, delete_all_markers, preview_markers
from flatland.viewer.rviz_panel import WORLD_FRAME, RvizPanel


class SpawnTool(QObject):
    """Places a model with the left mouse button; the other buttons still move the camera.

    Attributes:
        active: Whether a model is being placed.
    """

    placed = pyqtSignal(object)  # the pose: (x, y, theta) in the world frame [m, rad]
    stage_changed = pyqtSignal(object)  # Stage
    ended = pyqtSignal()  # placed or cancelled; emitted before `placed`

    def __init__(self, rviz_panel: RvizPanel, publish_preview: Callable[[Any], None]) -> None:
        """Creates an inactive tool.

        Args:
            rviz_panel: The view in which models are placed.
            publish_preview: Publishes a MarkerArray on the topic of the preview.
        """
        super().__init__()
        self._rviz_panel = rviz_panel
        self._publish_preview = publish_preview
        self._placement = Placement()
        self._markers: list[Any] = []
        self.active = False

    def start(self, outlines: Sequence[Outline]) -> None:
        """Starts placing a model with the given outlines, at the mouse position."""
        self._placement = Placement()
        self._markers = preview_markers(outlines, WORLD_FRAME)
        render_panel = self._rviz_panel.render_panel
        if not self.active:
            self.active = True
            render_panel.installEventFilter(self)
        self._move(render_panel.mapFromGlobal(QCursor.pos()))
        self.stage_changed.emit(self._placement.stage)

    def cancel(self) -> None:
        """Cancels the placement; has no effect if no model is being placed."""
        if self.active:
            self._end()

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        """Handles mouse events of the render panel; returns True to hide an event from RViz."""
        kind = event.type()
        if not isinstance(event, QMouseEvent):
            return False
        if kind == QEvent.Type.MouseMove:
            self._move(event.pos())
            return bool(event.buttons() & Qt.MouseButton.LeftButton)
        if event.button() != Qt.MouseButton.LeftButton:
            return False
        # A double click counts as two clicks at one point, which leave the heading at 0.
        if kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick):
            self._click(event)
        return True

    def _move(self, point: QPoint) -> None:
        self._placement.move(*self._rviz_panel.to_world(point))
        self._publish_preview(at_pose(self._markers, self._placement.pose))

    def _click(self, event: QMouseEvent) -> None:
        self._placement.click(*self._rviz_panel.to_world(event.pos()))
        self.stage_changed.emit(self._placement.stage)
        if self._placement.stage is Stage.DONE:
            pose = self._placement.pose
            self._end()
            self.placed.emit(pose)
        else:
            self._publish_preview(at_pose(self._markers, self._placement.pose))

    def _end(self) -> None:
        self.active = False
        self._rviz_panel.render_panel.removeEventFilter(self)
        self._publish_preview(delete_all_markers())
        self.ended.emit()
