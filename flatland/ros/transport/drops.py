"""The messages that were dropped for slow subscribers."""

from __future__ import annotations

from collections import Counter
from typing import Final
from weakref import WeakKeyDictionary

from flatland.ros.transport.outbox import Outbox, open_outboxes

REPLACED: Final = ("/clock",)
"""Topics whose messages are replaced by the next one, so that subscribers need not receive all."""


class DropCounter:
    """Counts the messages dropped since the previous count."""

    def __init__(self) -> None:
        """Creates a counter without connections."""
        self._seen: WeakKeyDictionary[Outbox, int] = WeakKeyDictionary()

    def count(self) -> Counter[tuple[str, str]]:
        """Returns the number of messages by topic and subscriber, without those of none."""
        dropped: Counter[tuple[str, str]] = Counter()
        for outbox in open_outboxes():
            count = outbox.dropped
            # Most connections never drop a message and need no entry.
            if count and count > (seen := self._seen.get(outbox, 0)):
                dropped[outbox.topic, outbox.subscriber] += count - seen
                self._seen[outbox] = count
        return dropped
