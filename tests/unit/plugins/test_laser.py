from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flatland
from flatland.physics import RangeFinder

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
    def test_distance_to_axis_aligned_walls_is_exact(self, walls: Walls) -> None:
        ranges = eye(walls.room()).compute_ranges()
        assert ranges.dtype == np.float32
        assert ranges == pytest.approx([6.0, 5.0, 2.0, 3.0], abs=1e-4)

    def test_origin_is_a_pose_in_the_body_frame(self, walls: Walls) -> None:
        world = walls.room("origin: [0.5, 0.25, 3.141592653589793]", pose=(3.0, 4.0, math.pi / 2))
        # The body is at (3, 4) and faces up, the sensor is at (2.75, 4.5) and faces down.
        ranges = eye(world).compute_ranges()
        assert ranges == pytest.approx([3.5, 6.25, 4.5, 1.75], abs=1e-4)

    def test_upside_down_negates_the_angles(self, walls: Walls) -> None:
        ranges = eye(walls.room("upside_down: true")).compute_ranges()
        assert ranges == pytest.approx([6.0, 3.0, 2.0, 5.0], abs=1e-4)

    def test_negative_increment_scans_clockwise(self, walls: Walls) -> None:
        angle = "{min: 1.5707963267948966, max: -1.6, increment: -1.5707963267948966}"
        ranges = eye(walls.room(angle=angle)).compute_ranges()
        assert ranges == pytest.approx([5.0, 6.0, 3.0], abs=1e-4)

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

    def test_a_scan_uses_the_current_pose_of_the_body(self, walls: Walls) -> None:
        world = walls.room()
        world.model("robot").body("base").set_pose(5.0, 5.0, 0.0)
        assert eye(world).compute_ranges() == pytest.approx([4.0] * 4, abs=1e-4)

    def test_each_call_returns_a_new_array(self, walls: Walls) -> None:
        plugin = eye(walls.room())
        first = plugin.compute_ranges()
        first[:] = 0
        assert plugin.compute_ranges()[0] == pytest.approx(6.0, abs=1e-4)


class TestVisibility:
    def bodies(self, footprint: str) -> str:
        return f"""
        - name: base
          footprints: [{{type: circle, radius: 0.3, density: 1}}]
        - name: post
          pose: [2, 0, 0]
          footprints: [{footprint}]
        """

    def range_ahead(self, walls: Walls, footprint: str, extra: str = "") -> float:
        return float(eye(walls.room(extra, bodies=self.bodies(footprint))).compute_ranges()[0])

    def test_other_bodies_of_the_model_are_visible(self, walls: Walls) -> None:
        seen = self.range_ahead(walls, "{type: circle, radius: 0.5, density: 1}")
        assert seen == pytest.approx(1.5, abs=1e-4)

    def test_fixtures_without_collision_are_visible(self, walls: Walls) -> None:
        seen = self.range_ahead(walls, "{type: circle, radius: 0.5, density: 1, collision: false}")
        assert seen == pytest.approx(1.5, abs=1e-4)

    def test_fixtures_of_other_layers_are_invisible(self, walls: Walls) -> None:
        post = "{type: circle, radius: 0.5, density: 1, layers: [3d]}"
        assert self.range_ahead(walls, post, "layers: [3d]") == pytest.approx(1.5, abs=1e-4)
        assert self.range_ahead(walls, post, "layers: [2d]") == pytest.approx(6.0, abs=1e-4)
        assert self.range_ahead(walls, post, "layers: [3d, 2d]") == pytest.approx(1.5, abs=1e-4)
        assert self.range_ahead(walls, post, "layers: [all]") == pytest.approx(1.5, abs=1e-4)
        assert math.isnan(self.range_ahead(walls, post, "layers: []"))


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

    def test_the_message_contains_it(self, walls: Walls) -> None:
        world = walls.room("range_min: 2.5")
        output = world.output("/scan")
        world.step()
        assert output.latest.range_min == 2.5
        assert output.latest.ranges[2] == -math.inf


class TestTimes:
    def test_times_are_reported_as_configured(self, walls: Walls) -> None:
        world = walls.room("scan_time: 0.1, time_increment: 0.025")
        output = world.output("/scan")
        world.step()
        assert (output.latest.scan_time, output.latest.time_increment) == (0.1, 0.025)

    def test_a_time_increment_needs_no_scan_time(self, walls: Walls) -> None:
        world = walls.room("time_increment: 0.025")
        output = world.output("/scan")
        world.step()
        assert (output.latest.scan_time, output.latest.time_increment) == (0.0, 0.025)

    def test_the_scan_remains_instantaneous(self, walls: Walls) -> None:
        world = walls.room("scan_time: 0.1, time_increment: 0.025")
        world.model("robot").body("base").set_velocity(1.0, 0.0, 0.0)
        output = world.output("/scan")
        world.step()
        assert output.latest.ranges == pytest.approx([6.0, 5.0, 2.0, 3.0], abs=1e-4)


class TestNoise:
    @pytest.mark.parametrize(("no_hit", "value"), [("nan", math.nan), ("range", 20.0)])
    def test_misses_have_no_noise(self, walls: Walls, no_hit: str, value: float) -> None:
        world = walls.load(laser(f"noise_std_dev: 0.2, no_hit: {no_hit}"))
        np.testing.assert_array_equal(eye(world).compute_ranges(), np.full(4, value, np.float32))

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
        plugin.compute_ranges()
        assert plugin.intensities.dtype == np.float32
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

    def test_intensities_are_part_of_the_message(self, walls: Walls) -> None:
        plugin = self.load(walls, "-2 -1 -2 1", "4 -1 4 1")
        output = plugin.world.output("/scan")
        plugin.world.step()
        assert output.latest.intensities.tolist() == [255.0, 0.0, 0.0, 0.0]


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

    def test_upside_down_reports_the_angles_as_configured(self, walls: Walls) -> None:
        world = walls.room("upside_down: true", "{min: -1, max: 2, increment: 0.5}")
        output = world.output("/scan")
        world.step()
        assert (output.latest.angle_min, output.latest.angle_max) == (-1.0, 2.0)
        assert output.latest.angle_increment == 0.5

    @pytest.mark.parametrize(
        ("topic", "resolved"), [("front/scan", "/r1/front/scan"), ("/scan", "/scan")]
    )
    def test_topic(self, walls: Walls, topic: str, resolved: str) -> None:
        world = walls.room(f"topic: {topic}", namespace="r1")
        assert list(world.ports.outputs) == [resolved]

    @pytest.mark.parametrize(("frame", "frame_id"), [("lidar", "r1_lidar"), ("/lidar", "lidar")])
    def test_frame(self, walls: Walls, frame: str, frame_id: str) -> None:
        world = walls.room(f"frame: {frame}", namespace="r1")
        output = world.output("/r1/scan")
        world.step()
        assert output.latest.frame_id == frame_id
        assert list(world.transforms) == [("r1_base", frame_id)]

    def test_a_scan_has_the_pose_before_the_step(self, walls: Walls) -> None:
        world = walls.room()
        world.model("robot").body("base").set_velocity(1.0, 0.0, 0.0)
        output = world.output("/scan")
        world.step()
        assert output.latest.ranges[0] == pytest.approx(6.0, abs=1e-4)
        world.step()
        assert output.latest.ranges[0] == pytest.approx(5.995, abs=1e-4)


class TestUpdates:
    def count_scans(self, world: flatland.World, steps: int, monkeypatch: Any) -> int:
        calls: list[int] = []
        scan = RangeFinder.scan

        def count(*arguments: Any) -> Any:
            calls.append(1)
            return scan(*arguments)

        monkeypatch.setattr(RangeFinder, "scan", count)
        world.step(steps)
        return len(calls)

    def test_nothing_is_computed_without_subscribers(
        self, walls: Walls, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert self.count_scans(walls.room(), 10, monkeypatch) == 0

    def test_always_publish(
        self,
        walls: Walls,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        world = walls.room("always_publish: true")
        assert self.count_scans(world, 10, monkeypatch) == 10
        assert world.ports.find_output("/scan").latest is not None

    def test_update_rate(
        self, walls: Walls, collect: Callable[[flatland.World, str], list[Any]]
    ) -> None:
        world = walls.room("update_rate: 40")
        scans = collect(world, "/scan")
        world.step(100)
        assert [scan.stamp for scan in scans] == [k * 25_000_000 for k in range(20)]


class TestTransform:
    def test_transform_is_sent_without_subscribers(self, walls: Walls) -> None:
        world = walls.room("origin: [0.1, 0.2, 0.3]", namespace="r1")
        world.step(2)
        sent = world.transforms["r1_base", "r1_eye"]
        assert sent == flatland.Transform(5_000_000, "r1_base", "r1_eye", 0.1, 0.2, 0.3, 0.0)

    def test_upside_down_is_a_roll(self, walls: Walls) -> None:
        world = walls.room("upside_down: true")
        world.step()
        assert world.transforms["base", "eye"].roll == pytest.approx(math.pi)

    def test_no_transform_without_broadcast_tf(self, walls: Walls) -> None:
        world = walls.room("broadcast_tf: false")
        world.step()
        assert world.transforms == {}

    def test_transform_is_sent_at_the_update_rate(self, walls: Walls) -> None:
        world = walls.room("update_rate: 40")
        stamps = []
        for _ in range(20):
            world.step()
            stamps.append(world.transforms["base", "eye"].stamp)
        assert sorted(set(stamps)) == [0, 25_000_000, 50_000_000, 75_000_000]


class TestErrors:
    @pytest.mark.parametrize(
        ("extra", "message"),
        [
            ("noise_std_dev: .inf", 'Invalid "noise_std_dev", must be at most 1e+06 m, got inf'),
            ("noise_std_dev: 1e300", 'Invalid "noise_std_dev", must be at most 1e+06 m, got'),
            (
                "range_min: -0.1",
                'Invalid "range_min", must not be negative and less than "range", 20 m',
            ),
            ("range_min: 20", 'must not be negative and less than "range", 20 m, got 20'),
            ("range_min: .nan", 'Invalid "range_min", must not be negative'),
            ("time_increment: .inf", 'Invalid "time_increment", must be finite and not negative'),
            (
                "scan_time: 0.1, time_increment: 0.05",
                'Invalid "time_increment", 4 beams must not take longer than the scan_time of '
                "0.1 s, got 0.05 s per beam, 0.15 s in total",
            ),
        ],
    )
    def test_other_parameters(self, plugin_world: Any, extra: str, message: str) -> None:
        text = plugin_world.error(laser(extra))
        assert message in text
        assert "robot.model.yaml:" in text


def test_beams_end_at_the_range(plugin_world: Any) -> None:
    angle = "angle: {min: 0, max: 1.5707963, increment: 1.5707963}"
    world = plugin_world(f"[{{type: Laser, name: eye, body: base, range: 5, {angle}}}]")
    ends = world.model("robot").plugin("eye").beam_ends
    np.testing.assert_allclose(ends, [[5, 0], [0, 5]], atol=1e-5)
