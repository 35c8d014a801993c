"""A recording of messages, as rosbag2 reads it: MCAP with definitions of ROS 2 and CDR."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

TOPICS = {"/scan": "sensor_msgs/msg/LaserScan", "/odometry/filtered": "nav_msgs/msg/Odometry"}


def test_recording(
    ros: Any, launcher: Any, write_world: Callable[..., Path], tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    world = write_world("[{name: robot, model: robot.model.yaml}]")
    program = launcher.server(ros, world, lockstep=True, record_mcap=path)
    ros.step(1.0)
    assert program.stop() == 0
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        schemas = summary.schemas
        channels = {each.topic: each for each in summary.channels.values()}
        for topic, name in TOPICS.items():
            assert channels[topic].message_encoding == "cdr"
            schema = schemas[channels[topic].schema_id]
            assert (schema.name, schema.encoding) == (name, "ros2msg")
        counts: Counter[str] = Counter()
        for _, channel, _, message in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            if channel.topic == "/scan":
                assert len(message.ranges) == 7
                assert message.header.frame_id == "laser"
    assert counts["/scan"] == 10
    assert counts["/odometry/filtered"] == 50
    assert counts["/tf"] >= 50
