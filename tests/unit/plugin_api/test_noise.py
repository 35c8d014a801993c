"""Streams of random numbers for the noise of sensors."""

from __future__ import annotations

import numpy as np
import pytest

from flatland.plugin_api.noise import GaussianNoise, NoiseStream


def draws(stream: NoiseStream, updates: int, drawn: set[int]) -> dict[int, list[float]]:
    """Advances a stream and draws three numbers in some of the updates."""
    found = {}
    for update in range(1, updates + 1):
        stream.begin_update()
        if update in drawn:
            found[update] = stream.rng.normal(size=3).tolist()
    return found


def test_numbers_of_an_update_do_not_depend_on_draws_of_others() -> None:
    every = draws(NoiseStream([1, 2]), 10, set(range(1, 11)))
    some = draws(NoiseStream([1, 2]), 10, {3, 9})
    assert some == {3: every[3], 9: every[9]}
    assert len({tuple(numbers) for numbers in every.values()}) == 10


def test_draws_of_one_update_continue_and_leave_nothing_for_the_next_one() -> None:
    stream, other = NoiseStream([5]), NoiseStream([5])
    stream.begin_update()
    other.begin_update()
    first, second = stream.rng.normal(), stream.rng.normal()
    assert [first, second] == other.rng.normal(size=2).tolist()
    # Half of a 64-bit number remains in the buffer of the generator after an odd number of draws.
    stream.rng.standard_normal(3, dtype=np.float32)
    stream.begin_update()
    other.begin_update()
    found, expected = (each.rng.standard_normal(3, dtype=np.float32) for each in (stream, other))
    assert found.tolist() == expected.tolist()


@pytest.mark.parametrize("entropy", [[1, 3], [2, 2], [1], [1, 2, 1]])
def test_streams_with_different_entropy_differ(entropy: list[int]) -> None:
    assert draws(NoiseStream(entropy), 1, {1}) != draws(NoiseStream([1, 2]), 1, {1})


def test_gaussian_noise_has_the_requested_variances() -> None:
    noise = GaussianNoise(NoiseStream([8]), (4.0, 0.0, 0.01))
    samples = []
    for _ in range(4000):
        noise.begin_update()
        samples.append([noise.sample(index) for index in range(3)])
    variances = np.var(samples, axis=0)
    # The standard error of a variance s is s * sqrt(2 / n): 2.2 % for 4000 samples.
    assert variances[0] == pytest.approx(4.0, rel=0.1)
    assert variances[1] == 0.0
    assert variances[2] == pytest.approx(0.01, rel=0.1)
    assert abs(np.corrcoef([row[0] for row in samples], [row[2] for row in samples])[0, 1]) < 0.06


def test_gaussian_noise_is_false_without_variances() -> None:
    assert not GaussianNoise(NoiseStream([1]), (0.0, 0.0))
    assert GaussianNoise(NoiseStream([1]), (0.0, 0.1))
