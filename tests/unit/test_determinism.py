"""Determinism: two runs with the same seed have identical results."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from programs import run_program

# Drives both robots of the office into the furniture, with noise, and prints a digest of the values
# of all outputs, transforms, poses and contacts, and of hashes of the state. The third argument is
# the number of other threads that cast rays in the same world during the run. With a fourth
# argument, the run uses one core.
RUN = """
import dataclasses, hashlib, math, os, sys, threading
import numpy as np
import flatland

world_path, seed, threads = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
if len(sys.argv) > 4:
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
digest = hashlib.sha256()

def add(value):
    if isinstance(value, np.ndarray):
        digest.update(value.tobytes())
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            add(getattr(value, field.name))
    elif isinstance(value, (list, tuple)):
        for item in value:
            add(item)
    else:
        digest.update(repr(value).encode())

world = flatland.World.from_yaml(world_path, seed=seed)
for number in range(6):
    world.spawn_model("box.model.yaml", f"box_{number}", pose=(3.0 + 0.4 * number, -5.0, number))
counts = {}
for topic in ("/scan", "/odometry/filtered", "/odometry/ground_truth", "/tricycle/scan"):
    def take(value, topic=topic):
        counts[topic] = counts.get(topic, 0) + 1
        add(value)
    world.output(topic).subscribe(take)
world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0, angular_z=0.2))
world.command("/tricycle/cmd_vel").set(flatland.Twist(linear_x=-1.0, angular_z=0.3))

stop = threading.Event()
def disturb():
    angles = np.linspace(-math.pi, math.pi, 700)
    ends = 10 * np.stack([np.cos(angles), np.sin(angles)], 1).astype(np.float32)
    while not stop.wait(0.0002):
        world.physics.cast_rays((3.0, -4.0, 0.1), ends, 0xFFFF)
others = [threading.Thread(target=disturb) for _ in range(threads)]
for other in others:
    other.start()
for number in range(200):
    world.step()
    add([(contact.points, contact.normal) for contact in world.contacts])
    if number % 20 == 0:
        add(world.state_hash())
stop.set()
for other in others:
    other.join()
add([body.pose for model in world.models for body in model.bodies])
add(sorted(world.transforms.items()))
assert len(counts) == 4 and min(counts.values()) > 5, counts
print(digest.hexdigest())
"""


def run(checkout: Path, seed: int, *options: str, hash_seed: int = 0) -> str:
    world = checkout / "worlds" / "office" / "world.yaml"
    result = run_program(
        [sys.executable, "-c", RUN, str(world), str(seed), *(options or ["0"])],
        env={**os.environ, "PYTHONHASHSEED": str(hash_seed)},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


@pytest.fixture(scope="module")
def digest(checkout: Path) -> str:
    """Digest of a run with seed 3."""
    return run(checkout, 3)


def test_a_run_on_one_core_has_identical_results(checkout: Path, digest: str) -> None:
    assert run(checkout, 3, "0", "one core", hash_seed=7) == digest


@pytest.mark.threads
def test_results_are_independent_of_scans_in_other_threads(checkout: Path, digest: str) -> None:
    assert run(checkout, 3, "3") == digest
