"""Serialized values: byte for byte what `genpy` writes for the messages that it reads from them."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tf2_msgs.msg import TFMessage

import flatland
from flatland.node.clock import set_stamps
from flatland.node.values import Transforms
from flatland.ros.adapters import find_adapter

STAMPS = st.integers(0, 4_294_967_295_999_999_999)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NUMBERS = st.floats(width=64)
SMALL = st.floats(width=32)  # representable in float32 fields
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
# Angles are finite: sin and cos of infinity raise.
POSES = st.tuples(NUMBERS, NUMBERS, st.floats(-1e6, 1e6))
BEAMS = st.integers(0, 20).flatmap(lambda n: arrays(np.float32, n))


def matrices(size: int) -> st.SearchStrategy[Any]:
    return arrays(np.float64, (size, size))


@st.composite
def collisions(draw: st.DrawFn) -> flatland.Collision:
    count = draw(st.integers(0, 4))
    points = arrays(np.float64, (count, 2))
    names = [draw(TEXTS) for _ in range(4)]
    return flatland.Collision(*names, draw(arrays(np.float64, count)), draw(points), draw(points))


VALUES = st.one_of(
    st.booleans(),
    st.builds(flatland.Twist, NUMBERS, NUMBERS, NUMBERS),
    st.builds(
        flatland.LaserScan,
        STAMPS,
        TEXTS,
        *[SMALL] * 7,
        BEAMS,
        BEAMS,
    ),
    st.builds(flatland.Odometry, STAMPS, TEXTS, TEXTS, POSES, TRIPLES, matrices(6), matrices(6)),
    st.builds(flatland.PoseStamped, STAMPS, TEXTS, POSES),
    st.builds(
        flatland.Range,
        STAMPS,
        TEXTS,
        st.sampled_from(["ultrasound", "infrared"]),
        *[SMALL] * 4,
    ),
    st.builds(
        flatland.SemanticScan,
        STAMPS,
        TEXTS,
        *[SMALL] * 5,
        BEAMS,
        st.integers(0, 20).flatmap(lambda n: arrays(np.uint32, n)),
        st.lists(
            st.builds(
                flatland.SemanticLabel,
                TEXTS,
                TEXTS,
                st.lists(TEXTS, max_size=3).map(tuple),
                TEXTS,
            ),
            max_size=4,
        ).map(tuple),
    ),
    st.builds(flatland.TwistWithCovariance, STAMPS, TEXTS, TRIPLES, matrices(6)),
    st.builds(
        flatland.Imu,
        STAMPS,
        TEXTS,
        st.floats(-1e6, 1e6),
        NUMBERS,
        st.tuples(NUMBERS, NUMBERS),
        matrices(3),
        matrices(3),
        matrices(3),
    ),
    st.builds(flatland.NavSatFix, STAMPS, TEXTS, NUMBERS, NUMBERS, NUMBERS),
    st.builds(flatland.Collisions, STAMPS, TEXTS, st.lists(collisions(), max_size=3).map(tuple)),
    st.builds(
        flatland.Transform,
        STAMPS,
        TEXTS,
        TEXTS,
        NUMBERS,
        NUMBERS,
        st.floats(-1e6, 1e6),
        st.one_of(st.just(0.0), st.floats(-1e6, 1e6)),
    ),
)


def by_genpy(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def by_adapter(value: Any) -> tuple[bytes, bytes]:
    """Returns the serialized value, and the serialized message of the same value."""
    adapter = find_adapter(type(value))
    assert adapter is not None
    assert adapter.serialize is not None
    assert adapter.to_message is not None
    return adapter.serialize(value), by_genpy(adapter.to_message(value))


@given(VALUES)
def test_any_value_is_serialized_as_its_message(value: Any) -> None:
    serialized, expected = by_adapter(value)
    assert serialized == expected


@given(st.lists(st.builds(flatland.Transform, STAMPS, TEXTS, TEXTS, *[st.floats(-9, 9)] * 4)))
def test_transforms_are_serialized_as_one_message(values: list[flatland.Transform]) -> None:
    values += values[:1]  # two equal stamps that do not follow each other
    one = find_adapter(flatland.Transform)
    together = find_adapter(Transforms)
    assert one is not None
    assert one.to_message is not None
    assert together is not None
    assert together.serialize is not None
    message = TFMessage([one.to_message(each) for each in values])
    assert together.serialize(Transforms(values)) == by_genpy(message)


@pytest.mark.parametrize(
    "matrix",
    [
        np.arange(36).reshape(6, 6),
        np.arange(36, dtype=np.float32).reshape(6, 6),
        np.arange(36.0).reshape(6, 6).T,
        np.arange(72.0).reshape(6, 12)[:, ::2],
        np.arange(36, dtype=">f8").reshape(6, 6),
    ],
    ids=["integers", "float32", "transposed", "strided", "big-endian"],
)
def test_covariances_of_any_layout(matrix: Any) -> None:
    value = flatland.TwistWithCovariance(7, "base", (1.0, 2.0, 3.0), matrix)
    serialized, expected = by_adapter(value)
    assert serialized == expected


@pytest.mark.parametrize(
    "numbers",
    [
        np.arange(10, dtype=np.float64),
        np.arange(20, dtype=np.float32)[::2],
        np.arange(10, dtype=">f4"),
    ],
    ids=["float64", "strided", "big-endian"],
)
def test_scans_of_any_layout(numbers: Any) -> None:
    scan = flatland.LaserScan(3, "l", 0.0, 1.0, 0.1, 0.0, 0.0, 0.0, 9.0, numbers, numbers[:0])
    serialized, expected = by_adapter(scan)
    assert serialized == expected


def test_stamps_are_those_of_the_clock_of_the_node() -> None:
    set_stamps(lambda time_ns: time_ns + 1_000_000_001)
    try:
        serialized, expected = by_adapter(flatland.NavSatFix(5, "gps", 1.0, 2.0, 3.0))
    finally:
        set_stamps(None)
    assert serialized == expected
    assert struct.unpack_from("<3I", serialized) == (0, 1, 6)


@pytest.mark.parametrize(
    "value",
    [
        flatland.Odometry(0, "odom", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.zeros((6, 5))),
        flatland.NavSatFix(0, "gps", "north", 0.0, 0.0),  # type: ignore[arg-type]
        flatland.NavSatFix(-1, "gps", 0.0, 0.0, 0.0),
        flatland.NavSatFix(0, "\ud800", 0.0, 0.0, 0.0),
    ],
    ids=["covariance", "text", "stamp", "surrogate"],
)
def test_values_without_a_message_raise(value: Any) -> None:
    adapter = find_adapter(type(value))
    assert adapter is not None
    assert adapter.serialize is not None
    with pytest.raises((struct.error, ValueError)):
        adapter.serialize(value)
