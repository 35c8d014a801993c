"""Several models in one request, all or none, and models from YAML text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import BatchError, ModelSpec
from flatland.recording import Replay

BOX = """
bodies:
  - name: base
    footprints: [{type: polygon, points: [[0, 0], [0.5, 0], [0.5, 0.5], [0, 0.5]], density: 1}]
"""
TEXT = BOX  # begins with a line break
DRIVEN = "{bodies: [{name: b, footprints: [{type: circle, radius: 0.2, density: 1}]}], "
DRIVEN += "plugins: [{type: DiffDrive, name: drive, body: b}]}"
WALLS = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "walls.dat").write_text(WALLS)
    (tmp_path / "map.yaml").write_text(
        "type: line_segments\ndata: walls.dat\nscale: 1\norigin: [0, 0, 0]\n"
    )
    (tmp_path / "box.yaml").write_text(BOX)
    (tmp_path / "world.yaml").write_text(
        "properties: {}\nlayers: [{name: 2d, map: map.yaml}]\n"
        "models: [{name: a, model: box.yaml, pose: [1, 1, 0.3]}]\n"
    )
    return tmp_path


@pytest.fixture
def world(folder: Path, log: Any) -> Any:
    with flatland.World.from_yaml(folder / "world.yaml", seed=1, observers=[log]) as world:
        world.step(3)
        log.events.clear()
        yield world


def specs(*poses: tuple[float, float, float], path: str = "box.yaml") -> list[ModelSpec]:
    return [ModelSpec(path, f"m{i}", f"ns{i}", pose) for i, pose in enumerate(poses)]


class TestSpawn:
    def test_equals_single_calls(self, folder: Path) -> None:
        hashes = []
        for together in (True, False):
            with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
                wanted = specs((-1, 0, 0), (-2, 0, 1), (0, -2, 2), path=DRIVEN)
                if together:
                    models = world.spawn_models(wanted)
                    assert [model.name for model in models] == ["m0", "m1", "m2"]
                else:
                    for spec in wanted:
                        world.spawn_model(spec.yaml_path, spec.name, spec.namespace, spec.pose)
                world.step(20)
                hashes.append(world.state_hash())
        assert hashes[0] == hashes[1]

    def test_observers_are_notified_in_order(self, world: Any, log: Any) -> None:
        world.spawn_models(specs((-1, 0, 0), (-2, 0, 0)))
        assert log.events == ["model_added m0", "model_added m1"]
        assert world.spawn_models([]) == []

    def test_a_failure_leaves_the_world_as_it_was(self, world: Any, log: Any) -> None:
        before, topics = world.state_hash(), set(world.ports.outputs)
        wanted = [*specs((-1, 0, 0), (-2, 0, 0), path=DRIVEN), ModelSpec("none.yaml", "x")]
        with pytest.raises(BatchError, match=r"^Flatland World: models\[2\]: File does") as e:
            world.spawn_models(wanted)
        assert e.value.index == 2
        assert isinstance(e.value.__cause__, flatland.YamlError)
        assert (world.state_hash(), set(world.ports.outputs)) == (before, topics)
        assert [model.name for model in world.models] == ["a"]
        assert not any(event.startswith("model_") for event in log.events)
        world.spawn_models(wanted[:2])

    @pytest.mark.parametrize(
        ("spec", "text"),
        [
            (ModelSpec("box.yaml", "a"), 'Model with name "a" already exists'),
            (ModelSpec("box.yaml", "m0"), 'Model with name "m0" already exists'),
            (ModelSpec("box.yaml", ""), "its name must not be empty"),
            (ModelSpec("", "x"), "the path must not be empty"),
            (ModelSpec("box.yaml", "x", "my ns"), "is not a legal ROS name"),
            (ModelSpec("box.yaml", "x", "", (float("nan"), 0, 0)), "must be finite"),
            (ModelSpec("box.yaml", "x", "", (1e300, 0, 0)), "must be finite"),
            (ModelSpec("box.yaml", "x", "", "abc"), "pose must be"),
            (ModelSpec("{bodies: []}", "x"), 'Invalid "bodies" in "x" model'),
            (ModelSpec("{bodies: [}", "x"), 'file, path="<text>", line 1'),
        ],
    )
    def test_an_invalid_model(self, world: Any, spec: ModelSpec, text: str) -> None:
        before = world.state_hash()
        with pytest.raises(BatchError, match=rf"models\[1\]: .*{text}"):
            world.spawn_models([*specs((-1, 0, 0)), spec])
        assert world.state_hash() == before

    def test_models_before_the_blocked_one_are_considered(self, world: Any) -> None:
        wanted = specs((-2, -2, 0), (-2.2, -2, 0))
        with pytest.raises(BatchError, match=r'models\[1\]: .* it overlaps model "m0" at'):
            world.spawn_models(wanted, if_blocked="refuse")
        first, second = world.spawn_models(wanted, if_blocked="nearest")
        assert first.displacement == (0, 0)
        assert second.displacement != (0, 0)
        with pytest.raises(ValueError, match="if_blocked must be one of"):
            world.spawn_models(wanted, if_blocked="maybe")

    def test_each_file_is_parsed_once_unless_it_is_random(self, world: Any, folder: Path) -> None:
        (folder / "random.yaml").write_text(BOX + "    color: [$eval math.random(), 0, 0, 1]\n")
        reads = []
        source = world.source
        read, source.read = source.read, lambda path: reads.append(path) or read(path)
        plain = [ModelSpec("box.yaml", f"p{i}", "", (i - 4, 3, 0)) for i in range(5)]
        drawn = [ModelSpec("random.yaml", f"r{i}", "", (i - 4, -3, 0)) for i in range(5)]
        world.spawn_models(plain + drawn)
        assert [Path(path).name for path in reads] == ["box.yaml"] + 5 * ["random.yaml"]
        assert len({model.bodies[0].color for model in world.models[-5:]}) == 5


class TestText:
    @pytest.mark.parametrize("text", [TEXT, "\r" + BOX, DRIVEN])
    def test_a_model_from_text(self, world: Any, text: str) -> None:
        model = world.spawn_model(text, "t", "", (-1, 0, 0))
        assert model.path == "<text>"
        assert model.pose == (-1, 0, 0)

    def test_errors_name_the_line(self, world: Any) -> None:
        with pytest.raises(flatland.YamlError, match=r"\[<text>:5\]") as error:
            world.spawn_model(f"{TEXT}    typo: 1\n", "t")
        assert error.value.place == flatland.Place("<text>", 5)
        with pytest.raises(flatland.PluginError, match=r"<text>:1"):
            world.spawn_model(DRIVEN.replace("DiffDrive", "Nothing"), "t")

    def test_relative_paths_start_from_the_world_file(self, world: Any, folder: Path) -> None:
        (folder / "bodies.yaml").write_text("- {name: b, footprints: []}\n")
        assert world.spawn_model("{bodies: $include bodies.yaml}", "t").bodies[0].name == "b"

    def test_included_files_are_restricted(self, folder: Path) -> None:
        allowed = folder / "allowed"
        allowed.mkdir()
        (folder / "bodies.yaml").write_text("- {name: b, footprints: []}\n")
        (allowed / "bodies.yaml").symlink_to(folder / "bodies.yaml")
        with flatland.World.from_yaml(folder / "world.yaml", model_path=[allowed]) as world:
            world.spawn_model(DRIVEN, "t")
            for path in ("bodies.yaml", "allowed/bodies.yaml"):
                with pytest.raises(flatland.YamlError, match="outside the folders of model_path"):
                    world.spawn_model(f"{{bodies: $include {path}}}", "u")

    def test_parameters_are_replaced(self, folder: Path) -> None:
        with flatland.World.from_yaml(folder / "world.yaml", params={"n": "body7"}) as world:
            model = world.spawn_model('{bodies: [{name: $eval param("n"), footprints: []}]}', "t")
            assert model.bodies[0].name == "body7"


class TestMove:
    @pytest.fixture
    def boxes(self, world: Any, log: Any) -> Any:
        world.spawn_models(specs((-1, 0, 0), (-2, 0, 0), (-3, 0, 0)))
        for model in world.models:
            model.bodies[0].set_velocity(0.1, 0.2, 0.3)
        world.step(7)
        log.events.clear()
        return world

    def test_all_models_move(self, boxes: Any, log: Any) -> None:
        poses = {"m0": (1, -1, 0), "m2": (2, -2, 1)}
        models = boxes.move_models(poses)
        assert [model.name for model in models] == ["m0", "m2"]
        assert models[0].pose == (1, -1, 0)
        assert models[1].pose == pytest.approx((2, -2, 1), abs=1e-6)
        assert models[1].bodies[0].velocity == (0, 0, 0)
        assert log.events == ["model_moved m0", "model_moved m2"]
        assert boxes.move_models([]) == []
        with pytest.raises(ValueError, match="if_blocked must be one of"):
            boxes.move_models({}, if_blocked="maybe")

    def test_two_models_exchange_their_places(self, boxes: Any) -> None:
        first, second = boxes.model("m0").pose, boxes.model("m1").pose
        with pytest.raises(flatland.WorldError, match='overlaps model "m1"'):
            boxes.move_model("m0", second, "refuse")
        boxes.move_models([("m0", second), ("m1", first)], "refuse")
        assert (boxes.model("m0").pose, boxes.model("m1").pose) == (second, first)

    def test_blocked_poses_are_logged_on_request(
        self, boxes: Any, caplog: pytest.LogCaptureFixture
    ) -> None:
        place = boxes.model("m1").pose
        boxes.move_models([("m0", place)], "allow")
        assert caplog.records == []
        boxes.move_models([("m0", place)], "warn")
        assert 'model "m0" overlaps model "m1"' in caplog.text

    @pytest.mark.parametrize(
        ("pairs", "mode", "index", "text"),
        [
            ([("m0", (1, 1, 0)), ("ghost", (0, 0, 0))], "warn", 1, '"ghost" does not exist'),
            ([("m0", (1, 1, 0)), ("m0", (0, 0, 0))], "warn", 1, '"m0" occurs twice'),
            ([("m0", (3, 3, 0)), ("m1", (0, float("nan"), 0))], "warn", 1, "must be finite"),
            ([("m0", (3, 3, 0)), ("m1", (0, 1e300, 0))], "warn", 1, "must be finite"),
            ([("m0", (3, 3, 0)), ("m1", (1, 1, 0))], "refuse", 1, 'overlaps model "a"'),
            ([("m0", (3, 3, 0)), ("m1", (3, 3, 0))], "refuse", 0, 'overlaps model "m1"'),
            ([("m0", (3, 3, 0)), ("m1", (4.8, 3, 0))], "refuse", 1, 'overlaps layer "2d"'),
        ],
    )
    def test_a_failure_moves_everything_back_exactly(
        self, boxes: Any, log: Any, pairs: Any, mode: Any, index: int, text: str
    ) -> None:
        before = boxes.state_hash()
        motions = boxes.physics.body_states().tobytes()
        with pytest.raises(BatchError, match=rf"models\[{index}\]: .*{text}") as error:
            boxes.move_models(pairs, mode)
        assert error.value.index == index
        assert boxes.physics.body_states().tobytes() == motions
        assert boxes.state_hash() == before
        assert log.events == []

    def test_a_sleeping_model_sleeps_after_a_failure(self, boxes: Any) -> None:
        boxes.model("m0").bodies[0].awake = False
        before = boxes.state_hash()
        with pytest.raises(BatchError):
            boxes.move_models({"m0": (3, 3, 0), "m1": (1, 1, 0)}, "refuse")
        assert boxes.model("m0").bodies[0].awake is False
        assert boxes.state_hash() == before

    def test_nearest_places(self, boxes: Any) -> None:
        first, second = boxes.move_models({"m0": (3, 3, 0), "m1": (3, 3, 0)}, "nearest")
        assert first.displacement != (0, 0)
        assert second.displacement == (0, 0)
        assert boxes.is_free(first.pose, model=first)


class TestDelete:
    def test_all_models_are_deleted(self, world: Any, log: Any) -> None:
        world.spawn_models(specs((-1, 0, 0), (-2, 0, 0)))
        world.delete_models(["m1", "a"])
        assert [model.name for model in world.models] == ["m0"]
        assert log.events[2:] == ["model_removed m1", "model_removed a"]
        world.delete_models([])

    @pytest.mark.parametrize(
        ("names", "index", "text"),
        [(["a", "ghost"], 1, '"ghost" does not exist'), (["a", "a"], 1, '"a" occurs twice')],
    )
    def test_a_failure_deletes_nothing(
        self, world: Any, log: Any, names: list[str], index: int, text: str
    ) -> None:
        before = world.state_hash()
        with pytest.raises(BatchError, match=rf"names\[{index}\]: .*{text}"):
            world.delete_models(names)
        assert world.state_hash() == before
        assert log.events == []


def test_a_recording_repeats_all_kinds_of_changes(folder: Path) -> None:
    """tests/unit/recording/test_replay.py repeats those of single models."""
    path = folder / "run.flog"
    with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
        world.record(path)
        world.spawn_models(specs((-1, 0, 0), (-2, 0, 0), path=TEXT))
        world.set_appearance("m0", color=(0, 0, 0, 1), layers="2d", visible=False)
        world.step(3)
        world.move_models({"m0": (2, -2, 0), "a": (-3, 3, 1)})
        cells = np.zeros((9, 9), np.int8)
        cells[4, 4] = 100
        world.set_layer_map("2d", flatland.OccupancyGrid((2, -2, 0), 0.1, cells))
        for change in (
            lambda: world.delete_models(["m0", "ghost"]),
            lambda: world.set_appearance("a", "none"),
            lambda: world.set_layer_map("2d", "none.yaml"),
        ):
            with pytest.raises(flatland.FlatlandError):
                change()
        world.step(3)
        world.delete_models(["m1", "a"])
        world.step(50)
        pose, color = world.model("m0").pose, world.model("m0").bodies[0].color
    replay = Replay(path)
    replay.run()
    assert replay.difference is None
    assert [model.name for model in replay.world.models] == ["m0"]
    body = replay.world.model("m0").bodies[0]
    assert (body.pose, body.color, body.visible) == (pose, color, False)
    assert pose != (2, -2, 0)  # the new wall is within the box
    assert len(replay.world.layer("2d").edges) == 4
    replay.world.close()
