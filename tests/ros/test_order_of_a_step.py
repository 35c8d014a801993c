"""The order in which a subscriber receives the messages of a step: `/clock`, `/tf`, outputs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 50,
     angle: {min: -1.5, max: 1.5, increment: 0.01}}
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50}
  - {type: ModelTfPublisher, name: tf, publish_tf_world: true, update_rate: 50}
"""
NEEDED = {("odom", "base"), ("map", "base"), ("base", "laser")}


def test_transforms_and_the_clock_of_a_scan_are_received_before_it(
    launcher: Any, ros: Any, write_world: Callable[..., Path]
) -> None:
    """What was sent before a scan can be read when the scan can, since all is on one machine."""
    world = write_world("[{name: robot, model: robot.model.yaml}]", robot=ROBOT)
    launcher.server(world)
    scans, tf, clock = (
        RawSubscriber(ros.master, *topic)
        for topic in (("/scan", LaserScan), ("/tf", TFMessage), ("/clock", Clock))
    )
    # From here on, all three are connected.
    last_time = clock.next().clock
    last_transform = max(each.header.stamp for each in tf.next().transforms)
    frames: defaultdict[Any, set[tuple[str, str]]] = defaultdict(set)
    late = []
    stamp = scans.next().header.stamp
    while stamp <= last_transform:
        stamp = scans.next().header.stamp
    for _ in range(40):
        stamp = scans.next().header.stamp
        # Several scans may have arrived, and the transforms of all of them.
        for message in tf.received():
            for each in message.transforms:
                frames[each.header.stamp].add((each.header.frame_id, each.child_frame_id))
        for message in clock.received():
            last_time = message.clock
        if not (frames[stamp] >= NEEDED and last_time >= stamp):
            late.append((stamp, frames[stamp], last_time))
    assert late == []
    for subscriber in (scans, tf, clock):
        subscriber.close()
