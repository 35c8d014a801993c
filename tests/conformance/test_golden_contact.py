"""Comparison with a recorded trace in which a robot pushes a crate: poses and bumper messages."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland

POSE_TOLERANCE = 1e-3  # m and rad
FORCE_TOLERANCE = 0.05  # relative
POINT_TOLERANCE = 1e-3  # m, and for components of unit normals

Bodies = dict[str, list[float]]
Pair = tuple[str, str, str, str]


class Run:
    """Results of a run of the world of the trace, and the records of the trace."""

    def __init__(self, golden: Path) -> None:
        trace = json.loads((golden / "contact.trace.json").read_text())
        commands = defaultdict(list)
        for line in (golden / "contact.cmd").read_text().splitlines():
            step, model, _, v, omega = line.split()
            twist = flatland.Twist(linear_x=float(v), angular_z=float(omega))
            commands[int(step)].append((model, twist))
        self.records: list[dict[str, Any]] = trace["records"]
        recorded = {record["step"] for record in self.records}
        self.bodies: dict[int, Bodies] = {}
        self.messages: dict[int, flatland.Collisions | None] = {}
        with flatland.World.from_yaml(
            golden / "contact.yaml", seed=1, step_size=trace["dt"]
        ) as world:
            output = world.output("/p/collisions")
            for step in range(trace["steps"] + 1):
                if step in recorded:
                    self.bodies[step] = {
                        f"{model.name}/{body.name}": [*body.pose, *body.velocity]
                        for model in world.models
                        for body in model.bodies
                    }
                    self.messages[step] = output.latest
                for model, twist in commands[step]:
                    world.command(f"/{world.model(model).namespace}/cmd_vel").set(twist)
                world.step()

    def paired_messages(
        self,
    ) -> list[tuple[int, flatland.Collisions, list[dict[str, Any]]]]:
        """Returns step, message and contacts of the trace for each record with a message."""
        return [
            (record["step"], message, record["collisions"]["pusher1/bumper"])
            for record in self.records
            if (message := self.messages[record["step"]]) is not None
        ]


@pytest.fixture(scope="module")
def run(golden_dir: Path) -> Run:
    return Run(golden_dir)


def message_pairs(message: flatland.Collisions) -> list[Pair]:
    return sorted((c.entity_a, c.body_a, c.entity_b, c.body_b) for c in message.collisions)


def trace_pairs(contacts: list[dict[str, Any]]) -> list[Pair]:
    return sorted(("pusher1", c["body_A"], c["entity_B"], c["body_B"]) for c in contacts)


def test_poses_match_the_trace(run: Run) -> None:
    for record in run.records:
        for name, values in record["bodies"].items():
            pose = run.bodies[record["step"]][name]
            assert pose[:3] == pytest.approx(values[:3], abs=POSE_TOLERANCE), (
                f"{name} at step {record['step']}"
            )


def test_the_first_message_follows_the_first_step(run: Run) -> None:
    assert run.messages[0] is None
    assert run.records[0]["collisions"] == {}
    assert len(run.paired_messages()) == len(run.records) - 1


def test_contact_pairs_match_the_trace(run: Run) -> None:
    for step, message, contacts in run.paired_messages():
        assert message_pairs(message) == trace_pairs(contacts), f"step {step}"
    assert any(len(contacts) == 2 for _, _, contacts in run.paired_messages())


def test_stamps_are_the_time_after_the_step(run: Run) -> None:
    for step, message, _ in run.paired_messages():
        assert message.stamp == step * 5_000_000


def test_forces_positions_and_normals_match_the_trace(run: Run) -> None:
    compared = 0
    for step, message, contacts in run.paired_messages():
        # A pair of bodies has a contact of a sensor, without points, and one of a solid fixture.
        found = sorted(message.collisions, key=lambda c: len(c.magnitude_forces))
        golden = sorted(contacts, key=lambda c: len(c["forces"]))
        for actual, expected in zip(found, golden, strict=True):
            where = f"step {step}"
            forces = np.array(expected["forces"])
            assert actual.magnitude_forces.shape == forces.shape, where
            assert actual.magnitude_forces == pytest.approx(forces, rel=FORCE_TOLERANCE), where
            if len(forces):
                positions, normals = np.array(expected["positions"]), np.array(expected["normals"])
                assert actual.contact_positions == pytest.approx(positions, abs=POINT_TOLERANCE)
                assert actual.contact_normals == pytest.approx(normals, abs=POINT_TOLERANCE)
                compared += len(forces)
    assert compared > 10


def test_differences_are_much_smaller_than_the_tolerances(run: Run) -> None:
    # About twenty times the measured differences, to detect regressions before they exceed the
    # tolerances.
    pose = max(
        abs(actual - value)
        for record in run.records
        for name, values in record["bodies"].items()
        for actual, value in zip(run.bodies[record["step"]][name][:3], values[:3], strict=True)
    )
    force = max(
        abs(actual - expected) / expected
        for _, message, contacts in run.paired_messages()
        for actual, expected in zip(
            sorted(f for c in message.collisions for f in c.magnitude_forces),
            sorted(f for c in contacts for f in c["forces"]),
            strict=True,
        )
    )
    print(f"\ncontact: poses within {pose:.2g} m and rad, forces within {force:.2g} (relative)")
    assert pose < 5e-5
    assert force < 1e-3
