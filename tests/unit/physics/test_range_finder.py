"""Range finders of the core: their noise, and scans of many of them in one call."""

from __future__ import annotations

import hashlib
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from programs import run_program

from flatland.errors import StaleHandleError
from flatland.physics import (
    PhysicsBody,
    PhysicsWorld,
    RangeFinder,
    RangeNoise,
    ScanRequest,
    scan_all,
)

LENGTH = 20.0
EXACT = 6.0  # m; distance of the wall ahead
BEAM_MODEL = {
    "z_hit": 0.5,
    "z_short": 0.2,
    "z_max": 0.1,
    "z_rand": 0.2,
    "sigma_hit": 4.0,
    "lambda_short": 0.4,
    "max_range": LENGTH,
}
NOISES: list[RangeNoise | None] = [
    None,
    RangeNoise.additive(0.1),
    RangeNoise.proportional(0.05),
    RangeNoise.beam(**BEAM_MODEL),
]


def fan(beams: int, first: float = -math.pi, last: float = math.pi) -> npt.NDArray[np.float64]:
    angles = np.linspace(first, last, beams)
    ends: npt.NDArray[np.float64] = LENGTH * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return ends


def finder(ends: npt.ArrayLike, noise: RangeNoise | None = None, **options: Any) -> RangeFinder:
    return RangeFinder(
        ends, LENGTH, **{"origin": (0.1, -0.2, 0.3), "mask": 0xFFFF, "noise": noise, **options}
    )


def crowd(seed: int, bodies: int = 150) -> tuple[PhysicsWorld, list[PhysicsBody]]:
    """Creates a world with walls and many circles and polygons."""
    rng = np.random.default_rng(seed)
    world = PhysicsWorld()
    wall = world.create_body("static", (0, 0, 0))
    wall.create_edges(rng.uniform(-15, 15, (60, 4)), category_bits=1)
    wall.create_edges(rng.uniform(-15, 15, (20, 4)), category_bits=2)
    made = []
    for index in range(bodies):
        pose = (*rng.uniform(-15, 15, 2), rng.uniform(-3, 3))
        body = world.create_body("dynamic", pose)
        bits = int(rng.integers(1, 4))
        body.create_circle((0.1, 0.0), 0.2, density=1.0, category_bits=bits)
        if index % 2:
            body.create_polygon(rng.uniform(-0.4, 0.4, (6, 2)), density=1.0, category_bits=bits)
        made.append(body)
    return world, made


def requests(bodies: list[PhysicsBody]) -> list[ScanRequest]:
    """Returns scans with different fans, noise models and intensities."""
    fans = [fan(180), fan(181, 2.0, -2.0), fan(67, -1.0, 7.0), np.vstack([fan(20), [[0, 0]]])]
    found = []
    for index, body in enumerate(bodies):
        noise = NOISES[index % len(NOISES)]
        options = {"reflect_mask": 2 if index % 3 else 0, "range_min": 0.5, "no_hit": math.inf}
        made = finder(fans[index % 5 % len(fans)], noise, **options)
        found.append(ScanRequest(made, body, 1000 + index, index // 2))
    return found


def digest(scans: list[Any]) -> str:
    """Returns a hash of the bytes of scans."""
    hasher = hashlib.sha256()
    for pose, ranges, intensities in scans:
        hasher.update(np.array(pose).tobytes() + ranges.tobytes())
        hasher.update(b"" if intensities is None else intensities.tobytes())
    return hasher.hexdigest()


class TestReadings:
    @pytest.mark.parametrize("beams", [1, 2, 15, 16, 17, 64, 65, 1081])
    @pytest.mark.parametrize("span", [(-math.pi, 3.0), (2.0, -2.0), (0.0, 9.0)])
    def test_exact_ranges_equal_those_of_single_rays(
        self, beams: int, span: tuple[float, float]
    ) -> None:
        world, bodies = crowd(1)
        ends = fan(beams, *span)
        pose, ranges, intensities = finder(ends).scan(bodies[0], 0, 0)
        fractions, _ = world.cast_rays_reference(pose, ends, 0xFFFF)
        np.testing.assert_array_equal(ranges, fractions * np.float32(LENGTH))
        assert intensities is None

    def test_beams_of_zero_length_are_misses(self) -> None:
        _, bodies = crowd(1)
        ends = fan(40)
        ends[[0, 17, 39]] = 0.0
        expected = finder(fan(40)).scan(bodies[0], 0, 0).ranges
        ranges = finder(ends).scan(bodies[0], 0, 0).ranges
        assert np.isnan(ranges[[0, 17, 39]]).all()
        rest = np.delete(np.arange(40), [0, 17, 39])
        np.testing.assert_array_equal(ranges[rest], expected[rest])

    def test_the_pose_is_that_of_the_sensor(self, world: PhysicsWorld) -> None:
        body = world.create_body("static", (1.0, 2.0, math.pi / 2))
        assert finder(fan(3)).scan(body, 0, 0).pose == pytest.approx((1.2, 2.1, math.pi / 2 + 0.3))

    def test_limits(self, world: PhysicsWorld) -> None:
        body = world.create_body("static", (0, 0, 0))
        body.create_edges([[1, -1, 1, 1], [-5, -1, -5, 1]])
        ends = [[LENGTH, 0], [-LENGTH, 0], [0, LENGTH]]
        made = finder(ends, origin=(0, 0, 0), range_min=2.0, no_hit=7.5)
        assert made.scan(body, 0, 0).ranges.tolist() == [-math.inf, 5.0, 7.5]

    def test_noise_makes_ranges_negative_without_a_minimum(self, world: PhysicsWorld) -> None:
        body = world.create_body("static", (0, 0, 0))
        body.create_edges([[0.1, -1, 0.1, 1]])
        ends = np.repeat([[LENGTH, 0.0]], 100, axis=0)
        for range_min in (0.0, 0.05):
            made = finder(ends, RangeNoise.additive(1), origin=(0, 0, 0), range_min=range_min)
            ranges = made.scan(body, 1, 1).ranges
            assert (ranges < 0).any()
            assert np.isinf(ranges[ranges < 0]).all() == (range_min > 0)
            assert np.isinf(ranges).any() == (range_min > 0)

    @pytest.mark.parametrize("noise", NOISES)
    def test_intensities_are_those_of_readings_of_reflecting_fixtures(
        self, world: PhysicsWorld, noise: RangeNoise | None
    ) -> None:
        body = world.create_body("static", (0, 0, 0))
        body.create_edges([[5, -9, 5, 9]], category_bits=2)
        body.create_edges([[-5, -9, -5, 9]], category_bits=1)
        ends = np.repeat([[LENGTH, 0], [-LENGTH, 0]], 400, axis=0)
        made = finder(ends, noise, origin=(0, 0, 0), reflect_mask=2)
        intensities = made.scan(body, 1, 1).intensities
        assert intensities is not None
        assert intensities.dtype == np.float32
        assert (intensities[400:] == 0).all()
        if noise is NOISES[-1]:  # other readings than hits
            assert set(intensities[:400]) == {0.0, 255.0}
            assert (intensities[:400] == 255).mean() == pytest.approx(0.5, abs=0.15)
        else:
            assert (intensities[:400] == 255).all()


class TestManyScans:
    @pytest.mark.parametrize("threads", [0, 1, 2, 3, 16])
    def test_they_equal_single_scans_for_any_number_of_threads(self, threads: int) -> None:
        _, bodies = crowd(2)
        jobs = requests(bodies[:100])
        single = [job.finder.scan(job.body, job.stream, job.update) for job in jobs]
        assert digest(scan_all(jobs, num_threads=threads)) == digest(single)

    def test_several_worlds(self) -> None:
        jobs = [job for seed in range(6) for job in requests(crowd(seed, 70)[1][:9])]
        mixed = [jobs[i] for i in np.random.default_rng(1).permutation(len(jobs))]
        single = [job.finder.scan(job.body, job.stream, job.update) for job in mixed]
        assert digest(scan_all(mixed, num_threads=2)) == digest(single)

    def test_moved_bodies_are_seen(self) -> None:
        _, bodies = crowd(3)
        jobs = requests(bodies[:20])
        before = digest(scan_all(jobs))
        for body in bodies[20:]:
            x, y, theta = body.pose
            body.set_pose(y, x, theta)
        after = [job.finder.scan(job.body, job.stream, job.update) for job in jobs]
        assert digest(scan_all(jobs)) == digest(after)
        assert digest(after) != before

    def test_a_body_that_overflowed_hides_no_other(self) -> None:
        world, bodies = crowd(4)
        for body in bodies[-3:]:
            body.set_velocity(1e9, 1e9, 0.0)
        for _ in range(3):
            world.step(1e3, 1, 1)
        for body in bodies[:-3]:
            body.set_pose(*np.random.default_rng(body.id).uniform(-15, 15, 3))
        jobs = requests(bodies[:20])
        single = [job.finder.scan(job.body, job.stream, job.update) for job in jobs]
        assert digest(scan_all(jobs)) == digest(single)

    def test_ranges_are_written_to_an_array(self) -> None:
        _, bodies = crowd(2)
        jobs = [ScanRequest(finder(fan(100)), body, 0, 0) for body in bodies[:10]]
        out = np.full((10, 100), -1, np.float32)
        scans = scan_all(jobs, out)
        assert all(np.shares_memory(scan.ranges, out) for scan in scans)
        np.testing.assert_array_equal(out, [scan.ranges for scan in scan_all(jobs)])

    def test_no_scans(self) -> None:
        assert scan_all([]) == []
        assert scan_all([], np.zeros((0, 5), np.float32)) == []

    @pytest.mark.parametrize(
        ("out", "error", "message"),
        [
            (np.zeros((2, 9), np.float32), ValueError, r"out must have shape \(2, 10\)"),
            (np.zeros((3, 10), np.float32), ValueError, r"out must have shape \(2, 10\)"),
            (np.zeros(20, np.float32), ValueError, r"out must have shape \(2, 10\), got \(20,\)"),
            (np.zeros((2, 10)), TypeError, "C-contiguous array of type float32"),
            (np.zeros((10, 2), np.float32).T, TypeError, "C-contiguous array of type float32"),
            ([[0.0] * 10] * 2, TypeError, "C-contiguous array of type float32"),
        ],
    )
    def test_invalid_output_arrays(self, out: Any, error: type[Exception], message: str) -> None:
        _, bodies = crowd(2, 2)
        jobs = [ScanRequest(finder(fan(10)), body, 0, 0) for body in bodies]
        with pytest.raises(error, match=message):
            scan_all(jobs, out)

    def test_other_invalid_arguments(self) -> None:
        world, bodies = crowd(2, 3)
        made = finder(fan(10))
        jobs = [ScanRequest(made, body, 0, 0) for body in bodies]
        with pytest.raises(ValueError, match="num_threads must not be negative, got -1"):
            scan_all(jobs, num_threads=-1)
        read_only = np.zeros((3, 10), np.float32)
        read_only.flags.writeable = False
        with pytest.raises(ValueError, match="out must be writeable"):
            scan_all(jobs, read_only)
        different = [jobs[0], ScanRequest(finder(fan(11)), bodies[0], 0, 0)]
        with pytest.raises(ValueError, match="the same number of beams, got 10 and 11"):
            scan_all(different, np.zeros((2, 10), np.float32))
        bodies[1].destroy()
        with pytest.raises(StaleHandleError):
            scan_all(jobs)
        other, (body,) = crowd(3, 1)
        world.close()
        with pytest.raises(StaleHandleError):
            scan_all([ScanRequest(made, body, 0, 0), jobs[0]])
        other.step(0.01, 1, 1)  # is not locked


@pytest.mark.parametrize("shape", ["edge", "box"])
def test_each_beam_can_be_the_only_one_that_passes_a_gap(shape: str) -> None:
    beams = 64
    world = PhysicsWorld()
    sensor = world.create_body("kinematic", (0, 0, 0))
    # A ring of edges that is open to one beam, and behind it a target, wide enough for several.
    corners = np.array([(x / LENGTH, y / LENGTH) for x, y in fan(60, 0.06, 2 * math.pi - 0.06)])
    world.create_body("static", (0, 0, 0)).create_edges(
        np.hstack([corners[:-1], corners[1:]]), category_bits=1
    )
    target = world.create_body("static", (5, 0, 0))
    if shape == "edge":
        target.create_edges([[0, -2, 0, 2]], category_bits=1)
    else:
        target.create_polygon([(0, -2), (1, -2), (1, 2), (0, 2)], density=0)
    scanner = finder(fan(beams + 1)[:-1], origin=(0, 0, 0))
    for beam in range(beams):
        sensor.set_pose(0, 0, math.pi - 2 * math.pi * beam / beams)
        ranges = scanner.scan(sensor, 1, 1).ranges
        assert ranges[beam] == pytest.approx(5.0, abs=1e-4)
        assert np.delete(ranges, beam).max() < 1.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"beams": np.zeros((5, 3))}, r"ends must have shape \(n, 2\), got \(5, 3\)"),
        ({"beams": [[1.0, math.nan]]}, "ends"),
        ({"origin": (0.0, math.inf, 0.0)}, "origin"),
        ({"origin": (0.0, 0.0, math.nan)}, "origin angle"),
        ({"length": -1.0}, "length must not be negative, got -1"),
        ({"length": math.inf}, "length"),
        ({"mask": 1 << 16}, "mask"),
        ({"reflect_mask": -1}, "reflect_mask"),
        ({"range_min": -0.1}, "range_min must not be negative"),
        ({"range_min": math.nan}, "range_min"),
        ({"no_hit": 1e300}, "no_hit"),
        (
            {"noise": NOISES[-1], "length": 20.1},
            "length must be at most the max_range of the noise",
        ),
    ],
)
def test_invalid_range_finders(arguments: dict[str, Any], message: str) -> None:
    valid: dict[str, Any] = {"beams": fan(5), "length": 20.0, "origin": (0, 0, 0), "mask": 1}
    RangeFinder(**valid)
    with pytest.raises(ValueError, match=message):
        RangeFinder(**{**valid, **arguments})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RangeNoise.additive(-0.1), "deviation must not be negative"),
        (lambda: RangeNoise.proportional(math.nan), "deviation"),
        (lambda: RangeNoise.beam(**{**BEAM_MODEL, "z_hit": -1}), "share must not be negative"),
        (lambda: RangeNoise.beam(**{**BEAM_MODEL, "sigma_hit": 21}), "at least sigma_hit"),
        (lambda: RangeNoise.beam(**{**BEAM_MODEL, "max_range": 0}), "max_range must be positive"),
        (lambda: RangeNoise.beam(**{**BEAM_MODEL, "lambda_short": 0}), "lambda_short must be"),
        (
            lambda: RangeNoise.beam(**dict.fromkeys(BEAM_MODEL, 0.0) | {"max_range": 1.0}),
            "the sum of the shares must be positive",
        ),
    ],
)
def test_invalid_noise(make: Callable[[], RangeNoise], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


class TestNormalNoise:
    BEAMS = 200_000

    def normal_numbers(self, stream: int = 1, update: int = 1) -> npt.NDArray[np.float64]:
        """Returns the noise of beams that all hit a wall, in standard deviations."""
        world = PhysicsWorld()
        body = world.create_body("static", (0, 0, 0))
        body.create_edges([[EXACT, -1, EXACT, 1]])
        ends = np.repeat([[LENGTH, 0.0]], self.BEAMS, axis=0)
        made = finder(ends, RangeNoise.additive(1000.0), origin=(0, 0, 0))
        return (made.scan(body, stream, update).ranges.astype(np.float64) - EXACT) / 1000.0

    def test_distribution(self) -> None:
        samples = np.concatenate([self.normal_numbers(update=update) for update in range(2)])
        n = len(samples)
        # Five standard errors of the mean, the variance, the skewness and the kurtosis.
        assert abs(samples.mean()) < 5 / math.sqrt(n)
        assert abs(samples.var() - 1) < 5 * math.sqrt(2 / n)
        assert abs((samples**3).mean()) < 5 * math.sqrt(15 / n)
        assert abs((samples**4).mean() - 3) < 5 * math.sqrt(96 / n)
        cumulative = np.array([0.5 * math.erfc(-x / math.sqrt(2)) for x in np.sort(samples)])
        steps = np.arange(n + 1) / n
        largest = max(abs(cumulative - steps[1:]).max(), abs(cumulative - steps[:-1]).max())
        assert largest * math.sqrt(n) < 1.95  # Kolmogorov-Smirnov, p = 0.001

    def test_tails(self) -> None:
        samples = np.concatenate([self.normal_numbers(stream=9, update=i) for i in range(20)])
        for sigmas in (3.0, 4.0, 4.5, 5.0):
            for tail in (samples > sigmas, samples < -sigmas):
                expected = 0.5 * math.erfc(sigmas / math.sqrt(2)) * len(samples)
                assert abs(tail.sum() - expected) < 5 * math.sqrt(expected) + 1, sigmas

    def test_beams_updates_and_streams_are_independent(self) -> None:
        first = self.normal_numbers()
        limit = 5 / math.sqrt(self.BEAMS)
        for lag in (1, 2, 4, 15, 16, 17, 32, 48, 64, 1081):
            assert abs((first[lag:] * first[:-lag]).mean()) < limit, lag
            # Also of the magnitudes: numbers of one pair have a common radius.
            squares = first**2 - 1
            assert abs((squares[lag:] * squares[:-lag]).mean()) < 2 * limit, lag
        for stream, update in ((1, 2), (2, 1), (1 << 32, 1), (1, 1 << 32), (1, (1 << 64) - 1)):
            other = self.normal_numbers(stream, update)
            assert abs((first * other).mean()) < limit, (stream, update)

    def test_numbers_of_a_beam_do_not_depend_on_other_beams(self, world: PhysicsWorld) -> None:
        body = world.create_body("static", (0, 0, 0))
        body.create_edges([[EXACT, -1, EXACT, 1]])
        for noise in NOISES[1:]:
            ends = np.repeat([[LENGTH, 0.0]], 300, axis=0)
            every = finder(ends, noise, origin=(0, 0, 0)).scan(body, 5, 6).ranges
            for count in (1, 17, 100, 299):
                some = finder(ends[:count], noise, origin=(0, 0, 0)).scan(body, 5, 6).ranges
                np.testing.assert_array_equal(some, every[:count])


SCANS = f"""
import sys
sys.path[:0] = {[str(Path(__file__).parent), str(Path(__file__).parents[2] / "support")]!r}
import test_range_finder
print(*test_range_finder.digests())
"""


def digests() -> list[str]:
    """Returns a text for each of several scans."""
    import test_materials

    found = []
    for seed in range(4):
        jobs = requests(crowd(seed)[1])
        found.append(digest(scan_all(jobs)))
        found.append(digest([job.finder.scan(job.body, job.stream, job.update) for job in jobs]))
    return [*found, test_materials.digest(*test_materials.clutter(3, test_materials.any_material))]


@pytest.mark.slow
def test_results_do_not_depend_on_the_instruction_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """This process uses the widest instructions that the processor has."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    expected = digests()
    for name in ("baseline", "avx2"):
        environment = {**os.environ, "FLATLAND_SIMD": name}
        run = [sys.executable, "-c", SCANS]
        assert run_program(run, env=environment, check=True).stdout.split() == expected, name
