"""Model files: all entries, and errors that are collected."""

from __future__ import annotations

import logging

import pytest

import flatland
from flatland.config.collecting_reader import ErrorCollector
from flatland.loading import model_loader
from flatland.loading.world_loader import load_world
from flatland.loading.world_source import WorldSource

BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
TWO_BODIES = f"[{BODY}, {{name: wheel, footprints: []}}]"


def body(extra: str = "", footprint: str = "type: circle, radius: 0.2, density: 1") -> str:
    return f"bodies: [{{name: base, footprints: [{{{footprint}}}]{extra}}}]"


def joint(entries: str) -> str:
    return f"bodies: {TWO_BODIES}\njoints: [{{name: J, {entries}}}]"


ENDS = "bodies: [{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0, 0]}]"


def test_entries_of_a_body(files):
    world = files.load_model(
        """
        bodies:
          - name: base
            pose: [1, 2, 0.5]
            type: kinematic
            color: [0.1, 0.2, 0.3, 0.4]
            linear_damping: 0.1
            angular_damping: 0.2
            footprints:
              - {type: circle, radius: 0.5, center: [0.1, 0.2], density: 3, friction: 0.4,
                 restitution: 0.6, layers: [3d], sensor: true}
              - {type: polygon, points: [[0, 0], [1, 0], [1, 1]], density: 0, collision: false}
              - {type: circle, radius: 1, density: 1, layers: []}
          - {name: plain, footprints: []}
        """
    )
    model = world.model("robot")
    base, plain = model.bodies
    assert base.pose == pytest.approx((1, 2, 0.5))
    assert (base.type, plain.type) == ("kinematic", "dynamic")
    assert base.color == (0.1, 0.2, 0.3, 0.4)
    assert plain.color == (1, 1, 1, 0.5)
    assert base.linear_damping == pytest.approx(0.1)
    assert base.angular_damping == pytest.approx(0.2)
    assert plain.fixtures == []
    circle, polygon, disc = base.fixtures
    assert circle.shape == "circle"
    assert circle.radius == pytest.approx(0.5)
    assert circle.center == pytest.approx((0.1, 0.2))
    assert circle.density == pytest.approx(3)
    assert circle.friction == pytest.approx(0.4)
    assert circle.restitution == pytest.approx(0.6)
    assert circle.is_sensor
    assert (circle.category_bits, circle.mask_bits) == (0b10, 0b10)
    assert polygon.shape == "polygon"
    assert sorted(map(tuple, polygon.vertices.tolist())) == [(0, 0), (1, 0), (1, 1)]
    assert (polygon.friction, polygon.restitution, polygon.is_sensor) == (0, 0, False)
    assert (polygon.category_bits, polygon.mask_bits) == (0xFFFF, 0)
    assert (disc.center, disc.category_bits, disc.mask_bits) == ((0, 0), 0, 0)


def test_the_pose_of_a_body_is_relative_to_the_model(files):
    files.write("robot.model.yaml", body(", pose: [1, 0, 0.25]"))
    world = files.load(
        """
        properties: {}
        layers: []
        models: [{name: robot, model: robot.model.yaml, pose: [10, 20, 1.5707963267948966]}]
        """
    )
    assert world.model("robot").bodies[0].pose == pytest.approx((10, 21, 1.8207963), abs=1e-5)


def test_entries_of_joints(files):
    world = files.load_model(
        f"""
bodies: {TWO_BODIES}
joints:
  - {{name: turn, type: revolute, color: [1, 0, 0, 1], collide_connected: true, limits: [-1, 2],
     bodies: [{{name: wheel, anchor: [0.1, 0.2]}}, {{name: base, anchor: [0.3, 0.4]}}]}}
  - {{name: free, type: revolute, {ENDS}}}
  - {{name: fixed, type: weld, angle: 0.3, frequency: 5, damping: 0.7, {ENDS}}}
  - {{name: rigid, type: weld, {ENDS}}}
"""
    )
    turn, free, fixed, rigid = world.model("robot").joints
    assert (turn.name, turn.type, turn.color) == ("turn", "revolute", (1, 0, 0, 1))
    assert [end.name for end in turn.bodies] == ["wheel", "base"]
    assert turn.anchors.ravel() == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert turn.collide_connected
    assert turn.limits == pytest.approx((-1, 2))
    assert free.limits is None
    assert not free.collide_connected
    assert free.color == (1, 1, 1, 0.5)
    assert fixed.type == "weld"
    assert fixed.reference_angle == pytest.approx(0.3)
    assert fixed.frequency == pytest.approx(5)
    assert fixed.damping == pytest.approx(0.7)
    assert (rigid.reference_angle, rigid.frequency, rigid.damping) == (0, 0, 0)
    assert (rigid.collide_connected, rigid.color) == (False, (1, 1, 1, 0.5))


def test_disabled_entries_are_skipped_and_logged(files, caplog):
    caplog.set_level(logging.INFO, "flatland")
    world = files.load_model(
        f"""
bodies: [{BODY}, {{name: ghost, enabled: false, nonsense: 1}}, {{name: wheel, footprints: []}}]
joints: [{{name: J, type: weld, enabled: off, {ENDS}}}]
plugins: [{{name: P, type: NoSuchPlugin, enabled: No}}]
"""
    )
    model = world.model("robot")
    assert [other.name for other in model.bodies] == ["base", "wheel"]
    assert (model.joints, model.plugins) == ([], [])
    for what in ('body "ghost"', 'joint "J"', 'plugin "P"'):
        assert f'model "robot" {what} is disabled' in caplog.text


def test_unknown_parts_of_a_model_are_errors(files):
    model = files.load_model(body()).model("robot")
    with pytest.raises(flatland.WorldError, match='Body with name "x" does not exist'):
        model.body("x")
    with pytest.raises(flatland.WorldError, match='Joint with name "x" does not exist'):
        model.joint("x")
    with pytest.raises(flatland.WorldError, match='Plugin with name "x" does not exist'):
        model.plugin("x")


@pytest.mark.parametrize(
    ("namespace", "frame", "expected"),
    [
        ("", "base", "base"),
        ("r1", "base", "r1_base"),
        ("r1", "/map", "map"),
        ("", "/map", "map"),
        ("/a//b/", "base", "a/b_base"),
    ],
)
def test_frames_are_prefixed_with_the_namespace(files, namespace, frame, expected):
    files.write("robot.model.yaml", body())
    world = files.load("{properties: {}, layers: []}")
    model = world.spawn_model("robot.model.yaml", "robot", namespace)
    assert model.frame(frame) == expected


def collected(files, model, properties="{}"):
    """Returns a loaded world and the errors of its file and of a model."""
    files.write("robot.model.yaml", model)
    models = "models: [{name: robot, model: robot.model.yaml}]"
    path = files.write(
        "world.yaml", f"{{properties: {properties}, layers: [{{name: 2d}}], {models}}}"
    )
    collector = ErrorCollector()
    source = WorldSource(path, params={}, read=collector.read)
    with load_world(flatland.World, source, seed=1) as world:
        return world, [error.message for error in collector.errors]


def test_all_errors_of_a_footprint_are_collected(files):
    text = body(footprint="type: circle, radius: 0.2, density: -1, layers: [2d, roof]")
    _, (layers, density) = collected(files, text)
    assert "{roof} layer(s) does not exist" in layers
    assert 'Invalid "density", must be finite and not negative, got -1.0' in density


def test_a_value_takes_the_place_of_an_invalid_one(files):
    world, errors = collected(files, body(", type: flying"), "{publish_map: roof}")
    assert len(errors) == 2
    assert world.map_layer == ""


@pytest.mark.parametrize(
    ("kind", "limit", "what"),
    [
        ("static", "MAX_FOOTPRINTS", "footprints"),
        ("dynamic", "MAX_MOVING_FOOTPRINTS", "footprints of bodies that are not static"),
    ],
)
def test_the_number_of_footprints_of_a_model_is_limited(files, monkeypatch, kind, limit, what):
    """A list that is repeated by aliases makes a short file large."""
    monkeypatch.setattr(model_loader, limit, 6)
    circle = "{type: circle, radius: 0.2, density: 1}"
    bodies = "".join(f"- {{name: b{i}, type: {kind}, footprints: *f}}\n" for i in range(1, 5))
    path = files.write(
        "m.yaml",
        f"bodies:\n- {{name: b0, type: {kind}, footprints: &f [{circle}, {circle}, {circle}]}}\n"
        f"{bodies}",
    )
    text = (
        'Invalid "footprints" in model "m" body "b2", the model must have at most 6 '
        f"{what}, got 9 with those of this body [{path}:4]"
    )
    with flatland.World(seed=1) as world:
        with pytest.raises(flatland.YamlError) as caught:
            world.spawn_model(path, "m")
        assert caught.value.message == text
        assert world.models == []
        assert world.physics.object_counts().bodies == 0
    world_path = files.write(
        "w.yaml", "properties: {}\nlayers: []\nmodels: [{name: m, model: m.yaml}]"
    )
    collector = ErrorCollector()
    load_world(flatland.World, WorldSource(world_path, read=collector.read), seed=1).close()
    assert [error.message for error in collector.errors] == [text]


def test_the_number_of_layers_of_a_footprint_is_limited(files):
    names = ", ".join(["all"] * 101)
    circle = f"type: circle, radius: 0.2, density: 1, layers: [{names}]"
    path = files.write("m.yaml", body(footprint=circle))
    with flatland.World(seed=1) as world, pytest.raises(flatland.YamlError) as caught:
        world.spawn_model(path, "m")
    assert 'Entry "layers" must have size <= 100' in caught.value.message
