"""Serialized messages, compared with Python messages that rospy serializes."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
from visualization_msgs.msg import MarkerArray

import flatland
from flatland.node.markers.model_markers import ModelMarkers
from flatland.node.values import Transforms
from flatland.ros.adapters import find_adapter
from flatland.ros.adapters.writer import RosWriter

from scenes import BEAMS, RANGE, benchmark_world_path  # isort: skip
from table import Row
from timing import best_pair

TRANSFORMS = 5  # of a step of the benchmark world


def rows(_unit: float) -> list[Row]:
    """Measures the messages of a step of the benchmark world."""
    ranges = np.full(BEAMS, RANGE, np.float32)
    scan = flatland.LaserScan(
        1, "laser", -2.0, 2.0, 0.01, 0.0, 0.0, 0.0, RANGE, ranges, np.zeros(0, np.float32)
    )
    odometry = flatland.Odometry(1, "odom", "base", (1.0, 2.0, 3.0), (0.5, 0.0, 0.1))
    twist = flatland.TwistWithCovariance(1, "base", (0.5, 0.0, 0.1))
    transforms = [
        flatland.Transform(1, "base", f"wheel{number}", 1.0, 2.0, 3.0)
        for number in range(TRANSFORMS)
    ]
    return [
        _row("odometry", *_of_value(odometry), 0.25),
        _row("twist with covariance", *_of_value(twist), 0.25),
        _row("scan of 1081 beams", *_of_value(scan), 0.35),
        _row(f"/tf with {TRANSFORMS} transforms", *_of_value(Transforms(transforms)), 0.25),
        _markers_row(),
    ]


def _of_value(value: Any) -> tuple[Callable[[], object], Callable[[], object]]:
    """Returns functions that serialize a value directly, and create and serialize a message."""
    adapter = find_adapter(type(value))
    assert adapter is not None
    serialize, to_message = adapter.serialize, adapter.to_message
    assert serialize is not None
    assert to_message is not None
    return lambda: serialize(value), lambda: _by_rospy(to_message(value))


def _markers_row() -> Row:
    with flatland.World.from_yaml(benchmark_world_path(), seed=1) as world:
        model = world.models[0]
        markers, body = ModelMarkers(model, RosWriter), model.bodies[0]
        message = MarkerArray().deserialize(markers.message(0).packed)
        time_ns = 0

        def update() -> bytes:
            nonlocal time_ns
            time_ns += 1
            body.set_pose(12.0, 1e-9 * time_ns, 0.0)
            return markers.message(time_ns).packed

        return _row("markers of a model", update, lambda: _by_rospy(message), 0.6)


def _by_rospy(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _row(
    name: str, direct: Callable[[], object], by_rospy: Callable[[], object], bar: float
) -> Row:
    ours, theirs = best_pair(direct, by_rospy)
    note = f"{ours * 1e6:.1f} µs, by rospy {theirs * 1e6:.1f} µs"
    return Row(f"bytes of {name} / by a Python message", ours / theirs, "", bar, note=note)
