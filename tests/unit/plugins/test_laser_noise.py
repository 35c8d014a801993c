"""The noise models of the laser, compared with their closed-form distributions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import flatland

BEAMS = 50_001
LINE = "{min: 0, max: 0.0005, increment: 1.0e-8}"  # BEAMS beams that all point ahead
EXACT = 6.0  # m; distance of the wall ahead
RANGE = 20.0  # m
# Kolmogorov-Smirnov: the statistic of n correct samples is above 1.95 / sqrt(n) with p = 0.001.
LIMIT = 1.95

Distribution = Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]]


def laser(extra: str, angle: str = LINE) -> str:
    return f"- {{type: Laser, name: eye, body: base, range: {RANGE}, angle: {angle}, {extra}}}"


class Eye:
    """Loads a robot with a laser whose beams all hit a wall, or hit nothing."""

    def __init__(self, plugin_world: Any) -> None:
        self._load = plugin_world

    def world(self, extra: str, seed: int = 1, angle: str = LINE) -> flatland.World:
        files = self._load.files
        files.write("wall.dat", f"{EXACT} -1 {EXACT} 1")
        files.write("wall.yaml", "{type: line_segments, data: wall.dat, scale: 1, origin: [0,0,0]}")
        layers = "[{name: reflectance, map: wall.yaml}, {name: empty}]"
        return self._load(laser(extra, angle), layers=layers, seed=seed)  # type: ignore[no-any-return]

    def __call__(self, extra: str) -> Any:
        return self.world(extra).model("robot").plugin("eye")

    def ranges(self, extra: str) -> npt.NDArray[np.float64]:
        ranges = self(extra).compute_ranges()
        assert ranges.shape == (BEAMS,)
        assert ranges.dtype == np.float32
        return ranges.astype(np.float64)  # type: ignore[no-any-return]


@pytest.fixture
def eye(plugin_world: Any) -> Eye:
    return Eye(plugin_world)


def normal(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Cumulative standard normal distribution."""
    return np.array([0.5 * math.erfc(-value / math.sqrt(2)) for value in x])


def truncated_normal(mean: float, sigma: float) -> Distribution:
    """The normal distribution between 0 and the maximum range, equation 6.4."""
    low, high = normal(np.array([-mean / sigma, (RANGE - mean) / sigma]))
    return lambda x: np.clip((normal((x - mean) / sigma) - low) / (high - low), 0, 1)


def truncated_exponential(rate: float, limit: float) -> Distribution:
    """The exponential distribution between 0 and a limit, equation 6.7."""
    return lambda x: np.clip(
        (1 - np.exp(-rate * np.clip(x, 0, limit))) / (1 - math.exp(-rate * limit)), 0, 1
    )


def uniform(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The uniform distribution between 0 and the maximum range, equation 6.12."""
    return np.clip(x / RANGE, 0, 1)


def deviation_of(samples: npt.NDArray[np.float64], distribution: Distribution) -> float:
    """Returns the Kolmogorov-Smirnov statistic, multiplied by the root of the sample size."""
    n = len(samples)
    expected = distribution(np.sort(samples))
    steps = np.arange(n + 1) / n
    largest = max(np.abs(expected - steps[1:]).max(), np.abs(expected - steps[:-1]).max())
    return float(largest * math.sqrt(n))


def assert_exact(ranges: npt.NDArray[np.float64]) -> None:
    np.testing.assert_allclose(ranges, EXACT, atol=1e-4)


SHORT = "noise_model: beam, z_short: 1, lambda_short"


@pytest.mark.parametrize(
    ("extra", "distribution"),
    [
        ("noise_model: additive, noise_std_dev: 0.2", lambda x: normal((x - EXACT) / 0.2)),
        # The deviation is a share of the range.
        (
            "noise_model: proportional, noise_std_dev: 0.02",
            lambda x: normal((x - EXACT) / (0.02 * EXACT)),
        ),
        # Hits are normal within the range of the sensor.
        *(
            (f"noise_model: beam, sigma_hit: {sigma}", truncated_normal(EXACT, sigma))
            for sigma in (0.05, 3.0, 15.0)
        ),
        # Short readings are exponential up to the hit, or to the range.
        *((f"{SHORT}: {rate}", truncated_exponential(rate, EXACT)) for rate in (0.01, 0.5, 10.0)),
        (f"{SHORT}: 0.1, layers: [empty]", truncated_exponential(0.1, RANGE)),
        ("noise_model: beam, z_rand: 1", uniform),
        ("noise_model: beam, z_rand: 1, layers: [empty]", uniform),
    ],
)
def test_distributions(eye: Eye, extra: str, distribution: Distribution) -> None:
    ranges = eye.ranges(extra)
    assert deviation_of(ranges, distribution) < LIMIT
    if "beam" in extra:
        assert ranges.min() >= 0
        assert ranges.max() <= RANGE


class TestGaussian:
    def test_additive_is_the_default(self, eye: Eye) -> None:
        default = eye.ranges("noise_std_dev: 0.2")
        assert (default == eye.ranges("noise_model: additive, noise_std_dev: 0.2")).all()

    @pytest.mark.parametrize("model", ["additive", "proportional"])
    def test_misses_have_no_noise(self, eye: Eye, model: str) -> None:
        extra = f"noise_model: {model}, noise_std_dev: 0.2, layers: [empty], no_hit: range"
        assert (eye.ranges(extra) == RANGE).all()

    @pytest.mark.parametrize("model", ["additive", "proportional"])
    def test_no_model_is_active_without_a_deviation(self, eye: Eye, model: str) -> None:
        assert_exact(eye.ranges(f"noise_model: {model}"))


class TestBeamModel:
    def test_hits_are_exact_without_sigma(self, eye: Eye) -> None:
        assert_exact(eye.ranges("noise_model: beam"))

    @pytest.mark.parametrize(
        ("no_hit", "value"), [("nan", math.nan), ("inf", math.inf), ("range", RANGE)]
    )
    def test_missed_readings_are_reported_as_misses(
        self, eye: Eye, no_hit: str, value: float
    ) -> None:
        ranges = eye.ranges(f"noise_model: beam, z_max: 1, no_hit: {no_hit}")
        np.testing.assert_array_equal(ranges, np.full(BEAMS, value))

    def test_hits_of_beams_without_a_hit_are_misses(self, eye: Eye) -> None:
        ranges = eye.ranges("noise_model: beam, sigma_hit: 0.5, layers: [empty]")
        assert np.isnan(ranges).all()

    def test_a_mixture_has_the_shares_of_its_parts(self, eye: Eye) -> None:
        shares = "z_hit: 0.7, z_short: 0.1, z_max: 0.05, z_rand: 0.15"
        ranges = eye.ranges(f"noise_model: beam, {shares}, sigma_hit: 0.1, lambda_short: 0.4")
        is_miss = np.isnan(ranges)
        # Five standard deviations of the binomial distribution.
        assert is_miss.mean() == pytest.approx(0.05, abs=5 * math.sqrt(0.05 * 0.95 / BEAMS))
        hit, short = truncated_normal(EXACT, 0.1), truncated_exponential(0.4, EXACT)

        def expected(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
            return (0.7 * hit(x) + 0.1 * short(x) + 0.15 * uniform(x)) / 0.95

        assert deviation_of(ranges[~is_miss], expected) < LIMIT

    def test_the_share_of_hits_is_what_the_others_leave(self, eye: Eye) -> None:
        ranges = eye.ranges("noise_model: beam, z_max: 0.25")
        assert np.isnan(ranges).mean() == pytest.approx(0.25, abs=0.01)
        assert_exact(ranges[~np.isnan(ranges)])

    def test_readings_other_than_hits_have_no_intensity(self, eye: Eye) -> None:
        plugin = eye("noise_model: beam, z_max: 0.25")
        is_miss = np.isnan(plugin.compute_ranges())
        assert (plugin.intensities[is_miss] == 0).all()
        assert (plugin.intensities[~is_miss] == 255).all()


MIXTURE = "z_short: 0.2, z_max: 0.1, z_rand: 0.2, sigma_hit: 4, lambda_short: 0.4"


@pytest.mark.parametrize(
    "model", ["noise_model: proportional, noise_std_dev: 0.1", f"noise_model: beam, {MIXTURE}"]
)
def test_scans_do_not_depend_on_when_a_subscriber_connects(eye: Eye, model: str) -> None:
    def scans(first: int) -> list[bytes]:
        """Scans of steps `first` to 4, with a subscriber that connects before step `first`."""
        world = eye.world(model, 3, "{min: -0.1, max: 0.1, increment: 0.002}")
        output = world.ports.find_output("/scan")
        world.step(first)
        found: list[bytes] = []
        output.subscribe(lambda scan: found.append(scan.ranges.tobytes()))
        world.step(5 - first)
        return found

    assert scans(2) == scans(0)[2:]


def test_shares_may_differ_from_1_by_rounding(eye: Eye) -> None:
    ranges = eye.ranges("noise_model: beam, z_hit: 0.3333333, z_max: 0.3333333, z_rand: 0.3333333")
    assert np.isnan(ranges).mean() == pytest.approx(1 / 3, abs=0.01)


@pytest.mark.parametrize("model", ["additive", "proportional"])
@pytest.mark.parametrize("shortest", [0.0, 1.5])
def test_noise_beyond_the_limits_is_kept_clamped_or_dropped(
    eye: Eye, model: str, shortest: float
) -> None:
    deviation = 8.0 if model == "additive" else 1.0
    options = f"noise_model: {model}, noise_std_dev: {deviation}, no_hit: inf"
    kept = eye.ranges(options)
    limits = f"{options}, range_min: {shortest}, out_of_range:"
    assert kept.min() < 0
    assert model == "proportional" or kept.max() > RANGE
    np.testing.assert_array_equal(eye.ranges(f"{options}, out_of_range: keep"), kept)
    np.testing.assert_array_equal(eye.ranges(f"{limits} clamp"), np.clip(kept, shortest, RANGE))
    dropped = np.where(kept > RANGE, np.inf, np.where(kept < shortest, -np.inf, kept))
    np.testing.assert_array_equal(eye.ranges(f"{limits} drop"), dropped)


def test_a_hit_that_is_too_close_is_not_raised_to_the_limit(eye: Eye) -> None:
    options = "noise_std_dev: 0.5, range_min: 7"
    kept = eye.ranges(options)
    assert np.isneginf(kept).any()
    for choice in ("clamp", "drop"):
        np.testing.assert_array_equal(eye.ranges(f"{options}, out_of_range: {choice}"), kept)


@pytest.mark.parametrize("kind", ["Sonar", "SemanticScan"])
def test_other_range_sensors_have_the_limits_as_well(plugin_world: Any, kind: str) -> None:
    more = "field_of_view: 0" if kind == "Sonar" else "angle: {min: 0, max: 0.1, increment: 0.01}"
    files = plugin_world.files
    files.write("wall.dat", "1 -9 1 9")
    files.write("wall.yaml", "{type: line_segments, data: wall.dat, scale: 1, origin: [0, 0, 0]}")
    world = plugin_world(
        f"- {{type: {kind}, name: eye, body: base, range: 2, noise_std_dev: 3, {more}, "
        "out_of_range: clamp, topic: out, layers: [walls]}",
        layers="[{name: walls, map: wall.yaml}, {name: other}]",
        seed=1,
    )
    output = world.output("/out")
    ranges: list[float] = []
    for _ in range(40):
        world.step()
        ranges += np.ravel(
            output.latest.range if kind == "Sonar" else output.latest.ranges
        ).tolist()
    assert {min(ranges), max(ranges)} == {0.0, 2.0}
