"""Undo and redo of what a client has changed."""

from __future__ import annotations

import numpy as np
from raw_web_client import RawWebClient

from flatland.web.edits import MAX_EDITS, Edit, Edits
from flatland.world import World


def names(world: World) -> list[str]:
    return world.between_steps(lambda: [model.name for model in world.models])


def number_of(client: RawWebClient, name: str) -> int:
    return int(client.wait_model(name)["id"])


class TestUndo:
    def test_a_deleted_model_returns_while_the_time_continues(self, client, world, files):
        body = "{name: b, pose: [0.5, 0, 1], footprints: []}"
        files.write("offset.model.yaml", f"bodies: [{body}]")
        place = {"file": "offset.model.yaml", "pose": [6, 6, 2]}
        client.ask("spawn", name="box", namespace="ns/box", **place)
        before = world.between_steps(lambda: world.model("box").pose)
        assert client.ask("delete", model=number_of(client, "box")) == {"can_undo": True}
        assert names(world) == ["robot"]
        time = world.time
        assert client.ask("undo")["text"] == 'the deletion of "box"'
        assert world.time >= time
        box = world.model("box")
        assert (box.namespace, box.path) == ("ns/box", str(files.folder / "offset.model.yaml"))
        np.testing.assert_allclose(box.pose, before, atol=1e-6)
        assert client.ask("redo")["text"] == 'the deletion of "box"'
        assert names(world) == ["robot"]

    def test_a_drag_is_undone_as_one_move_and_another_drag_separately(self, client, world):
        client.ask("pause")
        robot = client.model("robot")["id"]
        for drag in ([(1, 1, 0), (2, 2, 0)], [(4, 4, 1), (5, 5, 2)]):
            client.ask("hold", model=robot)
            for pose in drag:
                client.ask("move", model=robot, pose=pose)
            client.ask("release", model=robot)
        expected = [(2, 2, 0), (3, 5, 0)]
        for pose in expected:
            client.ask("undo")
            np.testing.assert_allclose(world.model("robot").pose, pose, atol=1e-6)
        client.ask("redo")
        np.testing.assert_allclose(world.model("robot").pose, (2, 2, 0), atol=1e-6)

    def test_a_spawn_is_undone_and_repeated(self, client, world, url):
        client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 0])
        with RawWebClient(url) as other:
            assert other.reply("undo")["error"] == "there is nothing to undo"
        client.ask("undo")
        assert names(world) == ["robot"]
        client.ask("redo")
        assert names(world) == ["robot", "box"]
        assert client.reply("redo")["error"] == "there is nothing to redo"

    def test_an_undo_that_fails_can_be_repeated(self, client, world):
        client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 0])
        client.ask("delete", model=number_of(client, "box"))
        world.spawn_model("box.model.yaml", "box", pose=(2, 2, 0))
        assert '"box" already exists' in client.reply("undo")["error"]
        world.delete_model("box")
        client.ask("undo")
        assert names(world) == ["robot", "box"]

    def test_a_model_without_a_file_cannot_return(self, client, world):
        world.spawn_model("\nbodies: [{name: b, footprints: []}]", "text", pose=(2, 2, 0))
        assert client.ask("delete", model=number_of(client, "text")) == {"can_undo": False}
        assert client.reply("undo")["error"] == "there is nothing to undo"


def test_the_saved_world_is_a_world_file(client, world, files):
    client.ask("pause")
    client.ask("spawn", file="box.model.yaml", name="box", pose=[6, 6, 0.5])
    saved = client.ask("save")
    assert (saved["name"], saved["folder"]) == ("world_saved.yaml", str(files.folder))
    assert saved["notes"] == []
    with World.from_yaml(files.write(saved["name"], saved["text"])) as again:
        assert [model.name for model in again.models] == ["robot", "box"]


def test_the_number_of_edits_is_limited():
    edits = Edits()
    for i in range(MAX_EDITS + 5):
        edits.add(Edit(str(i), lambda: None, lambda: None))
    undone = []
    while (edit := edits.last(undone=False)) is not None:
        edits.shift(edit)
        undone.append(edit.text)
    assert undone == [str(i) for i in reversed(range(5, MAX_EDITS + 5))]
    edits.add(Edit("new", lambda: None, lambda: None))
    assert edits.last(undone=True) is None
