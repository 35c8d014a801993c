"""The log of flatland, which rospy publishes."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("rospy", reason="ROS is not installed")

import rospy
from rosgraph.roslogging import RosStreamHandler
from rospy.impl.paramserver import get_param_server_cache

from flatland.ros import logs


@pytest.fixture
def logger() -> Iterator[logging.Logger]:
    """The logger of flatland, as it is before it is forwarded."""
    logger = logging.getLogger("flatland")
    before = logger.propagate, logger.handlers, logger.level
    logger.setLevel(logging.NOTSET)
    yield logger
    logger.propagate, logger.handlers = before[:2]
    logger.setLevel(before[2])


@pytest.mark.parametrize("level", [logging.NOTSET, logging.ERROR])
def test_the_log_is_forwarded_once_at_the_level_of_rospy(
    logger: logging.Logger, master: Any, monkeypatch: pytest.MonkeyPatch, level: int
) -> None:
    name = "/rosout_disable_topics_generation"
    cache = get_param_server_cache()
    monkeypatch.setattr(cache, "d", {})
    logger.setLevel(level)
    logs.log_to_ros()
    assert cache.get(name) is False
    cache.delete(name)
    rospy.set_param(name, "value")
    logs.log_to_ros()
    assert cache.get(name) == "value"
    assert not logger.propagate
    assert len(logger.handlers) == 1
    assert logger.level == (level or logging.DEBUG)
    records: list[logging.LogRecord] = []
    rosout = logging.getLogger("rosout")
    monkeypatch.setattr(rosout, "handle", records.append)
    monkeypatch.setattr(rosout, "isEnabledFor", lambda number: number >= logging.WARNING)
    for number in (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR):
        logger.log(number, "text")
    expected = [logging.ERROR] if level else [logging.WARNING, logging.ERROR]
    assert [record.levelno for record in records] == expected
    assert records[0].filename == "test_logs.py"


def test_text_that_cannot_be_sent_is_replaced(
    logger: logging.Logger, master: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(get_param_server_cache(), "d", {})
    logs.log_to_ros()
    records: list[logging.LogRecord] = []
    rosout = logging.getLogger("rosout")
    monkeypatch.setattr(rosout, "handle", records.append)
    monkeypatch.setattr(rosout, "isEnabledFor", lambda _number: True)
    logger.warning("loaded %s", "/maps/\udce4.yaml")
    logger.warning("loaded %s", "/maps/ä.yaml")
    assert [record.getMessage() for record in records] == [
        "loaded /maps/?.yaml",
        "loaded /maps/ä.yaml",
    ]


class ClosedStream:
    """An output whose reader has ended."""

    def write(self, _text: str) -> None:
        raise BrokenPipeError

    flush = isatty = lambda self: None


def test_a_log_on_a_closed_stream_raises_nothing(
    logger: logging.Logger, master: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(get_param_server_cache(), "d", {})
    stream = ClosedStream()
    handler = RosStreamHandler(stdout=stream, stderr=stream)
    rosout = logging.getLogger("rosout")
    monkeypatch.setattr(rosout, "handlers", [handler])
    monkeypatch.setattr(rosout, "propagate", False)
    record = rosout.makeRecord("rosout", logging.ERROR, "", 0, "text", (), None)
    with pytest.raises(BrokenPipeError):
        rosout.handle(record)
    logs.log_to_ros()
    rosout.handle(record)  # also of other loggers, such as that of rospy
    logger.error("text")
