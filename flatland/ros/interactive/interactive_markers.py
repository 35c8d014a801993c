"""Interactive markers: take hold of models in RViz, move, turn and delete them."""

from __future__ import annotations

import logging
import math
from typing import Final

from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import InteractiveMarkerFeedback

from flatland.errors import FlatlandError
from flatland.geometry import Pose, wrap_angle
from flatland.model import Model
from flatland.observer import WorldObserver
from flatland.ros.interactive.drag import Drags
from flatland.ros.interactive.marker_server import MarkerServer
from flatland.ros.interactive.model_handle import model_handle, planar_pose, pose_message
from flatland.ros.markers.packed_markers import FRAME
from flatland.ros.names import UniqueNames, sendable_text
from flatland.ros.registrar import Registrar
from flatland.ros.ticker import Ticker
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

SERVER_NAME: Final = "interactive_model_markers"
UPDATE_RATE: Final = 30.0  # Hz of wall time
KEEP_ALIVE_PERIOD: Final = 0.5  # s of wall time
_SMALLEST_MOVE: Final = 1e-4  # m and rad; less is not worth a message


class InteractiveMarkers(WorldObserver):
    """Offers an interactive marker for each model.

    Changes go out at most 30 times a second of wall time, and only to clients that are there.
    """

    def __init__(self, registrar: Registrar, simulation: Simulation) -> None:
        """Makes the markers of the models, now and from now on; between two steps.

        Args:
            registrar: Talks to the ROS master.
            simulation: Whose models to offer.
        """
        self._world = simulation.world
        self._closed = False
        self._names = UniqueNames()
        self._models: dict[str, Model] = {}  # by marker
        self._shown: dict[str, Pose] = {}  # what the clients know
        self._drags = Drags(self._world)
        self._keep_alive_due = 0.0
        self._menu = MenuHandler()
        self._menu.insert("Delete Model", callback=self._delete)
        self._ticker = Ticker("flatland-handles", UPDATE_RATE, simulation.post, self._tick)
        self._server = MarkerServer(
            registrar,
            SERVER_NAME,
            simulation.post,
            pose_of=self._pose_of,
            receive=self._receive,
            on_connection=self._greet,
        )
        for model in self._world.models:
            self.model_added(model)
        self._world.add_observer(self)

    def close(self) -> None:
        """Leaves topics and world alone from now on."""
        self._closed = True
        self._ticker.close()

    # -- what happens in the world ---------------------------------------------------------

    def model_added(self, model: Model) -> None:
        """Offers a marker for a model."""
        if self._closed:
            return
        name = self._names.claim(sendable_text(model.name))
        self._models[name] = model
        self._shown[name] = model.pose
        self._server.insert(model_handle(model, name))
        self._menu.apply(self._server, name)
        self._apply_unless_watched()

    def model_removed(self, model: Model) -> None:
        """Takes a model's marker away."""
        name = next((name for name, other in self._models.items() if other is model), None)
        if name is None or self._closed:
            return
        self._drags.end(name)
        self._names.release(name)
        del self._models[name], self._shown[name]
        self._server.erase(name)
        self._apply_unless_watched()

    def _apply_unless_watched(self) -> None:
        # While nobody listens there is nothing to send, and nobody to send too often to.
        if not self._server.connected:
            self._server.applyChanges()

    # -- what clients do -------------------------------------------------------------------

    def _receive(self, feedback: InteractiveMarkerFeedback, now: float) -> None:
        """Acts on feedback, between two steps."""
        try:
            self._handle(feedback, now)
        except (FlatlandError, ValueError) as error:
            _LOG.warning('interactive marker "%s": %s', feedback.marker_name, error)
        except Exception:
            _LOG.exception("feedback of an interactive marker failed in an unforeseen way")

    def _handle(self, feedback: InteractiveMarkerFeedback, now: float) -> None:
        name = feedback.marker_name
        model, drag = self._models.get(name), self._drags.get(name)
        if self._closed or model is None:
            return
        if drag is not None and drag.client != feedback.client_id:
            return  # Somebody else has it in his hands.
        event, pose = feedback.event_type, self._pose_in_map(feedback)
        if event == feedback.MENU_SELECT:
            self._menu.processFeedback(feedback)
        elif event == feedback.MOUSE_UP:
            self._release(name, pose)
        elif event in (feedback.MOUSE_DOWN, feedback.POSE_UPDATE):
            # A drag that was too slow goes on with its next pose.
            if pose is not None:
                self._drags.hold(name, feedback.client_id, now, pose)
                self._ticker.wake()
        elif event == feedback.KEEP_ALIVE and drag is not None:
            drag.heard = now

    def _pose_in_map(self, feedback: InteractiveMarkerFeedback) -> Pose | None:
        frame = feedback.header.frame_id.lstrip("/")
        if frame not in ("", FRAME):
            _LOG.warning(
                'interactive marker "%s": a pose in frame "%s" is ignored, it must be in "%s"',
                feedback.marker_name,
                frame,
                FRAME,
            )
            return None
        return planar_pose(feedback.pose)

    def _release(self, name: str, pose: Pose | None) -> None:
        self._drags.end(name)
        self._forget_shown(name)
        if pose is not None:
            self._world.move_model(self._models[name].name, pose)

    def _delete(self, feedback: InteractiveMarkerFeedback) -> None:
        self._world.delete_model(self._models[feedback.marker_name].name)

    # -- what clients are told -------------------------------------------------------------

    def _greet(self) -> None:
        """Hears of a client, in a thread of rospy."""
        self._keep_alive_due = 0.0
        self._ticker.wake()

    def _pose_of(self, name: str) -> Pose:
        drag = self._drags.get(name)
        return self._models[name].pose if drag is None else drag.pose

    def _forget_shown(self, name: str) -> None:
        """Makes the next update hold a marker's pose: its client may show another one."""
        self._shown[name] = (math.inf, math.inf, 0.0)

    def _tick(self, now: float) -> bool:
        """Ends silent drags and tells the clients of what has moved."""
        for name in self._drags.end_silent(now):
            self._forget_shown(name)
        if self._server.connected:
            self._send_changes()
            if now >= self._keep_alive_due:
                self._keep_alive_due = now + KEEP_ALIVE_PERIOD
                self._server.keep_alive()
        return bool(self._drags) or self._server.connected

    def _send_changes(self) -> None:
        for name, shown in self._shown.items():
            pose = self._pose_of(name)
            if _differ(pose, shown) and self._server.setPose(name, pose_message(pose)):
                self._shown[name] = pose
        self._server.applyChanges()


def _differ(a: Pose, b: Pose) -> bool:
    return (
        abs(a[0] - b[0]) > _SMALLEST_MOVE
        or abs(a[1] - b[1]) > _SMALLEST_MOVE
        or abs(wrap_angle(a[2] - b[2])) > _SMALLEST_MOVE
    )
