"""A log of the notifications of observers."""

from __future__ import annotations

from typing import Any

import pytest

import flatland


class EventLog(flatland.WorldObserver):
    """Records what happens to models, layers and ports, such as `model_added box`."""

    def __init__(self) -> None:
        self.events: list[str] = []


def _record_as(event: str) -> Any:
    def record(log: EventLog, subject: Any) -> None:
        # A layer, a port or a model.
        name = subject if isinstance(subject, str) else getattr(subject, "topic", None)
        log.events.append(f"{event} {name or subject.name}")

    return record


for _event in (
    *("model_added", "model_moved", "model_changed", "model_removed", "layer_changed"),
    *("output_opened", "output_closed", "command_opened", "command_closed"),
):
    setattr(EventLog, _event, _record_as(_event))


@pytest.fixture
def log() -> EventLog:
    """An observer that records its notifications; to be added to a world."""
    return EventLog()
