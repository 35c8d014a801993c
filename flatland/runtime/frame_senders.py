"""The senders of coordinate frames, to detect frames with two parents."""

from __future__ import annotations

import logging
from typing import TypeAlias

from flatland.plugin_api.plugin import FlatlandPlugin, describe

_LOG = logging.getLogger("flatland")

FramePair: TypeAlias = tuple[str, str]


class FrameSenders:
    """The plugins that send each child frame.

    A frame has one parent in a TF tree. With two, its position changes with each message.
    """

    def __init__(self) -> None:
        """Creates an empty table."""
        self._senders: dict[str, list[tuple[str, FlatlandPlugin]]] = {}
        self._warned: set[tuple[str, frozenset[str]]] = set()

    def add(self, plugin: FlatlandPlugin, frames: FramePair) -> None:
        """Adds a pair of frames that a plugin sends for the first time.

        Logs one warning for each child frame and pair of parents of different plugins.

        Args:
            plugin: The sender.
            frames: (parent, child).
        """
        parent, child = frames
        senders = self._senders.setdefault(child, [])
        for other_parent, other in senders:
            conflict = (child, frozenset((parent, other_parent)))
            if other is plugin or other_parent == parent or conflict in self._warned:
                continue
            self._warned.add(conflict)
            _LOG.warning(
                'TF frame "%s" has two parents, "%s" from %s and "%s" from %s; give the frames '
                "different names, or disable one of the senders",
                child,
                other_parent,
                describe(other),
                parent,
                describe(plugin),
            )
        senders.append((parent, plugin))

    def remove(self, plugin: FlatlandPlugin, frames: FramePair) -> None:
        """Removes a pair of frames that was added."""
        parent, child = frames
        senders = self._senders[child]
        senders.remove((parent, plugin))
        if not senders:
            del self._senders[child]
