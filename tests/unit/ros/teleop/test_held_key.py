"""Keys of a terminal and the velocities that they cause, with a fake time."""

from __future__ import annotations

import pytest

from flatland.ros.teleop.held_key import HeldKey, decode


@pytest.fixture
def held() -> HeldKey:
    return HeldKey(1.0, 2.0, repeat_delay=0.6, key_timeout=0.2)


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        (b"w", ["w"]),
        (b"WaD", ["w", "a", "d"]),
        (b"\x1b[A\x1b[B\x1b[C\x1b[D", ["w", "s", "d", "a"]),
        (b"\x1bOA\x1bOD", ["w", "a"]),  # a terminal in application mode
        (b"\x1b[1;2A", ["w"]),  # with the shift key
        (b"\x1b[3~ \x1b[H+", [" ", "+"]),  # Delete and Home have no meaning
        ("ö€w".encode(), ["w"]),
        (b"\x1bx", ["x"]),
        (b"\x03", ["\x03"]),
        (b"", []),
    ],
)
def test_input_is_decoded(data: bytes, keys: list[str]) -> None:
    assert decode(data) == (keys, b"")


def test_a_split_sequence_is_completed_by_the_next_input() -> None:
    rest = b""
    keys = []
    for byte in b"w\x1b[A\x1b[1;5Dx\x1bOC":
        pressed, rest = decode(rest + bytes([byte]))
        keys += pressed
    assert (keys, rest) == (["w", "w", "a", "x", "d"], b"")


def test_an_endless_sequence_is_discarded() -> None:
    keys, rest = decode(b"\x1b[" + b"1" * 1000 + b"w")
    assert len(rest) < 20
    keys, rest = decode(b"\x1b[" + b"1" * 1000)
    assert rest == b""
    assert set(keys) <= {"[", "1"}


@pytest.mark.parametrize(
    ("key", "velocity"),
    [
        ("w", (0.5, 0.0)),
        ("s", (-0.5, 0.0)),
        ("a", (0.0, 1.0)),
        ("d", (0.0, -1.0)),
        ("q", (0.5, 1.0)),
        ("e", (0.5, -1.0)),
        ("z", (-0.5, -1.0)),
        ("c", (-0.5, 1.0)),
        ("k", (0.0, 0.0)),
    ],
)
def test_velocity_of_each_key(held: HeldKey, key: str, velocity: tuple[float, float]) -> None:
    held.press(key, 10.0)
    assert held.velocity(10.0) == velocity


def test_a_single_press_counts_until_the_first_repetition_is_due(held: HeldKey) -> None:
    assert held.velocity(9.0) == (0.0, 0.0)
    held.press("w", 10.0)
    assert held.velocity(10.59) == (0.5, 0.0)
    assert held.remaining(10.5) == pytest.approx(0.1)
    assert held.velocity(10.61) == (0.0, 0.0)


def test_a_held_key_counts_until_the_repetitions_end(held: HeldKey) -> None:
    times = [10.0, *(10.5 + 0.04 * repetition for repetition in range(50))]
    for now in times:
        held.press("w", now)
        assert held.velocity(now + 0.03) == (0.5, 0.0)
    assert held.velocity(times[-1] + 0.19) == (0.5, 0.0)
    assert held.velocity(times[-1] + 0.21) == (0.0, 0.0)


def test_the_last_of_two_held_keys_counts(held: HeldKey) -> None:
    held.press("w", 10.0)
    held.press("a", 10.1)
    assert held.velocity(10.2) == (0.0, 1.0)
    # A new key, the repetitions of which start after the delay.
    assert held.velocity(10.69) == (0.0, 1.0)


def test_the_space_key_stops_at_once(held: HeldKey) -> None:
    held.press("w", 10.0)
    held.press(" ", 10.1)
    assert held.velocity(10.1) == (0.0, 0.0)
    held.press("w", 10.2)
    assert held.velocity(10.7) == (0.5, 0.0)


def test_the_speed_stays_within_its_limits(held: HeldKey) -> None:
    scales = []
    for _ in range(7):
        held.press("+", 10.0)
        scales.append(held.scale)
    assert scales == [0.6, 0.7, 0.8, 0.9, 1.0, 1.0, 1.0]
    held.press("q", 10.0)
    assert held.velocity(10.0) == (1.0, 2.0)
    for _ in range(12):
        held.press("-", 10.1)
    assert held.velocity(10.1) == pytest.approx((0.1, 0.2))
