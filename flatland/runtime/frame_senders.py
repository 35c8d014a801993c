"""The senders of coordinate frames, to detect frames with two parents or two poses."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, TypeAlias

from flatland.plugin_api.plugin import FlatlandPlugin, describe

if TYPE_CHECKING:
    from flatland.geometry import Pose

_LOG = logging.getLogger("flatland")

FramePair: TypeAlias = tuple[str, str]
_Sender: TypeAlias = tuple[str, FlatlandPlugin, "Pose | None", str]
"""Parent, plugin, pose in the parent if it is constant, and the entry that disables the sender."""


class FrameSenders:
    """The plugins that send each child frame.

    A frame has one parent and one pose in a TF tree. With two, its position changes with each
    message.
    """

    def __init__(self) -> None:
        """Creates an empty table."""
        self._senders: dict[str, list[_Sender]] = {}
        self._warned: set[tuple[str, frozenset[str]]] = set()

    def add(
        self, plugin: FlatlandPlugin, frames: FramePair, pose: Pose | None = None, switch: str = ""
    ) -> None:
        """Adds a pair of frames that a plugin declares, or sends for the first time.

        Logs one warning for each child frame and pair of parents of different plugins.

        Args:
            plugin: The sender.
            frames: (parent, child).
            pose: Pose of the child in the parent [m, rad]; None if it changes or is unknown.
            switch: Entry of the plugin that disables the transform, empty if it is unknown.
        """
        parent, child = frames
        senders = self._senders.setdefault(child, [])
        if any(sender[:2] == (parent, plugin) for sender in senders):
            return
        new = (parent, plugin, pose, switch)
        for other in senders:
            conflict = (child, frozenset((parent, other[0])))
            if conflict not in self._warned and _are_in_conflict(other, new):
                self._warned.add(conflict)
                _warn(child, other, new)
        senders.append(new)

    def remove(self, plugin: FlatlandPlugin, frames: FramePair) -> bool:
        """Removes a pair of frames that was added; returns whether no other plugin sends it."""
        parent, child = frames
        senders = [each for each in self._senders[child] if each[:2] != (parent, plugin)]
        if not senders:
            del self._senders[child]
            return True
        self._senders[child] = senders
        return all(sender[0] != parent for sender in senders)


def _are_in_conflict(first: _Sender, second: _Sender) -> bool:
    if first[1] is second[1]:
        return False  # A plugin may change the parent of a frame.
    if first[0] != second[0]:
        return True
    if first[2] is not None and second[2] is not None:
        return first[2] != second[2]
    # Plugins of one model, such as two drives of a body, send the same pose.
    first_model, second_model = (getattr(each[1], "model", None) for each in (first, second))
    return first_model is not second_model


def _warn(child: str, first: _Sender, second: _Sender) -> None:
    plugins = (first[1], second[1])
    origins = [describe(plugin) + plugin._place.suffix for plugin in plugins]
    models = [getattr(plugin, "model", None) for plugin in plugins]
    if first[0] == second[0]:
        problem = f'is sent with two poses in "{first[0]}", by {origins[0]} and by {origins[1]}'
    else:
        problem = f'has two parents, "{first[0]}" from {origins[0]} and "{second[0]}" from '
        problem += origins[1]
    remedies = []
    if None not in models and models[0] is not models[1]:
        names = " and ".join(f'"{model.name}"' for model in models if model is not None)
        remedies.append(f"give the models {names} different namespaces")
    remedies.append("give the frames different names")
    # An entry of a file of both models would disable both.
    if len({(plugin._place, plugin.name) for plugin in plugins}) == 2:
        switches = [f'"{each[3]}" of "{each[1].name}"' for each in (first, second) if each[3]]
        keys = f" ({' or '.join(dict.fromkeys(switches))})" if switches else ""
        remedies.append(f"disable one of the senders{keys}")
    remedy = ", ".join(remedies[:-1]) + f", or {remedies[-1]}" if remedies[1:] else remedies[0]
    _LOG.warning('TF frame "%s" %s; %s', child, problem, remedy, extra={"place": second[1]._place})
