"""Handles, shown as interactive markers, that move, rotate and delete models in RViz."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from flatland.entities.model import Model
from flatland.errors import FlatlandError
from flatland.geometry import Pose, wrap_angle
from flatland.node.names import UniqueNames, sendable_text
from flatland.node.ticker import Ticker, TickerThread
from flatland.node.values import WORLD_FRAME, ReceivedPose
from flatland.runtime.observer import WorldObserver
from flatland.runtime.requests import Post
from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

SERVER_NAME: Final = "interactive_model_markers"
"""Namespace of the topics of the handles."""
DELETE_ENTRY: Final = 1
"""Id of the entry of the menu of a handle that deletes the model."""
DRAG_TIMEOUT: Final = 0.1  # s of wall time without feedback after which a drag ends
UPDATE_RATE: Final = 30.0  # Hz, wall time
KEEP_ALIVE_PERIOD: Final = 0.5  # s, wall time
_MIN_MOVE: Final = 1e-4  # m and rad; smaller changes are not published


class Event(Enum):
    """What a client has done with a handle."""

    KEEP_ALIVE = "keep alive"
    PRESS = "press"
    MOVE = "move"
    RELEASE = "release"
    MENU = "menu"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Feedback:
    """Feedback of a client.

    Attributes:
        name: Name of the handle.
        client: Id of the client.
        event: What the client has done.
        menu_entry: Id of the selected entry of the menu.
        pose: Pose of the handle at the client.
        time: Time at which the feedback was received (`time.monotonic`) [s].
    """

    name: str
    client: str
    event: Event
    menu_entry: int
    pose: ReceivedPose
    time: float


class HandleServer(Protocol):
    """Publishes handles and their changes; used in the thread that steps the world.

    Attributes:
        connected: Whether there are clients.
    """

    @property
    def connected(self) -> bool:
        """Whether there are clients."""

    def insert(self, model: Model, name: str) -> None:
        """Adds or replaces the handle of a model; takes effect with the next update."""

    def move(self, name: str) -> None:
        """Publishes the current pose of a handle with the next update."""

    def erase(self, name: str) -> None:
        """Removes a handle; takes effect with the next update."""

    def apply_changes(self) -> None:
        """Publishes one update with all changes since the last one, if any."""

    def keep_alive(self) -> None:
        """Informs clients that the server is still there."""


@dataclass(slots=True)
class Drag:
    """A drag of one marker by one client.

    Attributes:
        client: Id of the client.
        last_feedback: Time of the last feedback of the client (`time.monotonic`) [s].
        pose: Current pose of the marker.
    """

    client: str
    last_feedback: float
    pose: Pose


class Handles(WorldObserver):
    """Publishes a handle for each model.

    Updates are published at most 30 times per second of wall time, and only if there are clients.
    """

    def __init__(
        self,
        simulation: Simulation,
        thread: TickerThread,
        start_server: Callable[[Post, Handles], HandleServer],
        *,
        move_keeps_odometry: bool = False,
    ) -> None:
        """Advertises the topics asynchronously; must be called between two steps.

        Args:
            simulation: Simulation of the world.
            thread: Posts the periodic work.
            start_server: Advertises the topics, see `Transport.load_handle_server`.
            move_keeps_odometry: Whether a drag keeps the odometry of the model.
        """
        self._keep_odometry = move_keeps_odometry
        self._world = simulation.world
        self._closed = False
        self._names = UniqueNames()
        self._models: dict[str, Model] = {}  # by marker name
        self._published: dict[str, Pose] = {}  # last published pose of each marker
        self._holds = simulation.holds
        self._drags: dict[str, Drag] = {}
        self._keep_alive_due = 0.0
        self._ticker = Ticker("flatland-handles", UPDATE_RATE, simulation.post, self._tick, thread)
        self._server = start_server(simulation.post, self)
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
        self._server.insert(model, name)
        self._apply_without_clients()

    def model_changed(self, model: Model) -> None:
        """Replaces the marker of a model whose colours or visibility have changed."""
        name = self._name_of(model)
        if name is None or self._closed:
            return
        self._server.erase(name)
        self._server.insert(model, name)
        self._invalidate_published(name)
        self._apply_without_clients()

    def model_removed(self, model: Model) -> None:
        """Removes the marker of a model."""
        name = self._name_of(model)
        if name is None or self._closed:
            return
        self._end_drag(name)
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

    def receive(self, feedback: Feedback) -> None:
        """Handles feedback; called between two steps."""
        try:
            self._handle(feedback)
        except (FlatlandError, ValueError) as error:
            _LOG.warning('interactive marker "%s": %s', feedback.name, error)
        except Exception:
            _LOG.exception("unexpected internal error in the feedback of an interactive marker")

    def _handle(self, feedback: Feedback) -> None:
        name, event = feedback.name, feedback.event
        model, drag = self._models.get(name), self._drags.get(name)
        if self._closed or model is None:
            return
        if drag is not None and drag.client != feedback.client:
            return  # Another client is dragging it.
        pose = _pose_in_map(feedback)
        if event is Event.MENU:
            if feedback.menu_entry == DELETE_ENTRY:
                self._world.delete_model(model.name)
        elif event is Event.RELEASE:
            self._release(name, pose)
        elif event in (Event.PRESS, Event.MOVE):
            # Also restarts a drag that has timed out.
            if pose is not None:
                self._holds.hold((self, name))
                self._drags[name] = Drag(feedback.client, feedback.time, pose)
                self._ticker.wake()
        elif event is Event.KEEP_ALIVE and drag is not None:
            drag.last_feedback = feedback.time

    def _end_drag(self, name: str) -> None:
        """Ends the drag of a handle, if any; the world is resumed after the last one."""
        if self._drags.pop(name, None) is not None:
            self._holds.release((self, name))

    def _release(self, name: str, pose: Pose | None) -> None:
        self._end_drag(name)
        self._invalidate_published(name)
        if pose is not None:
            self._world.move_model(
                self._models[name].name,
                pose,
                if_blocked="allow",
                keep_odometry=self._keep_odometry,
            )

    # -- updates to clients ----------------------------------------------------------------

    def connection_changed(self) -> None:
        """Wakes the ticker when clients connect or disconnect; called in any thread."""
        self._keep_alive_due = 0.0
        self._ticker.wake()

    def pose_of(self, name: str) -> Pose:
        """Returns the pose of a drag, otherwise the pose of the model."""
        drag = self._drags.get(name)
        return self._models[name].pose if drag is None else drag.pose

    def _invalidate_published(self, name: str) -> None:
        """Forces a pose into the next update, because a client may display another one."""
        self._published[name] = (math.inf, math.inf, 0.0)

    def _tick(self, now: float) -> bool:
        """Ends stale drags and publishes changed poses."""
        self._holds.check()
        for name, drag in list(self._drags.items()):
            if now - drag.last_feedback > DRAG_TIMEOUT:
                self._end_drag(name)
                self._invalidate_published(name)
        if self._server.connected:
            self._send_changes()
            if now >= self._keep_alive_due:
                self._keep_alive_due = now + KEEP_ALIVE_PERIOD
                self._server.keep_alive()
        return bool(self._drags) or self._server.connected

    def _send_changes(self) -> None:
        for name, published in self._published.items():
            pose = self.pose_of(name)
            if pose != published and _differ(pose, published):
                self._server.move(name)
                self._published[name] = pose
        self._server.apply_changes()


def _pose_in_map(feedback: Feedback) -> Pose | None:
    frame = feedback.pose.frame_id
    if frame not in ("", WORLD_FRAME):
        _LOG.warning(
            'interactive marker "%s": ignoring a pose in frame "%s", expected frame "%s"',
            feedback.name,
            frame,
            WORLD_FRAME,
        )
        return None
    return feedback.pose.pose


def _differ(a: Pose, b: Pose) -> bool:
    return (
        abs(a[0] - b[0]) > _MIN_MOVE
        or abs(a[1] - b[1]) > _MIN_MOVE
        or abs(wrap_angle(a[2] - b[2])) > _MIN_MOVE
    )
