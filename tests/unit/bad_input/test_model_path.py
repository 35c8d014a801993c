"""`model_path`: the folders outside which `spawn_model` reads no file."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

import pytest

import flatland
from flatland.recording import Replay

GOOD = "bodies: [{name: base, footprints: []}]\n"


@pytest.fixture
def outside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model, which is not allowed."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "good.yaml").write_text(GOOD)
    return folder


@pytest.fixture
def world_file(tmp_path: Path, outside: Path) -> Path:
    """A world whose own model is outside the allowed folder."""
    (tmp_path / "allowed").mkdir()
    (tmp_path / "allowed" / "good.yaml").write_text(GOOD)
    (tmp_path / "allowed" / "link.yaml").symlink_to(outside / "good.yaml")
    path = tmp_path / "world.yaml"
    path.write_text(
        f"properties: {{}}\nlayers: []\nmodels: [{{name: m, model: {outside}/good.yaml}}]\n"
    )
    return path


def test_only_later_models_are_restricted(world_file: Path, outside: Path, unchanged: Any) -> None:
    allowed = world_file.parent / "allowed"
    with flatland.World.from_yaml(world_file, seed=1, model_path=[allowed]) as world:
        world.spawn_model("allowed/good.yaml", "a")
        for path in (outside / "good.yaml", outside / "none.yaml", allowed / "link.yaml"):
            with unchanged(world), pytest.raises(flatland.YamlError) as caught:
                world.spawn_model(path, "b")
            assert str(caught.value) == (
                f'Flatland YAML: Failed to read file, path="{path}", it is outside the folders of '
                f"model_path, {allowed}"
            )


REFUSED = {
    "relative": ("../{outside.name}/good.yaml", "{outside}/good.yaml", ""),
    "link to a folder": ("allowed/folder_link/good.yaml", "{allowed}/folder_link/good.yaml", ""),
    "link through /proc": ("allowed/proc_link.yaml", "{allowed}/proc_link.yaml", ""),
    "device": ("/dev/zero", "/dev/zero", ""),
    "similar start of the path": ("{allowed}2/good.yaml", "{allowed}2/good.yaml", ""),
    "include": ("allowed/outer.yaml", "{outside}/body.yaml", " [{allowed}/outer.yaml:1]"),
    "include through a link": (
        "allowed/inner.yaml",
        "{allowed}/folder_link/body.yaml",
        " [{allowed}/inner.yaml:1]",
    ),
    "include of documents": (
        "allowed/items.yaml",
        "{outside}/nothing.yaml",
        " [{allowed}/items.yaml:2]",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_no_path_leads_outside(world_file: Path, outside: Path, unchanged: Any, name: str) -> None:
    allowed = world_file.parent / "allowed"
    (allowed / "folder_link").symlink_to(outside)
    (allowed / "proc_link.yaml").symlink_to(f"/proc/self/root{outside}/good.yaml")
    (allowed / "outer.yaml").write_text(f"bodies: $include {outside}/body.yaml\n")
    (allowed / "inner.yaml").write_text("bodies: $include folder_link/body.yaml\n")
    (allowed / "items.yaml").write_text(f"bodies:\n  - $[include] {outside}/nothing.yaml\n")
    path, shown, place = (text.format(allowed=allowed, outside=outside) for text in REFUSED[name])
    if not path.startswith("/"):
        path = str(world_file.parent / path)
    with (
        flatland.World.from_yaml(world_file, seed=1, model_path=[allowed]) as world,
        unchanged(world),
        pytest.raises(flatland.YamlError) as caught,
    ):
        world.spawn_model(path, "b")
    assert str(caught.value) == (
        f'Flatland YAML: Failed to read file, path="{shown}", it is outside the folders of '
        f"model_path, {allowed}{place}"
    )


@pytest.mark.parametrize("key", ["image", "data"])
def test_nothing_is_said_about_other_files_of_a_map(
    world_file: Path, outside: Path, key: str
) -> None:
    """The reason why an image cannot be read, and similar names, would tell what is there."""
    (outside / "map.png").write_text("version https://git-lfs.example/spec/v1\n")
    map_file = world_file.parent / "allowed" / "map.yaml"
    keys = "resolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 0.5\n"
    if key == "data":
        keys = "type: line_segments\nscale: 1\norigin: [0, 0, 0]\n"
    map_file.write_text(f"{key}: {outside}/map.png\n{keys}")
    world_file.write_text("properties: {}\nlayers: [{name: walls}]\n")
    allowed = map_file.parent
    with flatland.World.from_yaml(world_file, seed=1, model_path=[allowed]) as world:
        with pytest.raises(flatland.FlatlandError) as caught:
            world.set_layer_map("walls", str(map_file))
        why = f"the file cannot be read: it is outside the folders of model_path, {allowed}"
        assert caught.value.hint == (why if key == "image" else "")


def test_a_reset_and_worlds_without_the_option_are_not_restricted(
    world_file: Path, outside: Path
) -> None:
    (outside / "good.yaml").write_text("bodies: $include bodies.yaml\n")
    (outside / "bodies.yaml").write_text("[{name: base, footprints: []}]\n")
    allowed = world_file.parent / "allowed"
    (allowed / "eval.yaml").write_text(f"bodies: $eval return '$include {outside}/bodies.yaml'\n")
    with flatland.World.from_yaml(world_file, seed=1, model_path=[allowed]) as world:
        world.reset()
        assert [model.name for model in world.models] == ["m"]
        with pytest.raises(flatland.YamlError, match="outside the folders of model_path"):
            world.spawn_model(outside / "good.yaml", "b")
        # An expression cannot add an include.
        with pytest.raises(flatland.YamlError, match="must be a list"):
            world.spawn_model(allowed / "eval.yaml", "b")
    with flatland.World.from_yaml(world_file, seed=1) as world:
        world.spawn_model(outside / "good.yaml", "a")


def test_a_link_can_be_an_allowed_folder(world_file: Path, outside: Path) -> None:
    link = world_file.parent / "folder_link"
    link.symlink_to(outside)
    with flatland.World.from_yaml(world_file, seed=1, model_path=[link]) as world:
        world.spawn_model(link / "good.yaml", "a")
        world.spawn_model(outside / "good.yaml", "b")


def test_a_replay_refuses_the_same_files(world_file: Path, outside: Path) -> None:
    recording = world_file.parent / "run.flog"
    allowed = [world_file.parent / "allowed"]
    with flatland.World.from_yaml(world_file, seed=1, model_path=allowed) as world:
        world.record(recording)
        with pytest.raises(flatland.YamlError):
            world.spawn_model(outside / "good.yaml", "a")
        world.step(3)
    replay = Replay(recording)
    assert replay.run() is None
    replay.close()


def test_hints_are_shown_with_the_error(world_file: Path) -> None:
    world_file.write_text("propertys: {}\nlayers: []\n")
    with pytest.raises(flatland.YamlError) as caught:
        flatland.World.from_yaml(world_file)
    hint = '"propertys" in line 1 may be a misspelling of "properties"'
    text = f'Flatland YAML: Entry "properties" does not exist [{world_file}:1]'
    assert str(caught.value) == text
    assert caught.value.text_with_hint == f"{text} (hint: {hint})"
    shown = "".join(traceback.format_exception_only(caught.value))
    assert shown == f"flatland.errors.YamlError: {text}\nhint: {hint}\n"
    error = flatland.WorldError("text")
    assert error.text_with_hint == "Flatland World: text"
    assert not hasattr(error, "__notes__")
