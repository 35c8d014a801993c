from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import flatland

ROOM = [
    "##########",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "#........#",
    "##########",
]  # 1 m cells: walls at x, y = 1 and 9
ROOM_LAYERS = "[{name: 2d, map: room.yaml}, {name: 3d}]"
CROSS = "{min: 0, max: 4.8, increment: 1.5707963267948966}"  # right, up, left, down


BESIDE_A_POST = """
- name: base
  footprints: [{type: circle, radius: 0.2, density: 1, layers: [3d]}]
- name: post
  pose: [0.501, 0, 0]
  footprints: [{type: circle, radius: 0.5, density: 1}]
"""


def laser(extra: str = "", angle: str = CROSS) -> str:
    return f"- {{type: Laser, name: eye, body: base, range: 20, angle: {angle}, {extra}}}"


class Walls:
    """Loads worlds with walls and a robot with a laser."""

    def __init__(self, plugin_world: Any) -> None:
        self.load = plugin_world
        self.files = plugin_world.files

    def room(self, extra: str = "", angle: str = CROSS, **options: Any) -> flatland.World:
        self.files.write_map("room", ROOM)
        options = {"pose": (3.0, 4.0, 0.0), "layers": ROOM_LAYERS, **options}
        return self.load(laser(extra, angle), **options)

    def segments(self, name: str, lines: str) -> str:
        self.files.write(f"{name}.dat", lines)
        self.files.write(
            f"{name}.yaml",
            f"{{type: line_segments, data: {name}.dat, scale: 1, origin: [0, 0, 0]}}",
        )
        return f"{name}.yaml"


@pytest.fixture
def walls(plugin_world: Any) -> Walls:
    return Walls(plugin_world)


def eye(world: flatland.World) -> Any:
    return world.model("robot").plugin("eye")


class TestRanges:
    @pytest.mark.parametrize(
        ("extra", "angle", "yaw", "expected"),
        [
            ("", CROSS, 0.0, [6.0, 5.0, 2.0, 3.0]),
            ("upside_down: true", CROSS, 0.0, [6.0, 3.0, 2.0, 5.0]),
            # The body at (3, 4) faces up, the sensor at (2.75, 4.5) faces down.
            ("origin: [0.5, 0.25, 3.141592653589793]", CROSS, math.pi / 2, [3.5, 6.25, 4.5, 1.75]),
            (
                "",
                "{min: 1.5707963267948966, max: -1.6, increment: -1.5707963267948966}",
                0.0,
                [5.0, 6.0, 3.0],
            ),
        ],
    )
    def test_distance_to_axis_aligned_walls_is_exact(
        self, walls: Walls, extra: str, angle: str, yaw: float, expected: list[float]
    ) -> None:
        ranges = eye(walls.room(extra, angle, pose=(3.0, 4.0, yaw))).compute_ranges()
        assert ranges.dtype == np.float32
        assert ranges == pytest.approx(expected, abs=1e-4)

    @pytest.mark.parametrize(
        ("angle", "count"),
        [
            ("{min: -1, max: 1, increment: 0.1}", 21),
            ("{min: 0, max: 1, increment: 0.3}", 4),
            ("{min: 0, max: 1, increment: 0.35}", 4),
            ("{min: 0, max: 1, increment: 0.4}", 4),
            ("{min: 0, max: 0.5, increment: 0.2}", 4),
            ("{min: 2, max: 2, increment: 1}", 1),
            ("{min: 2, max: 2, increment: -1}", 1),
            ("{min: 1.5, max: -1.5, increment: -0.02}", 151),
        ],
    )
    def test_number_of_beams_is_rounded(self, walls: Walls, angle: str, count: int) -> None:
        assert eye(walls.room(angle=angle)).compute_ranges().shape == (count,)

    def test_each_call_returns_a_new_array(self, walls: Walls) -> None:
        plugin = eye(walls.room())
        first = plugin.compute_ranges()
        first[:] = 0
        assert plugin.compute_ranges()[0] == pytest.approx(6.0, abs=1e-4)


class TestVisibility:
    POST = "{{type: circle, radius: 0.5, density: 1, {}}}"

    @pytest.mark.parametrize(
        ("post", "extra", "expected"),
        [
            ("", "", 1.5),  # another body of the model
            ("collision: false", "", 1.5),
            ("layers: [3d]", "layers: [3d]", 1.5),
            ("layers: [3d]", "layers: [2d]", 6.0),
            ("layers: [3d]", "layers: [3d, 2d]", 1.5),
            ("layers: [3d]", "layers: [all]", 1.5),
            ("layers: [3d]", "layers: []", math.nan),
        ],
    )
    def test_a_post_ahead(self, walls: Walls, post: str, extra: str, expected: float) -> None:
        bodies = f"""
        - name: base
          footprints: [{{type: circle, radius: 0.3, density: 1}}]
        - name: post
          pose: [2, 0, 0]
          footprints: [{self.POST.format(post)}]
        """
        ahead = eye(walls.room(extra, bodies=bodies)).compute_ranges()[0]
        assert ahead == pytest.approx(expected, abs=1e-4, nan_ok=True)


class TestNoHit:
    @pytest.mark.parametrize(
        ("extra", "value"),
        [
            ("", math.nan),
            ("no_hit: nan", math.nan),
            ("no_hit: inf", math.inf),
            ("no_hit: range", 20.0),
        ],
    )
    def test_value_of_a_beam_without_hit(self, walls: Walls, extra: str, value: float) -> None:
        ranges = eye(walls.load(laser(extra))).compute_ranges()
        np.testing.assert_array_equal(ranges, np.full(4, value, np.float32))

    @pytest.mark.parametrize("length", [0.5, 1e6])
    def test_minimum_and_maximum_range(self, walls: Walls, length: float) -> None:
        plugin = laser("no_hit: range").replace("range: 20", f"range: {length}")
        assert eye(walls.load(plugin)).compute_ranges().tolist() == [length] * 4

    def test_a_wall_beyond_the_range_is_a_miss(self, walls: Walls) -> None:
        walls.files.write_map("room", ROOM)
        plugin = laser().replace("range: 20", "range: 4")
        world = walls.load(plugin, layers=ROOM_LAYERS, pose=(3.0, 4.0, 0.0))
        np.testing.assert_allclose(
            eye(world).compute_ranges(), [math.nan, math.nan, 2.0, 3.0], atol=1e-4
        )


class TestRangeMin:
    @pytest.mark.parametrize("no_hit", ["nan", "inf", "range"])
    def test_a_hit_that_is_too_close_is_negative_infinity(self, walls: Walls, no_hit: str) -> None:
        ranges = eye(walls.room(f"range_min: 2.5, no_hit: {no_hit}")).compute_ranges()
        assert ranges[2] == -math.inf
        assert ranges[[0, 1, 3]] == pytest.approx([6.0, 5.0, 3.0], abs=1e-4)

    def test_the_measured_range_counts(self, walls: Walls) -> None:
        angle = "{min: 3.1414, max: 3.1416, increment: 2.0e-7}"  # to the wall at 2 m
        ranges = eye(walls.room("range_min: 2, noise_std_dev: 0.1", angle)).compute_ranges()
        close = ranges == -math.inf
        assert 0.4 < close.mean() < 0.6
        assert (ranges[~close] >= 2).all()

    def test_nothing_is_too_close_by_default(self, walls: Walls) -> None:
        world = walls.load(laser(), bodies=BESIDE_A_POST)
        assert eye(world).compute_ranges()[0] == pytest.approx(0.001, abs=1e-4)


class TestNoise:
    def test_the_number_of_calls_is_part_of_the_state(self, walls: Walls) -> None:
        world = walls.room("noise_std_dev: 0.2")
        before = world.state_hash()
        eye(world).compute_ranges()
        assert world.state_hash() != before

    def test_calls_of_compute_ranges_do_not_change_published_scans(self, walls: Walls) -> None:
        def scans(calls: int) -> list[float]:
            world = walls.room("noise_std_dev: 0.2", seed=3)
            output = world.output("/scan")
            for _ in range(calls):
                eye(world).compute_ranges()
            world.step(3)
            return output.latest.ranges.tolist()  # type: ignore[no-any-return]

        assert scans(0) == scans(2)


class TestIntensities:
    def load(self, walls: Walls, near: str, far: str, layers: str = "[all]") -> Any:
        """A segment 2 m range_ahead in the layer `plain`, one 4 m range_ahead in `reflectance`."""
        maps = (walls.segments("near", near), walls.segments("far", far))
        text = f"[{{name: plain, map: {maps[0]}}}, {{name: reflectance, map: {maps[1]}}}]"
        return eye(walls.load(laser(f"layers: {layers}"), layers=text))

    def test_empty_without_a_reflectance_layer(self, walls: Walls) -> None:
        plugin = eye(walls.room())
        plugin.compute_ranges()
        assert plugin.intensities.shape == (0,)
        assert plugin.intensities.dtype == np.float32

    def test_hits_in_the_layer_have_intensity_255(self, walls: Walls) -> None:
        plugin = self.load(walls, "-2 -1 -2 1", "4 -1 4 1")
        output = plugin.world.output("/scan")
        plugin.world.step()
        assert output.latest.intensities.dtype == np.float32
        assert output.latest.intensities.tolist() == [255.0, 0.0, 0.0, 0.0]
        assert plugin.intensities.tolist() == [255.0, 0.0, 0.0, 0.0]

    def test_the_reflectance_layer_may_be_the_first_one(self, walls: Walls) -> None:
        layers = f"[{{name: reflectance, map: {walls.segments('near', '2 -1 2 1')}}}]"
        plugin = eye(walls.load(laser(), layers=layers))
        plugin.compute_ranges()
        assert plugin.intensities.tolist() == [255.0, 0.0, 0.0, 0.0]

    def test_a_reflectance_layer_that_is_invisible_has_no_effect(self, walls: Walls) -> None:
        plugin = self.load(walls, "-2 -1 -2 1", "4 -1 4 1", "[plain]")
        assert math.isnan(plugin.compute_ranges()[0])
        assert plugin.intensities.tolist() == [0.0] * 4


class TestMessage:
    def test_fields(self, walls: Walls) -> None:
        world = walls.room(angle="{min: -1, max: 1, increment: 0.3}", namespace="r1")
        output = world.output("/r1/scan")
        world.step(3)
        scan = output.latest
        assert isinstance(scan, flatland.LaserScan)
        assert scan.stamp == 10_000_000
        assert scan.frame_id == "r1_eye"
        assert (scan.angle_min, scan.angle_max, scan.angle_increment) == (-1.0, 1.0, 0.3)
        assert (scan.time_increment, scan.scan_time) == (0.0, 0.0)
        assert (scan.range_min, scan.range_max) == (0.0, 20.0)
        assert scan.ranges.shape == (8,)
        assert scan.intensities.shape == (0,)

    @pytest.mark.parametrize("scan_time", [0.1, 0.0])  # A time increment needs no scan time.
    def test_fields_that_are_configured(self, walls: Walls, scan_time: float) -> None:
        extra = (
            f"scan_time: {scan_time}, time_increment: 0.025, range_min: 2.5, upside_down: true, "
            "topic: /front/scan"
        )
        world = walls.room(extra, "{min: 0, max: 4.8, increment: 1.6}", namespace="r1")
        output = world.output("/front/scan")
        world.step()
        scan = output.latest
        assert (scan.scan_time, scan.time_increment) == (scan_time, 0.025)
        assert scan.range_min == 2.5
        assert scan.ranges[2] == -math.inf
        # The angles are reported as configured; the transform turns them.
        assert (scan.angle_min, scan.angle_max, scan.angle_increment) == (0.0, 4.8, 1.6)
        assert world.transforms["r1_base", "r1_eye"].roll == pytest.approx(math.pi)

    def test_a_scan_has_the_pose_before_the_step(self, walls: Walls) -> None:
        world = walls.room("scan_time: 0.1, time_increment: 0.025")
        world.model("robot").body("base").set_velocity(1.0, 0.0, 0.0)
        output = world.output("/scan")
        world.step()
        # The motion within the scan time has no effect.
        assert output.latest.ranges == pytest.approx([6.0, 5.0, 2.0, 3.0], abs=1e-4)
        world.step()
        assert output.latest.ranges[0] == pytest.approx(5.995, abs=1e-4)

    def test_always_publish(self, walls: Walls) -> None:
        world = walls.room("always_publish: true, broadcast_tf: false")
        world.step(2)
        assert world.ports.find_output("/scan").latest.stamp == 5_000_000
        assert world.transforms == {}

    def test_update_rate(self, walls: Walls, collect: Any) -> None:
        world = walls.room("update_rate: 40")
        scans = collect(world, "/scan")
        world.step(100)
        assert [scan.stamp for scan in scans] == [k * 25_000_000 for k in range(20)]
        assert world.transforms["base", "eye"].stamp == scans[-1].stamp


class TestTransform:
    def test_transform_is_sent_without_subscribers(self, walls: Walls) -> None:
        world = walls.room("origin: [0.1, 0.2, 0.3]", namespace="r1")
        world.step(2)
        sent = world.transforms["r1_base", "r1_eye"]
        assert sent == flatland.Transform(5_000_000, "r1_base", "r1_eye", 0.1, 0.2, 0.3, 0.0)


def test_beams_end_at_the_range(plugin_world: Any) -> None:
    angle = "angle: {min: 0, max: 1.5707963, increment: 1.5707963}"
    world = plugin_world(f"[{{type: Laser, name: eye, body: base, range: 5, {angle}}}]")
    ends = world.model("robot").plugin("eye").beam_ends
    np.testing.assert_allclose(ends, [[5, 0], [0, 5]], atol=1e-5)
