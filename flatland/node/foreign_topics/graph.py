"""What the viewer in the browser needs to know about the topics of other nodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from flatland.web.foreign_topics import PoseKind


class Graph(Protocol):
    """The topics of all nodes, as of the last refresh.

    Attributes:
        published: Type of each topic that has a publisher, `PACKAGE/NAME`.
        subscribed: Type of each topic that has a subscriber, and its subscribers.
    """

    published: dict[str, str]
    subscribed: dict[str, tuple[str, frozenset[str]]]

    @property
    def pose_topics(self) -> Mapping[PoseKind, str]:
        """Name of the usual topic of each kind of pose."""

    def refresh(self) -> None:
        """Renews the topics, not more often than sensible."""

    def message_classes(self, kind: str) -> list[type[Any]]:
        """Returns the message classes of a type, the fastest first; none if it is not installed.

        All subscribers of a node for a topic have the same class, and a plugin may be one of them.
        """

    def now(self) -> int:
        """Returns the ROS time of this node [ns]."""
