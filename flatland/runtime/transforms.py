"""The transforms of a world: collected during a step, published in one batch after it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias

from flatland.runtime.frame_senders import FrameSenders
from flatland.values import Transform

if TYPE_CHECKING:
    from flatland.geometry import Pose
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.runtime.observer import Observers

FramePair: TypeAlias = tuple[str, str]
"""(parent, child)."""
TransformFields: TypeAlias = tuple[int, float, float, float, float]
"""(stamp, x, y, yaw, roll), as in `Transform`."""


class TransformBuffer:
    """The latest transform of each pair of frames, and the transforms of the current step.

    Transforms are kept as plain tuples, since most of them are never read.
    """

    def __init__(self, observers: Observers) -> None:
        """Creates an empty buffer.

        Args:
            observers: Notified of the transforms of each step.
        """
        self._observers = observers
        self._senders = FrameSenders()
        self._latest: dict[FramePair, TransformFields] = {}
        self._pending: dict[FramePair, TransformFields] = {}

    @property
    def latest(self) -> dict[FramePair, Transform]:
        """The latest transform of each (parent, child)."""
        return dict(zip(self._latest, _values(self._latest), strict=True))

    def register(self, plugin: FlatlandPlugin, frames: FramePair) -> None:
        """Registers a pair of frames that a plugin starts to send.

        If another plugin sends the child frame with another parent, a warning is logged.
        """
        self._senders.add(plugin, frames)

    def declare(
        self, plugin: FlatlandPlugin, frames: FramePair, pose: Pose | None, switch: str
    ) -> None:
        """Registers a pair of frames that a plugin is going to send; see `declare_transform`."""
        self._senders.add(plugin, frames, pose, switch)

    def send(self, frames: FramePair, fields: TransformFields) -> None:
        """Adds a transform of this step."""
        self._pending[frames] = fields

    def add_past(self, frames: FramePair, fields: TransformFields) -> None:
        """Adds a transform of an earlier step that was not sent, because it was not wanted."""
        latest = self._latest.get(frames)
        if latest is None or latest[0] <= fields[0]:
            self._latest[frames] = fields

    def forget(self, plugin: FlatlandPlugin, frames: Iterable[FramePair]) -> None:
        """Drops the transforms of a plugin that ended."""
        for pair in frames:
            if self._senders.remove(plugin, pair):
                self._latest.pop(pair, None)
                self._pending.pop(pair, None)

    def flush(self) -> None:
        """Publishes the transforms of this step."""
        pending = self._pending
        if pending:
            self._latest.update(pending)
            self._observers.transforms_sent(lambda: _values(pending))
            pending.clear()


def _values(fields: dict[FramePair, TransformFields]) -> list[Transform]:
    return [Transform(stamp, *pair, *pose) for pair, (stamp, *pose) in fields.items()]
