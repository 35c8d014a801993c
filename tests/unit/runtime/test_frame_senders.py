"""Warnings about frames with two parents."""

from __future__ import annotations

import pytest

import flatland

DRIVE = "{name: drive, type: DiffDrive, body: base}"
TF = "{name: tf, type: ModelTfPublisher, publish_tf_world: true}"


def model(files, name, *plugins):
    files.write(
        f"{name}.yaml",
        f"""
        bodies:
        - {{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}
        - {{name: arm, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}
        plugins: [{", ".join(plugins)}]
        """,
    )
    return f"{name}.yaml"


def warnings(caplog):
    return [r.getMessage() for r in caplog.records if "has two parents" in r.getMessage()]


def test_a_drive_and_a_tf_publisher_of_one_model_conflict(files, empty_world, caplog):
    empty_world.spawn_model(model(files, "m", DRIVE, TF), "m")
    empty_world.step(50)
    place = f"[{files.folder / 'm.yaml'}:5]"
    assert warnings(caplog) == [
        'TF frame "base" has two parents, "odom" from Model Plugin "drive" type "DiffDrive" '
        f'model "m" {place} and "map" from Model Plugin "tf" type "ModelTfPublisher" model "m" '
        f"{place}; give the frames different names, or disable one of the senders "
        '("enable_odom_tf_pub: false" of "drive" or "publish_tf_world: false" of "tf")'
    ]
    assert caplog.records[0].levelname == "WARNING"


def test_bodies_of_two_models_with_the_same_frames_conflict(files, empty_world, caplog):
    for name in ("a", "b"):
        path = model(files, name, f"{{name: tf_{name}, type: ModelTfPublisher}}")
        text = (files.folder / path).read_text()
        files.write(path, text.replace("name: base,", f"name: base_{name},"))
        empty_world.spawn_model(path, name)
    empty_world.step()
    (text,) = warnings(caplog)
    assert 'TF frame "arm" has two parents, "base_a" from Model Plugin "tf_a"' in text
    assert text.endswith(
        '; give the models "a" and "b" different namespaces, give the frames different names, or '
        'disable one of the senders ("exclude: [arm]" of "tf_a" or "exclude: [arm]" of "tf_b")'
    )


def test_each_pair_of_parents_of_a_frame_is_logged_once(files, empty_world, caplog):
    drive2 = DRIVE.replace("drive,", "drive2,").replace("base}", "base, odom_frame_id: odom2}")
    empty_world.spawn_model(model(files, "m", DRIVE, TF, drive2), "m")
    empty_world.step(2)
    assert len(warnings(caplog)) == 3
    for index in range(3):
        empty_world.spawn_model("m.yaml", f"m{index}")
        empty_world.step(2)
        empty_world.delete_model(f"m{index}")
    assert len(warnings(caplog)) == 3
    empty_world.spawn_model("m.yaml", "n", "robot")
    empty_world.step(2)
    assert len(warnings(caplog)) == 6


@pytest.mark.parametrize(
    "plugins",
    [
        [DRIVE.replace("body: base", "body: base, enable_odom_tf_pub: false"), TF],
        [DRIVE, TF.replace("publish_tf_world: true", "publish_tf_world: false")],
        [DRIVE, DRIVE.replace("drive,", "same,")],
    ],
)
def test_no_warning_if_each_frame_has_one_parent(files, empty_world, caplog, plugins):
    empty_world.spawn_model(model(files, "m", *plugins), "m")
    empty_world.spawn_model("m.yaml", "other", "ns")
    empty_world.step(3)
    assert warnings(caplog) == []
    assert empty_world.transforms


def test_a_model_without_a_namespace_that_sends_the_same_frames_conflicts(
    files, empty_world, caplog
):
    empty_world.spawn_model(model(files, "m", DRIVE), "a")
    empty_world.spawn_model("m.yaml", "b", pose=(2, 0, 0))
    (text,) = [record.getMessage() for record in caplog.records]
    place = f"[{files.folder / 'm.yaml'}:5]"
    assert text == (
        'TF frame "base" is sent with two poses in "odom", by Model Plugin "drive" type "DiffDrive"'
        f' model "a" {place} and by Model Plugin "drive" type "DiffDrive" model "b" {place}; give '
        'the models "a" and "b" different namespaces, or give the frames different names'
    )
    assert caplog.records[0].place == flatland.Place(str(files.folder / "m.yaml"), 5)


def test_a_removed_sender_causes_no_conflict(files, empty_world, caplog):
    empty_world.spawn_model(model(files, "a", DRIVE), "a")
    empty_world.spawn_model(model(files, "b", TF), "b", "ns")
    empty_world.step(3)
    empty_world.delete_model("a")
    empty_world.spawn_model("b.yaml", "c")
    empty_world.step(3)
    assert warnings(caplog) == []
    empty_world.spawn_model("a.yaml", "d")
    empty_world.step(1)
    assert len(warnings(caplog)) == 1


def test_a_plugin_may_change_the_parent_of_a_frame(files, empty_world, caplog):
    empty_world.spawn_model(model(files, "m", DRIVE), "m")
    (plugin,) = empty_world.model("m").plugins
    for parent in ("shelf", "gripper", "shelf"):
        plugin.send_transform(parent, "box", 0.0, 0.0, 0.0)
    assert warnings(caplog) == []


def test_a_transform_remains_while_a_plugin_sends_it(files, empty_world):
    path = model(files, "m", "{name: tf, type: ModelTfPublisher}")
    for name in ("one", "two"):
        empty_world.spawn_model(path, name)
    empty_world.step()
    frames = set(empty_world.transforms)
    assert frames
    empty_world.delete_model("one")
    assert set(empty_world.transforms) == frames
    empty_world.delete_model("two")
    assert empty_world.transforms == {}
