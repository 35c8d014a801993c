"""Gps: position, message, transform and rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import flatland
from flatland import NavSatFix
from flatland.plugins._geodesy import TangentPlane

GPS = "[{type: Gps, name: antenna, body: base}]"
DEGREE = math.radians(1.0)
A = 6378137.0
E2 = 0.0066943799831668

Collect = Callable[[flatland.World, str], list[Any]]


def test_defaults(plugin_world: Any, collect: Collect) -> None:
    world = plugin_world(GPS, namespace="r1", pose=(100, 200, 0))
    assert list(world.ports.outputs) == ["/r1/gps/fix"]
    messages = collect(world, "/r1/gps/fix")
    world.step(201)
    # 10 Hz from time 0 on, stamped with the time before the step.
    assert [message.stamp for message in messages] == [100_000_000 * i for i in range(11)]
    fix = messages[0]
    assert type(fix) is NavSatFix
    assert fix.frame_id == "r1_antenna"
    # The default reference point is on the equator and the prime meridian; x is east, y north.
    assert fix.longitude == pytest.approx(100 / A / DEGREE, rel=1e-9)
    assert fix.latitude == pytest.approx(200 / (A * (1 - E2)) / DEGREE, rel=1e-8)
    assert fix.altitude == 0.0
    transform = world.transforms["r1_base", "r1_antenna"]
    assert (transform.x, transform.y, transform.yaw, transform.roll) == (0, 0, 0, 0)
    assert transform.stamp == messages[-1].stamp


def test_antenna_turns_with_the_body(plugin_world: Any) -> None:
    world = plugin_world(
        "[{type: Gps, name: gps, body: base, origin: [3, 1, 0.5], ref_lat: 43.4516, "
        "ref_lon: -80.4925}]",
        pose=(100, 200, math.pi / 2),
    )
    output = world.output("/gps/fix")
    world.step()
    expected = TangentPlane(43.4516, -80.4925).geodetic(100 - 1, 200 + 3)
    assert (output.latest.latitude, output.latest.longitude) == pytest.approx(expected, abs=1e-9)


def test_position_is_that_before_the_step(plugin_world: Any) -> None:
    world = plugin_world("[{type: Gps, name: gps, body: base, update_rate: .inf}]")
    output = world.output("/gps/fix")
    world.model("robot").body("base").set_velocity(10.0, 0.0, 0.0)
    world.step()
    assert output.latest.stamp == 0
    assert output.latest.longitude == 0.0
    world.step()
    assert output.latest.stamp == 5_000_000
    assert output.latest.longitude == pytest.approx(0.05 / A / DEGREE, rel=1e-4)


@pytest.mark.parametrize(("latitude", "longitude"), [(90, 0), (-90, 0), (0, 180), (0, 0)])
def test_reference_points_at_poles_and_equator(
    plugin_world: Any, latitude: float, longitude: float
) -> None:
    world = plugin_world(
        f"[{{type: Gps, name: gps, body: base, ref_lat: {latitude}, ref_lon: {longitude}}}]"
    )
    output = world.output("/gps/fix")
    world.step()
    assert output.latest.latitude == pytest.approx(latitude, abs=1e-9)
    assert abs(output.latest.longitude) == pytest.approx(longitude, abs=1e-9)


def test_parameters(plugin_world: Any, collect: Collect) -> None:
    entry = "topic: /where, frame: mast_top, origin: [0.1, 0.2, 0.3], update_rate: 50"
    world = plugin_world(
        f"[{{type: Gps, name: gps, body: base, {entry}}},"
        " {type: Gps, name: other, body: base, broadcast_tf: false}]",
        namespace="r1",
    )
    messages = collect(world, "/where")
    world.step(200)
    assert len(messages) == 50
    assert messages[0].frame_id == "r1_mast_top"
    assert list(world.transforms) == [("r1_base", "r1_mast_top")]
    transform = world.transforms["r1_base", "r1_mast_top"]
    assert (transform.x, transform.y, transform.yaw, transform.roll) == (0.1, 0.2, 0.3, 0.0)


def test_transform_is_sent_at_the_update_rate_without_subscribers(plugin_world: Any) -> None:
    world = plugin_world(GPS)
    world.step()
    assert world.transforms["base", "antenna"].stamp == 0
    world.step(19)
    assert world.transforms["base", "antenna"].stamp == 0
    world.step()
    assert world.transforms["base", "antenna"].stamp == 100_000_000
    assert world.ports.find_output("/gps/fix").latest is None
