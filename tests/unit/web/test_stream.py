"""What clients receive of a world."""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ranging_plugins import Cone, Fan
from raw_web_client import RawWebClient
from waiting import wait_until

from flatland.values import Twist
from flatland.web.capture import WorldCapture


@pytest.fixture
def captured(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times of all captures of worlds [s]."""
    times: list[float] = []
    take = WorldCapture.take

    def record(self: WorldCapture, demand: Any) -> Any:
        times.append(time.monotonic())
        return take(self, demand)

    monkeypatch.setattr(WorldCapture, "take", record)
    return times


def wanted(world: Any) -> set[str]:
    """Returns the topics of the outputs that are computed."""
    return {topic for topic, output in world.ports.outputs.items() if output.wanted}


class TestStart:
    def test_hello_lists_the_worlds_and_nothing_follows_without_look(self, url):
        with RawWebClient(url, look=False) as client:
            hello = client.wait("hello")
            assert hello["version"] == 1
            assert hello["worlds"] == [{"world": 0, "name": "room"}]
            assert client.receive_for(0.3) == []

    def test_the_world_its_edges_and_its_models(self, url, world):
        with RawWebClient(url) as client:
            message = client.wait("world")
            edges = client.wait(1)
            models = client.wait("models")
            assert message["layers"] == [{"name": "walls", "color": [1, 0, 0, 1], "edges": 8}]
            assert message["bounds"] == [0, 0, 10, 10]
            assert message["step_size"] == 0.005
            layer, segments = edges.edges()
            assert layer == 0
            np.testing.assert_array_equal(segments, world.layers[0].world_edges)
            assert models["complete"]
            (robot,) = models["models"]
            assert (robot["name"], robot["namespace"]) == ("robot", "")
            assert [body["name"] for body in robot["bodies"]] == ["base", "arm"]
            circle, polygon = robot["bodies"][0]["shapes"]
            shape = {"kind": "circle", "center": [0, 0], "radius": 0.5}
            assert circle == {**shape, "layers": ["walls"], "sensor": False}
            assert polygon["kind"] == "polygon"
            assert len(polygon["points"]) == 3
            assert polygon["sensor"]
            base, arm = (body["id"] for body in robot["bodies"])
            (joint,) = robot["joints"]
            assert joint["bodies"] == [base, arm]
            np.testing.assert_allclose(joint["anchors"], [[0.1, 0], [0, 0]], atol=1e-6)
            (laser,) = robot["lasers"]
            assert (laser["topic"], laser["body"], laser["count"]) == ("/scan", base, 5)
            assert (laser["angle_min"], laser["angle_increment"]) == (-1, 0.5)
            assert robot["commands"] == ["/cmd_vel"]
            assert {"/odometry/filtered", "/scan"} <= set(robot["outputs"])
            assert client.wait("status")["world"] == 0

    def test_many_models_are_described_over_several_steps(self, files, world, viewer, monkeypatch):
        monkeypatch.setattr("flatland.web.model_tracker._TIME_LIMIT", 0.0)  # one model at a time
        for number in range(5):
            world.spawn_model("box.model.yaml", f"box{number}", pose=(2 + number, 2, 0))
        viewer.add_world(world)
        with RawWebClient(viewer.url) as client:
            client.wait_model("box4")
            messages = [m for m in client.received if isinstance(m, dict) and m["type"] == "models"]
            names = [[model["name"] for model in message["models"]] for message in messages]
            assert names == [["robot"], *([f"box{number}"] for number in range(5))]
            assert [message["complete"] for message in messages] == [True] + 5 * [False]

    @pytest.mark.parametrize(
        ("path", "name"),
        [
            ("arena/world.yaml", "arena"),
            ("arena/maze.yaml", "maze"),
            ("world.yaml", None),
            ("", "world"),
        ],
    )
    def test_a_world_has_the_name_of_its_file_or_folder(self, files, world, viewer, path, name):
        world.source.path = path and str(files.folder / path)
        viewer.add_world(world)
        with RawWebClient(viewer.url, look=False) as client:
            (shown,) = client.wait("hello")["worlds"]
            assert shown["name"] == (name or files.folder.name)


class TestPoses:
    def test_poses_follow_the_bodies(self, client, world):
        robot = client.model("robot")
        base, arm = (body["id"] for body in robot["bodies"])
        first = client.wait(2).poses()
        assert set(first) == {base, arm}
        np.testing.assert_allclose(first[base], [3, 5, 0], atol=1e-3)
        world.command("/cmd_vel").set(Twist(1.0))
        moved = client.wait(2, lambda message: message.poses().get(base, first[base])[0] > 3.3)
        assert moved.time > 0
        np.testing.assert_allclose(moved.poses()[arm][0] - moved.poses()[base][0], 0.1, atol=0.01)

    def test_only_bodies_that_moved_are_sent(self, client, world):
        world.pause()
        world.spawn_model("box.model.yaml", "box", pose=(6, 6, 0))
        box = client.wait_model("box")["bodies"][0]["id"]
        client.wait(2, lambda message: box in message.poses())
        client.wait("status", lambda message: message["paused"])
        client.receive_until("status")
        assert [m for m in client.receive_until("status") if not isinstance(m, dict)] == []
        world.move_model("box", (6, 7, 0.5))
        poses = client.wait(2).poses()
        assert set(poses) == {box}
        np.testing.assert_allclose(poses[box], [6, 7, 0.5], atol=1e-6)

    def test_at_most_thirty_messages_per_second(self, captured, client):
        wait_until("twenty captures", lambda: len(captured) > 20)
        # The server waits at least this long, on any machine; the first capture may be late.
        assert captured[20] - captured[0] > 0.5 * 20 / 30


class TestScans:
    def test_scans_arrive_if_they_are_wanted(self, client, world):
        assert wanted(world) == set()
        client.ask("look", scans=True)
        laser = client.model("robot")["lasers"][0]["id"]
        pose, ranges = client.wait(3).scans()[laser]
        np.testing.assert_allclose(pose, [3.2, 5, 0], atol=1e-4)
        expected = [world.models[0].plugin("eye").cast_without_noise()[1]]
        np.testing.assert_array_equal(ranges, expected[0])
        client.ask("look", scans=False)
        wait_until("the scans are not computed", lambda: wanted(world) == set())

    def test_compact_scans_arrive_beside_exact_ones(self, url, world):
        with RawWebClient(url) as client, RawWebClient(url) as exact:
            client.wait("models")
            laser = client.model("robot")["lasers"][0]
            resolution = laser["range_max"] / 65534
            exact.ask("look", scans=True)
            client.ask("look", scans=True, compact_scans=True)
            _, ranges = exact.wait(3).scans()[laser["id"]]
            # The robot is at rest, and the laser has no noise.
            pose, codes = client.wait(5).scans()[laser["id"]]
            np.testing.assert_allclose(pose, [3.2, 5, 0], atol=1e-4)
            hits = ranges < np.float32(laser["range_max"])
            assert hits.any()
            np.testing.assert_allclose(codes[hits], ranges[hits], atol=resolution)
            assert np.isnan(codes[~hits]).all()
            client.ask("look", compact_scans=False)
            assert laser["id"] in client.wait(3).scans()

    def test_a_second_client_gets_the_poses_and_scans_of_a_paused_world(self, client, url, world):
        client.ask("look", scans=True)
        client.wait(3)
        world.pause()
        client.wait("status", lambda message: message["paused"])
        with RawWebClient(url) as other:
            robot = other.wait_model("robot")
            assert set(other.wait(2).poses()) == {body["id"] for body in robot["bodies"]}
            other.ask("look", scans=True)
            assert other.wait(3).scans()
        # The captures before the pause have been sent with the next status at the latest.
        client.receive_until("status")
        assert not [m for m in client.receive_until("status") if getattr(m, "kind", 0) == 3]


class TestChanges:
    def test_a_model_that_replaces_another_one_has_a_new_id(self, client, world):
        robot = client.model("robot")

        def replace() -> None:
            world.delete_model("robot")
            world.spawn_model("robot.model.yaml", "robot", pose=(5, 5, 0))

        world.between_steps(replace)
        message = client.wait("models")
        assert message["removed"] == [robot["id"]]
        ids = {model["id"] for model in message["models"]}
        assert ids.isdisjoint({robot["id"]})
        assert len(ids) == 1

    def test_a_changed_colour_is_sent(self, client, world):
        robot = client.model("robot")
        world.models[0].bodies[0].color = (1.0, 1.0, 0.0, 1.0)
        message = client.wait("models")
        assert message["models"][0]["bodies"][0]["color"] == [1, 1, 0, 1]
        assert message["models"][0]["id"] == robot["id"]

    def test_a_changed_appearance_is_sent(self, client, world):
        robot = client.model("robot")
        [shape, *_] = robot["bodies"][0]["shapes"]
        assert shape["layers"] == ["walls"]
        world.between_steps(lambda: world.set_appearance("robot", visible=False))
        [hidden] = client.wait("models")["models"]
        assert (hidden["id"], hidden["bodies"][0]["shapes"]) == (robot["id"], [])
        world.between_steps(lambda: world.set_appearance("robot", visible=True))
        assert client.wait("models")["models"] == [robot]
        # New layers alone are found, too.
        world.between_steps(lambda: world.set_appearance("robot", layers="all"))
        assert client.wait("models")["models"] == [robot]

    def test_new_edges_of_a_layer_are_sent(self, client, world):
        edges = np.array([[1, 1, 2, 2]], np.float32)

        def add() -> None:
            world.layers[0].add_edges(edges)
            world.layer_changed(world.layers[0])

        world.between_steps(add)
        assert client.wait("world")["layers"][0]["edges"] == 9
        np.testing.assert_array_equal(client.wait(1).edges()[1][-1], [1, 1, 2, 2])

    def test_a_reset_is_followed(self, client, world):
        robot = client.model("robot")
        base = robot["bodies"][0]["id"]
        world.move_model("robot", (7, 7, 0))
        client.wait(2, lambda m: base in m.poses() and m.poses()[base][0] > 6.9)
        world.between_steps(world.reset)
        client.wait(2, lambda m: any(abs(pose[0] - 3) < 0.01 for pose in m.poses().values()))


class TestStatus:
    def test_the_real_time_factor_and_the_rate(self, client, simulation):
        status = client.wait("status", lambda m: m["real_time_factor"] > 0.5)
        assert status["rate"] == 200
        assert not status["paused"]
        simulation.post(lambda: simulation.set_rate(math.inf)).result(30)
        client.wait("status", lambda m: m["rate"] == 0)

    def test_a_simulator_that_does_not_answer_is_reported(self, client, world):
        release = threading.Event()
        blocked = world.post(lambda: release.wait(60))
        client.wait("status", lambda message: message["stale"] > 0.5)
        release.set()
        blocked.result(60)
        client.wait("status", lambda message: message["stale"] == 0)


class TestNobodyLooks:
    def test_nothing_is_computed(self, url, world, captured):
        def assert_nothing_is_captured() -> None:
            wait_until("the scans are not computed", lambda: wanted(world) == set())
            captured.clear()
            before = world.time
            wait_until("the world goes on", lambda: world.time > before + 0.2)
            assert not captured

        assert not world._observers.watch_steps
        with RawWebClient(url) as client:
            client.ask("look", scans=True)
            client.wait(3)
            assert captured
            client.ask("look", hidden=True)
            assert_nothing_is_captured()
            client.ask("look", hidden=False)
            client.wait(3)
        assert_nothing_is_captured()
        assert not world._observers.watch_steps


class TestWorlds:
    def test_a_closed_world_is_gone_and_replaced_by_the_next_one(self, files, world, viewer):
        viewer.add_world(world, "first")
        with RawWebClient(viewer.url) as client:
            robot = client.wait_model("robot")
            world.close()
            assert client.wait("gone")["world"] == 0
            assert not client.reply("pause")["ok"]
            client.received.clear()
            other = files.load((files.folder / "world.yaml").read_text())
            viewer.add_world(other, "second")
            assert client.wait("hello")["worlds"] == [{"world": 0, "name": "second"}]
            client.wait("world")
            assert client.wait_model("robot")["id"] > robot["id"]
            client.wait(2)

    def test_several_worlds_are_shown_at_once(self, files, world, viewer):
        text = (files.folder / "world.yaml").read_text()
        worlds = [world, files.load(text), files.load(text)]
        handles = [viewer.add_world(each, f"w{n}") for n, each in enumerate(worlds)]
        with RawWebClient(viewer.url, look=False) as client:
            assert [each["name"] for each in client.wait("hello")["worlds"]] == ["w0", "w1", "w2"]
            client.ask("look", worlds=[0, 2])
            seen = {client.wait("models")["world"] for _ in range(2)}
            assert seen == {0, 2}
            worlds[2].move_model("robot", (6, 6, 0))
            client.wait(2, lambda m: m.world == 2 and any(p[0] > 5.9 for p in m.poses().values()))
            viewer.remove_world(handles[0])
            assert client.wait("gone")["world"] == 0
            viewer.add_world(world, "again")
            assert client.wait("world")["name"] == "again"

    def test_a_closed_world_cannot_be_added(self, world, viewer):
        world.close()
        with pytest.raises(Exception, match="the world is closed"):
            viewer.add_world(world)


class TestSlowClient:
    def test_a_client_that_does_not_read_delays_nobody(self, url, world, viewer):
        world.command("/cmd_vel").set(Twist(0.0, 0.0, 2.0))
        with RawWebClient(url) as slow, RawWebClient(url) as client:
            slow.ask("look", scans=True)
            steps = world.time
            client.wait(2, lambda message: message.time > steps + 0.5)
            # The slow one continues with the newest state.
            slow.wait(2, lambda message: message.time > steps + 0.5)


def test_captures_do_not_change_the_simulation(files, world, viewer):
    text = (files.folder / "world.yaml").read_text()
    other = files.load(text)
    viewer.add_world(world)
    with RawWebClient(viewer.url) as client:
        robot = client.wait_model("robot")
        client.ask("look", scans=True, frames=True, inspect=robot["id"], series=["/scan/ranges/0"])
        for _ in range(20):
            client.receive_for(0.01)
            world.step(10)
        other.step(200)
        assert world.state_hash() == other.state_hash()


def test_a_step_is_not_held_up_by_the_viewer(client, simulation, world, viewer):
    """While the thread of the server is blocked, the simulation goes on."""
    release = threading.Event()
    viewer._call(lambda: release.wait(60))
    try:
        start = world.time
        wait_until("the world goes on", lambda: world.time > start + 0.5)
    finally:
        release.set()
    client.wait("status", lambda message: message["time"] > start + 0.4)


class TestOtherSensors:
    def test_an_upside_down_laser_turns_the_other_way(self, files, world, viewer):
        files.write(
            "robot.model.yaml",
            "bodies: [{name: b, footprints: []}]\n"
            "plugins: [{type: Laser, name: l, body: b, range: 20, upside_down: true,\n"
            "  angle: {min: 0, max: 1, increment: 0.5}}]",
        )
        viewer.add_world(files.load(Path(world.path).read_text()))
        with RawWebClient(viewer.url) as client:
            (laser,) = client.wait_model("robot")["lasers"]
            assert (laser["angle_min"], laser["angle_increment"]) == (0, -0.5)

    def test_plugins_with_similar_values_are_shown(self, files, world, viewer, declare_plugins):
        declare_plugins(Fan, Cone)
        files.write(
            "robot.model.yaml",
            "bodies: [{name: b, footprints: []}]\n"
            "plugins: [{type: test::Fan, name: fan}, {type: test::Cone, name: cone}]",
        )
        world = files.load(Path(world.path).read_text())
        viewer.add_world(world)
        with RawWebClient(viewer.url) as client:
            fan, cone = client.wait_model("robot")["lasers"]
            assert (fan["name"], fan["count"], fan["range_max"]) == ("fan", 3, 8)
            assert (cone["angle_min"], cone["angle_increment"]) == (-0.4, 0.1)
            client.ask("look", scans=True)
            wait_until("the outputs are wanted", lambda: len(wanted(world)) == 2)
            world.step()
            scans = client.wait(3).scans()
            pose, ranges = scans[fan["id"]]
            np.testing.assert_allclose(pose, [4, 5, 0], atol=1e-6)
            np.testing.assert_array_equal(ranges, [1, 2, np.inf])
            np.testing.assert_array_equal(scans[cone["id"]][1], [3] * 9)
