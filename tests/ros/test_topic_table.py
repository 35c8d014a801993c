"""The table of topics: types, frames, rates and latched topics of a running node."""

from __future__ import annotations

from typing import Any

import pytest
import roslib.message
import topic_table
from room_world import write_room_world
from topic_table import TABLE, Row
from waiting import wait_until

DURATION = 2.0  # s


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    world = write_room_world(
        tmp_path_factory.mktemp("table"),
        topic_table.WORLD,
        properties=topic_table.PROPERTIES,
        sensors=topic_table.ROBOT,
    )
    return module_launcher.server(world, lockstep=True, seed=1)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_topic(ros: Any, row: Row) -> None:
    wait_until(f"a publisher of {row.name}", lambda: ros.types().get(row.name) == row.type)
    topic = ros.ready_topic(row.name, roslib.message.get_message_class(row.type))
    if row.delivery == "state":
        message = topic.next()
        assert message._connection_header["latching"] == "1"
    if row.rate is not None:
        topic.drop()
        ros.step(DURATION)
        count = round(DURATION * row.rate)
        message = topic.take(count)[-1]
        # A state is also sent when it has changed, and a time that a subscriber misses is replaced.
        assert row.delivery in ("state", "clock") or topic.rest() == []
    if row.frame is not None:
        assert message.header.frame_id == row.frame
