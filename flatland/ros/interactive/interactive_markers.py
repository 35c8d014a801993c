"""Interactive markers that move, rotate and delete models in RViz."""

from __future__ import annotations

import logging
import math
from typing import Final

from visualization_msgs.msg import InteractiveMarkerFeedback

from flatland.entities.model import Model
from flatland.errors import FlatlandError
from flatland.geometry import Pose, wrap_angle
from flatland.ros.adapters import convert
from flatland.ros.interactive.drag import Drags
from flatland.ros.interactive.marker_server import MarkerServer
from flatland.ros.interactive.model_handle import DELETE_ENTRY, model_handle
from flatland.ros.markers.packed_markers import FRAME
from flatland.ros.names import UniqueNames, sendable_text
from flatland.ros.transport.registrar import Registrar
from flatland.ros.transport.ticker import Ticker, TickerThread
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

SERVER_NAME: Final = "interactive_model_markers"
UPDATE_RATE: Final = 30.0  # Hz, wall time
KEEP_ALIVE_PERIOD: Final = 0.5  # s, wall time
_MIN_MOVE: Final = 1e-4  # m and rad; smaller changes are not published


class InteractiveMarkers(WorldObserver):
    """Publishes an interactive marker for each model.

    Updates are published at most 30 times per second of wall time, and only if there are clients.
    """

    def __init__(
        self,
        registrar: Registrar,
        simulation: Simulation,
        thread: TickerThread,
        *,
        move_keeps_odometry: bool = False,
    ) -> None:
        """Advertises the topics asynchronously; must be called between two steps.

        Args:
            registrar: Registers the topics with the ROS master.
            simulation: Simulation of the world.
            thread: Posts the periodic work.
            move_keeps_odometry: Whether a drag keeps the odometry of the model.
        """
        self._keep_odometry = move_keeps_odometry
        self._world = simulation.world
        self._closed = False
        self._names = UniqueNames()
        self._models: dict[str, Model] = {}  # by marker name
        self._published: dict[str, Pose] = {}  # last published pose of each marker
        self._drags = Drags(simulation.holds)
        self._keep_alive_due = 0.0
        self._ticker = Ticker("flatland-handles", UPDATE_RATE, simulation.post, self._tick, thread)
        self._server = MarkerServer(
            registrar,
            SERVER_NAME,
            simulation.post,
            pose_of=self._pose_of,
            receive=self._receive,
            on_connection=self._on_connection,
        )
        for model in self._world.models:
            self.model_added(model)
        self._world.add_observer(self)

    def close(self) -> None:
        """Stops publishing and ignores further feedback."""
        self._closed = True
        self._ticker.close()

    # -- events of the world ---------------------------------------------------------------

    def model_added(self, model: Model) -> None:
        """Adds the marker of a model."""
        if self._closed:
            return
        name = self._names.claim(sendable_text(model.name))
        self._models[name] = model
        self._published[name] = model.pose
        self._server.insert(model_handle(model, name))
        self._apply_without_clients()

    def model_changed(self, model: Model) -> None:
        """Replaces the marker of a model whose colours or visibility have changed."""
        name = self._name_of(model)
        if name is None or self._closed:
            return
        self._server.erase(name)
        self._server.insert(model_handle(model, name))
        self._invalidate_published(name)
        self._apply_without_clients()

    def model_removed(self, model: Model) -> None:
        """Removes the marker of a model."""
        name = self._name_of(model)
        if name is None or self._closed:
            return
        self._drags.end(name)
        self._names.release(name)
        del self._models[name], self._published[name]
        self._server.erase(name)
        self._apply_without_clients()

    def _name_of(self, model: Model) -> str | None:
        return next((name for name, other in self._models.items() if other is model), None)

    def _apply_without_clients(self) -> None:
        # Without clients nothing is published, so that the update rate does not matter.
        if not self._server.connected:
            self._server.apply_changes()

    # -- feedback of clients ---------------------------------------------------------------

    def _receive(self, feedback: InteractiveMarkerFeedback, now: float) -> None:
        """Handles feedback; called between two steps."""
        try:
            self._handle(feedback, now)
        except (FlatlandError, ValueError) as error:
            _LOG.warning('interactive marker "%s": %s', feedback.marker_name, error)
        except Exception:
            _LOG.exception("unexpected internal error in the feedback of an interactive marker")

    def _handle(self, feedback: InteractiveMarkerFeedback, now: float) -> None:
        name = feedback.marker_name
        model, drag = self._models.get(name), self._drags.get(name)
        if self._closed or model is None:
            return
        if drag is not None and drag.client != feedback.client_id:
            return  # Another client is dragging it.
        event, pose = feedback.event_type, self._pose_in_map(feedback)
        if event == feedback.MENU_SELECT:
            if feedback.menu_entry_id == DELETE_ENTRY:
                self._world.delete_model(model.name)
        elif event == feedback.MOUSE_UP:
            self._release(name, pose)
        elif event in (feedback.MOUSE_DOWN, feedback.POSE_UPDATE):
            # Also restarts a drag that has timed out.
            if pose is not None:
                self._drags.hold(name, feedback.client_id, now, pose)
                self._ticker.wake()
        elif event == feedback.KEEP_ALIVE and drag is not None:
            drag.last_feedback = now

    def _pose_in_map(self, feedback: InteractiveMarkerFeedback) -> Pose | None:
        frame = feedback.header.frame_id.lstrip("/")
        if frame not in ("", FRAME):
            _LOG.warning(
                'interactive marker "%s": ignoring a pose in frame "%s", expected frame "%s"',
                feedback.marker_name,
                frame,
                FRAME,
            )
            return None
        return convert.planar_pose(feedback.pose)

    def _release(self, name: str, pose: Pose | None) -> None:
        self._drags.end(name)
        self._invalidate_published(name)
        if pose is not None:
            self._world.move_model(
                self._models[name].name,
                pose,
                if_blocked="allow",
                keep_odometry=self._keep_odometry,
            )

    # -- updates to clients ----------------------------------------------------------------

    def _on_connection(self) -> None:
        """Wakes the ticker when clients connect or disconnect; called in a rospy thread."""
        self._keep_alive_due = 0.0
        self._ticker.wake()

    def _pose_of(self, name: str) -> Pose:
        drag = self._drags.get(name)
        return self._models[name].pose if drag is None else drag.pose

    def _invalidate_published(self, name: str) -> None:
        """Forces a pose into the next update, because a client may display another one."""
        self._published[name] = (math.inf, math.inf, 0.0)

    def _tick(self, now: float) -> bool:
        """Ends stale drags and publishes changed poses."""
        for name in self._drags.end_stale(now):
            self._invalidate_published(name)
        if self._server.connected:
            self._send_changes()
            if now >= self._keep_alive_due:
                self._keep_alive_due = now + KEEP_ALIVE_PERIOD
                self._server.keep_alive()
        return bool(self._drags) or self._server.connected

    def _send_changes(self) -> None:
        for name, published in self._published.items():
            pose = self._pose_of(name)
            if pose != published and _differ(pose, published):
                self._server.move(name)
                self._published[name] = pose
        self._server.apply_changes()


def _differ(a: Pose, b: Pose) -> bool:
    return (
        abs(a[0] - b[0]) > _MIN_MOVE
        or abs(a[1] - b[1]) > _MIN_MOVE
        or abs(wrap_angle(a[2] - b[2])) > _MIN_MOVE
    )
