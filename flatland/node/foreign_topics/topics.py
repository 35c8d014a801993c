"""The topics of all nodes, as the viewer in the browser shows them."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any, Final, Literal

from flatland.errors import PLUGIN_FAULTS, FlatlandError
from flatland.geometry import Pose
from flatland.node.foreign_topics import poses
from flatland.node.foreign_topics.drawers import Drawer, LatestDrawer
from flatland.node.foreign_topics.graph import Graph
from flatland.node.foreign_topics.grids import GridDrawer
from flatland.node.foreign_topics.markers import MarkerDrawer
from flatland.node.foreign_topics.pose_publisher import PosePublisher
from flatland.node.foreign_topics.subscriptions import TopicSubscription, TransformSubscription
from flatland.node.foreign_topics.trees import tree_of
from flatland.node.frame_tree import FrameTree, NoTransformError
from flatland.node.transport import Transport
from flatland.node.values import WORLD_FRAME
from flatland.simulation import Simulation
from flatland.web.foreign_topics import Drawing, Marks, PoseKind, Topic, TopicDemand, TopicUpdate

_LOG = logging.getLogger("flatland")

VALUES_PERIOD: Final = 0.2  # s of wall time between two values of a topic
_GRID: Final = "nav_msgs/OccupancyGrid"
_GRID_UPDATE: Final = "map_msgs/OccupancyGridUpdate"
_DRAWERS: Final[dict[str, Callable[[], Drawer]]] = {
    "nav_msgs/Path": lambda: LatestDrawer(poses.path),
    _GRID: GridDrawer,
    "visualization_msgs/Marker": MarkerDrawer,
    "visualization_msgs/MarkerArray": MarkerDrawer,
    "geometry_msgs/PoseArray": lambda: LatestDrawer(poses.poses),
    "geometry_msgs/PoseStamped": lambda: LatestDrawer(poses.pose),
    "geometry_msgs/PoseWithCovarianceStamped": lambda: LatestDrawer(poses.pose),
    "geometry_msgs/PolygonStamped": lambda: LatestDrawer(poses.polygon),
}


class RosTopics:
    """Topics of other nodes; implements `ForeignTopics`.

    Subscriptions exist only while a client looks. The client library deserializes messages in its
    own threads; everything else happens in the thread that calls `update`.
    """

    def __init__(self, transport: Transport, graph: Graph, simulation: Simulation) -> None:
        """Creates an object without subscriptions.

        Args:
            transport: Subscribes and publishes.
            graph: The topics of all nodes.
            simulation: Simulation of the world.
        """
        self._transport = transport
        self._simulation = simulation
        self._graph = graph
        self._frames = FrameTree(WORLD_FRAME)
        self._transforms: TransformSubscription | None = None
        self._watched: dict[str, _WatchedTopic] = {}
        self._pose_publisher = PosePublisher(transport, self._graph)
        self._lock = threading.Lock()  # `close` may be called during an update
        self._closed = False

    def update(self, demand: TopicDemand) -> TopicUpdate:
        """Subscribes to what is demanded, and returns what has changed."""
        with self._lock:
            if self._closed:
                return TopicUpdate()
            self._graph.refresh()
            self._subscribe(demand)
            return self._collect(demand)

    def suspend(self) -> None:
        """Unsubscribes from all topics."""
        with self._lock:
            self._subscribe(TopicDemand())

    def publish_pose(self, kind: PoseKind, topic: str, pose: Pose) -> bool:
        """Publishes a pose in the world frame and returns whether there is a subscriber.

        Raises:
            FlatlandError: The topic is not one of this kind.
        """
        self._graph.refresh()
        if topic not in self._pose_publisher.topics(kind):
            raise FlatlandError(f'no node subscribes to poses on "{topic}"')
        return self._pose_publisher.publish(kind, topic, pose)

    def close(self) -> None:
        """Unsubscribes and unregisters everything."""
        with self._lock:
            self._closed = True
            self._subscribe(TopicDemand())
            self._pose_publisher.close()

    def _subscribe(self, demand: TopicDemand) -> None:
        wanted = {name: name in demand.drawn for name in demand.drawn | demand.inspected}
        for name, watched in list(self._watched.items()):
            is_current = watched.type == self._graph.published.get(name, watched.type)
            is_current = is_current and not watched.gave_way
            if wanted.get(name) != watched.is_drawn or not is_current:
                self._watched.pop(name).close()
        for name, is_drawn in wanted.items():
            if name not in self._watched and name in self._graph.published:
                message_type = self._graph.published[name]
                watched = _WatchedTopic(
                    self._transport, self._graph, name, message_type, is_drawn=is_drawn
                )
                self._watched[name] = watched
            if name in self._watched:
                self._watched[name].watch_updates()
        is_drawing = any(watched.drawer is not None for watched in self._watched.values())
        transforms = self._transforms
        if transforms is not None and (transforms.closed or not is_drawing):
            transforms.close()
            self._transforms = None
        if is_drawing and self._transforms is None:
            self._transforms = TransformSubscription(
                self._transport, self._simulation, self._frames
            )

    def _collect(self, demand: TopicDemand) -> TopicUpdate:
        drawings: dict[str, Drawing] = {}
        values: dict[str, Any] = {}
        for name, watched in self._watched.items():
            drawing = watched.draw(self._frames)
            if drawing is not None:
                drawings[name] = drawing
            if name in demand.inspected:
                watched.add_values(values)
        topics = [
            Topic(name, kind, _drawn_as(kind), self._status(name, demand))
            for name, kind in self._graph.published.items()
        ]
        gone = (demand.drawn | demand.inspected) - self._graph.published.keys()
        topics += [
            Topic(
                name,
                self._watched[name].type if name in self._watched else "",
                _drawn_as(self._watched[name].type) if name in self._watched else "",
                "no publisher",
            )
            for name in sorted(gone)
        ]
        kinds: tuple[PoseKind, ...] = ("goal", "initial_pose")
        pose_topics = {kind: self._pose_publisher.topics(kind) for kind in kinds}
        return TopicUpdate(topics, pose_topics, drawings, values)

    def _status(self, name: str, demand: TopicDemand) -> str:
        watched = self._watched.get(name)
        if watched is None or name not in demand.drawn | demand.inspected:
            return ""
        return watched.status


class _WatchedTopic:
    """A topic that clients look at.

    Attributes:
        type: Name of its message type.
        is_drawn: Whether clients want it to be drawn.
        drawer: Draws it, None if it is not drawn.
    """

    def __init__(
        self, transport: Transport, graph: Graph, name: str, kind: str, *, is_drawn: bool
    ) -> None:
        """Subscribes asynchronously; the status states why it cannot."""
        self.type = kind
        self.is_drawn = is_drawn
        self.drawer: Drawer | None = None
        self._transport = transport
        self._graph = graph
        self._name = name
        self._problem = ""
        self._subscriptions: list[TopicSubscription] = []
        self._values_due = 0.0
        self._inspected: Any = None  # the message of the last values
        if is_drawn and kind in _DRAWERS:
            self.drawer = _DRAWERS[kind]()
        self._has_updates = kind == _GRID and is_drawn  # until they are subscribed to
        # Why there is no subscription, or why the last message cannot be drawn.
        self._invalid = self._subscribe(name, kind)

    @property
    def status(self) -> str:
        """Why nothing or only a part is shown; empty if everything is."""
        if self._problem or self._invalid:
            return self._problem or self._invalid
        if self._subscriptions[0].latest is None:
            return "no message received"
        return self.drawer.note if self.drawer is not None else ""

    @property
    def gave_way(self) -> bool:
        """Whether a subscription has ended because a plugin needs another message class."""
        return any(subscription.closed for subscription in self._subscriptions)

    def close(self) -> None:
        """Unsubscribes."""
        for subscription in self._subscriptions:
            subscription.close()

    def watch_updates(self) -> None:
        """Subscribes to the updates of a grid as soon as they are published."""
        name = f"{self._name}_updates"
        if self._has_updates and self._graph.published.get(name) == _GRID_UPDATE:
            self._has_updates = False
            problem = self._subscribe(name, _GRID_UPDATE)
            if problem:
                _LOG.info("web viewer: %s is not updated: %s", self._name, problem)

    def _subscribe(self, name: str, kind: str) -> str:
        """Subscribes asynchronously; returns why it cannot, empty if it can."""
        keeps_all = isinstance(self.drawer, MarkerDrawer) or kind == _GRID_UPDATE
        problem = f"the message package of {kind} is not installed"
        for found in self._graph.message_classes(kind):
            try:
                subscription = TopicSubscription(self._transport, name, found, keeps_all=keeps_all)
            except FlatlandError as error:
                problem = str(error)
            else:
                self._subscriptions.append(subscription)
                return ""
        return problem

    def draw(self, frames: FrameTree) -> Drawing | None:
        """Returns the drawing if it has changed.

        An invalid message or a missing transform removes what was drawn, and is the status.
        """
        if self.drawer is None or not self._subscriptions:
            return None
        now = self._graph.now()
        for subscription in self._subscriptions:
            for message in subscription.take():
                self._receive(self.drawer, message, now)
        problem, self._problem = self._problem, self._invalid
        if not self._problem:
            try:
                return self.drawer.draw(frames, now, again=bool(problem))
            except NoTransformError as error:
                self._problem = str(error)
            except PLUGIN_FAULTS as error:
                self._problem = f"invalid message: {error}"
        return None if problem else Marks.none()

    def _receive(self, drawer: Drawer, message: Any, now: int) -> None:
        try:
            drawer.receive(message, now)
        except PLUGIN_FAULTS as error:
            self._invalid = f"invalid message: {error}"
        else:
            self._invalid = ""

    def add_values(self, values: dict[str, Any]) -> None:
        """Adds the values of the newest message, unless they were added less than a period ago."""
        message = self._subscriptions[0].latest if self._subscriptions else None
        now = time.monotonic()
        if message is None or message is self._inspected or now < self._values_due:
            return
        self._inspected, self._values_due = message, now + VALUES_PERIOD
        values[self._name] = tree_of(message)


def _drawn_as(kind: str) -> Literal["marks", "grid", ""]:
    if kind == _GRID:
        return "grid"
    return "marks" if kind in _DRAWERS else ""
