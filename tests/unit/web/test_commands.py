"""What clients do with a world."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from raw_web_client import RawWebClient
from waiting import wait_until

from flatland.runtime import file_reads
from flatland.simulation import Simulation
from flatland.web import WebViewer, commands


@pytest.fixture
def robot(client: RawWebClient) -> int:
    """Id of the robot."""
    return int(client.model("robot")["id"])


def velocity(world) -> float:
    return world.between_steps(lambda: world.models[0].bodies[0].velocity[0])


class TestTime:
    def test_pause_step_and_resume(self, client, world):
        client.ask("pause")
        assert world.paused
        before = world.time
        client.ask("step", n=7)
        assert round((world.time - before) / 0.005) == 7
        client.ask("step")
        assert round((world.time - before) / 0.005) == 8
        assert world.paused
        client.wait("status", lambda message: message["paused"] and message["time"] == world.time)
        client.ask("resume")
        wait_until("the world goes on", lambda: world.time > before + 0.1)

    def test_the_rate(self, client, simulation):
        client.ask("set_rate", rate=50)
        assert simulation.rate == 50
        client.ask("set_rate", rate=0)
        assert simulation.rate == float("inf")

    def test_a_world_without_a_simulation_has_no_rate_and_is_stepped(self, world, viewer):
        viewer.add_world(world)
        with RawWebClient(viewer.url) as client:
            reply = client.reply("set_rate", rate=50)
            assert "a program steps the world itself" in reply["error"]
            client.ask("pause")
            client.ask("step", n=20)
            assert world.time == 0.1
            assert world.paused

    def test_lockstep(self, world, viewer):
        simulation = Simulation(world, lockstep=True)
        thread = threading.Thread(target=simulation.run)
        thread.start()
        try:
            viewer.add_world(world, simulation=simulation)
            with RawWebClient(viewer.url) as client:
                assert client.wait("status")["lockstep"]
                client.ask("step", n=10)
                assert world.time == 0.05
                assert "lockstep" in client.reply("set_rate", rate=50)["error"]
        finally:
            simulation.stop()
            thread.join()

    def test_an_unknown_world_is_an_error(self, client):
        assert client.reply("pause", world=3)["error"] == "there is no world 3"


class TestModels:
    def test_spawn(self, client, world, files):
        place = {"pose": [6, 6, 1], "namespace": "b"}
        assert client.ask("spawn", file="box.model.yaml", name="box", **place) == {"name": "box"}
        np.testing.assert_allclose(world.model("box").pose, [6, 6, 1], atol=1e-6)
        box = client.wait_model("box")
        assert (box["namespace"], box["file"]) == ("b", str(files.folder / "box.model.yaml"))

    @pytest.mark.parametrize(
        ("fields", "error"),
        [
            ({"file": "nothing.yaml"}, "File does not exist"),
            ({"file": "world.yaml"}, '"bodies"'),
            ({"name": "robot"}, '"robot"'),
            ({"name": "a\nb"}, "its name must have at most"),
            ({"name": "../x"}, "its name must have at most"),
            ({"name": "x" * 1000}, "its name must have at most"),
            ({"namespace": "../x"}, "is not a legal ROS name"),
            ({"file": '{"bodies": []}'}, "the path of a model file is expected"),
        ],
    )
    def test_an_invalid_spawn_is_an_error_and_changes_nothing(self, client, world, fields, error):
        reply = client.reply(
            "spawn", **{"file": "box.model.yaml", "name": "box", "pose": [6, 6, 0], **fields}
        )
        assert not reply["ok"]
        assert error in reply["error"]
        assert [model.name for model in world.models] == ["robot"]

    def test_a_file_that_blocks_delays_only_its_request(
        self, client, world, files, block_file, monkeypatch: pytest.MonkeyPatch
    ):
        files.write("slow.model.yaml", "bodies: [{name: b, footprints: []}]")
        release = block_file("slow.model.yaml")
        spawn = client.send("spawn", file="slow.model.yaml", name="slow", pose=[6, 6, 0])
        client.ask("spawn", file="box.model.yaml", name="box", pose=[2, 2, 0])
        before = world.time
        wait_until("steps", lambda: world.time > before)
        assert [model.name for model in world.models] == ["robot", "box"]
        monkeypatch.setattr(file_reads, "TIME_LIMIT", 0.01)
        reply = client.reply("preview", file="slow.model.yaml")
        assert "the files were not read within 0.01 s" in reply["error"]
        release.set()
        assert client.wait("reply", lambda message: message["id"] == spawn)["ok"]

    def test_many_previews_wait_for_each_other(self, client, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(commands, "READING_SHARE", 1e-9)
        client.ask("preview", file="box.model.yaml")
        waiting = [client.send("preview", file="box.model.yaml"), client.send("files")]
        client.ask("pause")
        client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 0])
        replies = {m["id"] for m in client.received if isinstance(m, dict) and "id" in m}
        assert not replies & set(waiting)

    def test_a_read_only_viewer_previews_listed_files_only(self, files, world):
        outside = files.folder.parent / "outside.model.yaml"
        outside.write_text("bodies: [{name: b, footprints: []}]")
        with WebViewer(port=0, read_only=True) as viewer:
            viewer.add_world(world)
            with RawWebClient(viewer.url) as client:
                client.wait_model("robot")
                for file in (str(outside), "/no/such/file.yaml"):
                    error = client.reply("preview", file=file)["error"]
                    assert "a read-only viewer previews only the listed model files" in error
                box = client.ask("files")[0]
                assert client.reply("preview", file=box["path"])["ok"]

    def test_files_outside_the_allowed_folders_are_refused(self, files, world, viewer, tmp_path):
        inside = files.write("models/in.model.yaml", "bodies: [{name: b, footprints: []}]")
        world.source.inputs.folders = (str(files.folder / "models"),)
        viewer.add_world(world)
        with RawWebClient(viewer.url) as client:
            client.wait_model("robot")
            assert [file["path"] for file in client.ask("files")] == [inside]
            for kind, fields in (("preview", {}), ("spawn", {"name": "b", "pose": [1, 1, 0]})):
                assert not client.reply(kind, file="box.model.yaml", **fields)["ok"]
                assert client.reply(kind, file=inside, **fields)["ok"]

    def test_the_list_of_files(self, client, files):
        files.write("more/a.model.yaml", "bodies: [{name: b, footprints: []}]")
        files.write("more/.hidden/b.model.yaml", "bodies: [{name: b, footprints: []}]")
        files.write("more/other.yaml", "layers: []")
        assert [file["label"] for file in client.ask("files")] == [
            "box.model.yaml",
            "minimal.model.yaml",
            "more/a.model.yaml",
            "robot.model.yaml",
        ]

    def test_preview(self, client):
        base, arm = client.ask("preview", file="robot.model.yaml")["bodies"]
        assert base["color"] == [0, 1, 0, 0.5]
        assert [shape["kind"] for shape in base["shapes"]] == ["circle", "polygon"]
        np.testing.assert_allclose(arm["pose"], [0.1, 0, 0], atol=1e-6)
        assert not client.reply("preview", file="world.yaml")["ok"]

    def test_move(self, client, robot, world):
        assert client.ask("move", model=robot, pose=[6, 7, 0.5]) == {"overlap": ""}
        np.testing.assert_allclose(world.models[0].pose, [6, 7, 0.5], atol=1e-5)
        overlap = client.ask("move", model=robot, pose=[1.1, 7, 0])["overlap"]
        assert overlap.startswith('overlaps layer "walls" at (1.100, 7.000, ')

    def test_delete(self, client, robot, world):
        client.ask("delete", model=robot)
        assert world.models == []
        for kind, fields in (("delete", {}), ("move", {"pose": [1, 1, 0]}), ("hold", {})):
            reply = client.reply(kind, model=robot, **fields)
            assert "the model does not exist any more" in reply["error"]
        assert not world.paused

    def test_only_the_newest_move_waits_for_the_simulator(self, client, robot, world):
        release = threading.Event()
        moved = []
        blocked = world.post(lambda: release.wait(60))
        numbers = [client.send("move", model=robot, pose=[3 + n / 10, 5, 0]) for n in range(20)]
        client.wait("reply", lambda reply: reply["id"] == numbers[-2])  # superseded
        move = world.move_model
        world.move_model = lambda *a, **k: (moved.append(a[1]), move(*a, **k))[1]
        try:
            release.set()
            blocked.result(60)
            client.wait("reply", lambda reply: reply["id"] == numbers[-1])
        finally:
            del world.move_model
        assert [round(pose[0], 6) for pose in moved] == [3, 4.9]
        replies = [m for m in client.received if isinstance(m, dict) and m["type"] == "reply"]
        superseded = [reply["id"] for reply in replies if reply["result"] == {"superseded": True}]
        assert superseded == numbers[1:-1]


class TestHold:
    def test_the_world_is_paused_while_a_model_is_held(self, client, robot, world):
        client.ask("hold", model=robot)
        assert world.paused
        client.ask("move", model=robot, pose=[6, 6, 0])
        client.ask("release", model=robot)
        assert not world.paused
        np.testing.assert_allclose(world.models[0].pose, [6, 6, 0], atol=1e-3)

    def test_the_last_client_that_releases_resumes(self, client, robot, url, world):
        with RawWebClient(url) as other:
            client.ask("hold", model=robot)
            other.wait_model("robot")
            other.ask("hold", model=robot)
            client.ask("release", model=robot)
            assert world.paused
            other.ask("release", model=robot)
            assert not world.paused

    @pytest.mark.parametrize("end", ["vanish", "close"])
    def test_a_client_that_disconnects_releases(self, url, world, end):
        client = RawWebClient(url)
        client.ask("hold", model=client.wait_model("robot")["id"])
        assert world.paused
        getattr(client, end)()
        wait_until("the world is resumed", lambda: not world.paused)
        client.close()

    def test_a_hold_that_is_not_repeated_ends(self, client, robot, world, monkeypatch):
        monkeypatch.setattr(commands, "HOLD_TIMEOUT", 0.3)
        client.ask("hold", model=robot)
        wait_until("the world is resumed", lambda: not world.paused)


@pytest.mark.parametrize("closes", [False, True])
def test_a_world_that_is_not_shown_any_more_is_left_alone(world, simulation, viewer, closes):
    handle = viewer.add_world(world, simulation=simulation)
    with RawWebClient(viewer.url) as client:
        robot = client.wait_model("robot")["id"]
        client.ask("drive", model=robot, linear=[0.5, 0])
        client.ask("hold", model=robot)
        if closes:
            viewer.close()
        else:
            viewer.remove_world(handle)
        wait_until("the world is resumed", lambda: not world.paused)
        wait_until("it stops", lambda: world.command("/cmd_vel").value.linear_x == 0)


class TestDrive:
    def test_a_robot_drives_and_stops(self, client, robot, world):
        client.ask("drive", model=robot, linear=[0.5, 0], angular=0.0)
        wait_until("it drives", lambda: velocity(world) > 0.4)
        client.ask("drive", model=robot)
        wait_until("it stops", lambda: abs(velocity(world)) < 1e-3)

    def test_a_robot_stops_without_further_commands(self, client, robot, world):
        client.ask("drive", model=robot, command="/cmd_vel", linear=[0.5, 0])
        assert world.command("/cmd_vel").value.linear_x == 0.5
        wait_until("it stops", lambda: world.command("/cmd_vel").value.linear_x == 0)

    def test_a_robot_stops_when_its_client_vanishes(self, url, world, monkeypatch):
        monkeypatch.setattr(commands, "DRIVE_TIMEOUT", 1e6)
        with RawWebClient(url) as client:
            client.ask("drive", model=client.wait_model("robot")["id"], linear=[0.5, 0])
            assert world.command("/cmd_vel").value.linear_x == 0.5
            client.vanish()
            wait_until("it stops", lambda: world.command("/cmd_vel").value.linear_x == 0)

    def test_what_cannot_be_driven_is_an_error(self, client, robot, world):
        reply = client.reply("drive", model=robot, command="/other", linear=[1, 0])
        assert 'no velocity command "/other"; it has: /cmd_vel' in reply["error"]
        client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 1])
        box = client.wait_model("box")["id"]
        assert "it has: none" in client.reply("drive", model=box, linear=[1, 0])["error"]

    def test_a_robot_that_is_deleted_while_it_is_driven(self, client, robot, world):
        client.ask("drive", model=robot, linear=[0.5, 0])
        client.ask("delete", model=robot)
        client.ask("describe_series")


class TestDetails:
    def test_the_inspected_model(self, client, robot, world):
        client.ask("look", inspect=robot)
        details = client.wait(
            "details", lambda message: any(topic["value"] for topic in message["topics"])
        )
        np.testing.assert_allclose(details["pose"], [3, 5, 0], atol=1e-2)
        assert details["mass"] == pytest.approx(sum(b.mass for b in world.models[0].bodies))
        assert details["contacts"] == []
        assert [body["name"] for body in details["bodies"]] == ["base", "arm"]
        drive, eye = details["plugins"]
        assert (drive["name"], drive["type"]) == ("drive", "DiffDrive")
        assert drive["parameters"] == {"body": "base", "pub_rate": 50}
        assert eye["parameters"]["angle"] == {"min": -1, "max": 1, "increment": 0.5}
        topics = {topic["topic"]: topic for topic in details["topics"]}
        assert topics["/cmd_vel"]["kind"] == "command"
        assert topics["/cmd_vel"]["value"] == {"linear_x": 0, "linear_y": 0, "angular_z": 0}
        client.ask("move", model=robot, pose=[1.4, 5, 0])
        client.wait("details", lambda message: message["contacts"] == ["layer walls"])
        scan = client.wait(
            "details", lambda m: {t["topic"]: t["value"] for t in m["topics"]}["/scan"]
        )
        value = next(topic for topic in scan["topics"] if topic["topic"] == "/scan")
        assert value["time"] > 0
        assert len(value["value"]["ranges"]) == 5
        client.ask("look", inspect=None)
        wait_until(
            "nothing is computed",
            lambda: not any(output.wanted for output in world.ports.outputs.values()),
        )

    def test_a_deleted_model_is_inspected(self, client, robot):
        client.ask("look", inspect=robot)
        client.wait("details")
        client.ask("delete", model=robot)
        client.wait("models")
        assert client.ask("describe_series") == []


class TestSeries:
    def test_all_numbers_are_listed_and_sent(self, client, robot, world):
        names = client.ask("describe_series")
        assert "/odometry/filtered/pose/0" in names
        assert "/odometry/filtered/twist/2" in names
        client.ask("look", series=["/odometry/ground_truth/pose/0", "/scan/ranges/2", "/none/x"])
        values = client.wait("values", lambda message: len(message["series"]) == 2)
        assert values["series"]["/odometry/ground_truth/pose/0"] == pytest.approx(3, abs=0.01)
        # From the sensor at x = 3.2 to the wall at x = 9.
        assert values["series"]["/scan/ranges/2"] == pytest.approx(5.8, abs=0.01)
        client.ask("move", model=robot, pose=[4, 5, 0])
        client.wait("values", lambda m: m["series"]["/odometry/ground_truth/pose/0"] > 3.9)
        assert "/scan/ranges/0" in client.ask("describe_series")

    def test_nothing_is_sent_while_the_time_stands_still(self, client, world):
        client.ask("look", series=["/odometry/ground_truth/pose/0"])
        client.wait("values")
        client.ask("pause")
        client.wait("status", lambda message: message["paused"])
        client.receive_until("status")
        received = client.receive_until("status")
        assert not [m for m in received if isinstance(m, dict) and m["type"] == "values"]


def test_frames(client):
    client.ask("look", frames=True)
    frames = client.wait("frames", lambda message: len(message["frames"]) >= 2)["frames"]
    poses = {(frame["parent"], frame["child"]): frame["pose"] for frame in frames}
    np.testing.assert_allclose(poses["base", "eye"], [0.2, 0, 0])
    assert ("odom", "base") in poses
    client.wait("frames")
