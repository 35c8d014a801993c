"""Messages for clients that receive all captures of a world, or only some."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from raw_web_client import Decoder

from flatland.values import Twist
from flatland.web.capture import WorldCapture
from flatland.web.contents import WorldContents
from flatland.web.controller import controller_of
from flatland.web.latest_scans import LatestScans
from flatland.web.views import Demand, Received
from flatland.world import World

ROBOTS = "[{name: a, model: robot.model.yaml, pose: [3, 3, 0]}, {name: b, model: robot.model.yaml, "
ROBOTS += "namespace: b, pose: [7, 7, 2]}]"


class Client:
    """What one client knows."""

    def __init__(self, contents: WorldContents, scans: LatestScans) -> None:
        self._contents, self._scans = contents, scans
        self._received, self._decoder = Received(), Decoder()
        self.poses: dict[int, Any] = {}
        self.scans: dict[int, Any] = {}
        self.received: list[int] = []  # kinds of messages

    def receive(self) -> None:
        poses = self._contents.next_poses(self._received)
        scans = self._scans.next_message(self._received, self._contents.head)
        self.received = [data[0] for data in (poses, scans) if data is not None]
        if poses is not None:
            self.poses.update(self._decoder.decode(poses).poses())
        if scans is not None:
            self.scans.update(self._decoder.decode(scans).scans())


class Captures:
    """Captures a world for clients."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.capture = WorldCapture(world, controller_of(world, None), itertools.count(1))
        self.contents, self.scans = WorldContents(0, "room"), LatestScans()
        while len(self.capture.tracker.models) < len(world.models):
            # The time of each capture is limited.
            self.take()

    def take(self) -> None:
        captured = self.capture.take(Demand(scans=True))
        self.contents.apply(captured)
        self.scans.apply(captured.scans, self.contents.tick)

    def client(self) -> Client:
        return Client(self.contents, self.scans)

    def bodies(self, *models: str) -> dict[int, Any]:
        """Returns the pose of each body of some models by its id."""
        return {
            number: body.pose
            for known in self.capture.tracker.models.values()
            if known.model.name in models
            for number, body in zip(known.body_ids, known.bodies, strict=True)
        }


@pytest.fixture
def captures(world: World, files: Any) -> Captures:
    robots = files.load(
        f"properties: {{}}\nlayers: [{{name: walls, map: room.yaml}}]\nmodels: {ROBOTS}"
    )
    return Captures(robots)


def drive(captures: Captures, *topics: str) -> None:
    """Turns only the robots with these topics in the following steps."""
    for topic in ("/cmd_vel", "/b/cmd_vel"):
        captures.world.command(topic).set(Twist(0.2, 0, 0.5) if topic in topics else Twist())


def assert_poses(client: Client, expected: dict[int, Any]) -> None:
    assert set(expected) <= set(client.poses)
    for number, pose in expected.items():
        np.testing.assert_allclose(client.poses[number], pose, atol=1e-6)


@pytest.mark.parametrize("received", ["all", "some", "alternating"])
def test_poses_are_those_of_the_bodies_although_captures_are_missed(captures, received):
    client, selections = captures.client(), [("/cmd_vel",), ("/b/cmd_vel",), ("/cmd_vel",) * 2]
    receives: dict[str, Callable[[int], bool]] = {
        "all": lambda _: True,
        "some": lambda number: number % 5 != 1,
        "alternating": lambda number: number % 2 == 0,
    }
    kinds = set()
    for number in range(24):
        drive(captures, *selections[number // 4 % 3])
        captures.world.step(4)
        captures.take()
        if receives[received](number):
            client.receive()
            kinds |= set(client.received)
            assert_poses(client, captures.bodies("a", "b"))
    assert 2 in kinds
    assert (4 in kinds) == (received != "alternating")


def test_a_late_message_does_not_change_what_the_next_one_is_about(captures):
    first, late = captures.client(), captures.client()
    for number in range(6):
        # The late client misses the capture in which only `b` moves.
        drive(captures, "/b/cmd_vel" if number == 3 else "/cmd_vel")
        captures.world.step(4)
        captures.take()
        first.receive()
        if number != 3:
            late.receive()
        if number > 3:
            assert_poses(late, captures.bodies("a", "b"))
    assert late.poses.keys() == first.poses.keys()


def test_bodies_of_a_model_that_replaces_another_one_have_new_ids(captures):
    client, world = captures.client(), captures.world
    drive(captures, "/cmd_vel", "/b/cmd_vel")
    for _ in range(3):
        world.step(4)
        captures.take()
        client.receive()
    assert client.received[0] == 4
    world.delete_model("b")
    world.spawn_model("robot.model.yaml", "c", namespace="c", pose=(6, 3, 1))
    captures.take()
    client.receive()
    assert client.received[0] == 2
    assert_poses(client, captures.bodies("a", "c"))


@pytest.mark.parametrize("missed", [0, 1, 2, 3])
def test_a_late_client_receives_the_scans_that_are_new(captures, missed):
    client, late, world = captures.client(), captures.client(), captures.world
    drive(captures, "/cmd_vel", "/b/cmd_vel")
    lasers = [model.plugin("eye") for model in world.models]
    ids = {s.plugin: number for number, s in captures.capture.tracker.sensors.items()}
    scanned = [(0, 1), (0, 1), (0,), (0,)]
    for number, some in enumerate(scanned):
        world.step()
        for index in some:
            lasers[index].compute_ranges()
        captures.take()
        client.receive()
        if number < len(scanned) - 1 - missed:
            late.receive()
    late.scans.clear()
    late.receive()
    new = {index for some in scanned[len(scanned) - 1 - missed :] for index in some}
    assert set(late.scans) == {ids[lasers[index]] for index in new}
    for laser, number in ids.items():
        pose, ranges = laser.last_scan
        for scans in (client.scans, late.scans):
            if number in scans:
                np.testing.assert_allclose(scans[number][0], pose, atol=1e-6)
                np.testing.assert_array_equal(scans[number][1], ranges)
