"""Ranges as integers of 16 bits."""

from __future__ import annotations

import numpy as np
import pytest
from raw_web_client import Decoder

from flatland.scene.scans import ScanDescription
from flatland.web.encoding import Head
from flatland.web.latest_scans import LatestScans
from flatland.web.scan_codes import MAX_RESOLUTION, codes_of, has_codes
from flatland.web.views import Received

HEAD = Head(0, 1, 0.5)


def codes(ranges: list[float], range_max: float) -> tuple[list[int], float]:
    """Returns the codes and the resolution of a scan."""
    found, resolutions = codes_of(np.array([ranges], np.float32), np.array([range_max]))
    return [int(code) for code in found[0]], float(resolutions[0])


def test_the_error_is_at_most_a_resolution_and_a_hit_remains_a_hit():
    for range_max in (0.1, 8.0, 20.1, 65.0):
        ranges = np.linspace(0, range_max, 5000, dtype=np.float32)[:-1]
        found, resolution = codes(list(ranges), range_max)
        decoded = np.array(found) * np.float32(resolution)
        assert resolution <= MAX_RESOLUTION
        assert np.abs(decoded - ranges).max() <= 1.01 * resolution
        assert (decoded < range_max).all()


def test_special_values_have_codes():
    below = np.nextafter(np.float32(20.1), np.float32(0))
    ranges = [np.nan, np.inf, 20.1, 30.0, -np.inf, 0.0, -1.0, below]
    expected = [65535, 65535, 65535, 65535, 65534, 0, 0, 65533]
    assert codes(ranges, 20.1)[0] == expected


@pytest.mark.parametrize("range_max", [66.0, 1e4, 1e300, float("inf")])
def test_long_ranges_have_no_codes(range_max):
    assert not has_codes(range_max)
    assert has_codes(65.0)


def test_a_message_contains_scans_with_and_without_codes():
    scans = {
        1: ScanDescription((1, 2, 3), np.array([1, 2, np.inf], np.float32), 8.0),
        2: ScanDescription((4, 5, 6), np.array([100, 90.125, -np.inf], np.float32), 1000.0),
        3: ScanDescription((7, 8, 9), np.array([3, np.nan, 5], np.float32), 30.0),
        4: ScanDescription((0, 0, 0), np.array([0.5], np.float32), 4.0),
    }
    latest = LatestScans()
    for tick in (1, 2):
        latest.apply(scans, tick)
    current, late = Received(scans=1), Received(scans=0)
    for received in (current, late):
        data = latest.next_message(received, HEAD, compact=True)
        assert data is not None
        found = Decoder().decode(data).scans()
        assert list(found[2][1]) == [100, 90.125, -np.inf]
        for number, scan in scans.items():
            pose, ranges = found[number]
            assert tuple(pose) == scan.pose
            expected = np.where(scan.ranges < scan.range_max, scan.ranges, np.nan)
            np.testing.assert_allclose(ranges, expected, atol=scan.range_max / 65534)
        assert latest.next_message(received, HEAD, compact=True) is None
    exact = latest.next_message(Received(scans=1), HEAD)
    assert exact is not None
    assert exact[0] == 3
