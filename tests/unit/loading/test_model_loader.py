"""Model files: all entries and error messages."""

from __future__ import annotations

import logging

import pytest

import flatland
from flatland import YamlError

BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
TWO_BODIES = f"[{BODY}, {{name: wheel, footprints: []}}]"


def body(extra: str = "", footprint: str = "type: circle, radius: 0.2, density: 1") -> str:
    return f"bodies: [{{name: base, footprints: [{{{footprint}}}]{extra}}}]"


def joint(entries: str) -> str:
    return f"bodies: {TWO_BODIES}\njoints: [{{name: J, {entries}}}]"


ENDS = "bodies: [{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0, 0]}]"
FOOTPRINT = 'model "robot" body "base" "footprints" index=0'

ERRORS = {
    "no bodies key": ("joints: []", 'Entry "bodies" does not exist (in model "robot")'),
    "bodies no list": ("bodies: {}", 'Entry "bodies" must be a list (in model "robot")'),
    "empty bodies": (
        "bodies: []",
        'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1',
    ),
    "all bodies disabled": (
        body(", enabled: false"),
        'Invalid "bodies" in "robot" model, must be a list of bodies of at least size 1',
    ),
    "body twice": (
        f"bodies: [{BODY}, {BODY}]",
        'Invalid "bodies" in "robot" model, body with name "base" already exists',
    ),
    "body without name": (
        "bodies: [{footprints: []}]",
        'Entry "name" does not exist (in model "robot" "bodies" index=0)',
    ),
    "body without footprints": (
        "bodies: [{name: base}]",
        'Entry "footprints" does not exist (in model "robot" body "base")',
    ),
    "body type": (
        body(", type: moving"),
        'Invalid "type" in model "robot" body "base", must be one of: static, kinematic, dynamic',
    ),
    "body pose size": (
        body(", pose: [1, 2]"),
        'Entry "pose" must have size of exactly 3 (in model "robot" body "base")',
    ),
    "body pose nan": (
        body(", pose: [1, 2, .nan]"),
        'Invalid "pose", must be finite, got [1.0, 2.0, nan] (in model "robot" body "base")',
    ),
    "body color size": (
        body(", color: [1, 2, 3]"),
        'Entry "color" must have size of exactly 4 (in model "robot" body "base")',
    ),
    "negative damping": (
        body(", linear_damping: -1"),
        'Invalid "linear_damping", must be finite and not negative, got -1.0 '
        '(in model "robot" body "base")',
    ),
    "nan damping": (
        body(", angular_damping: .nan"),
        'Invalid "angular_damping", must be finite and not negative, got nan '
        '(in model "robot" body "base")',
    ),
    "unknown body key": (
        body(", colour: [1, 1, 1, 1]"),
        'Entry body "base" contains unrecognized entry(s) {"colour"} (in model "robot")',
    ),
    "footprint type": (
        body(footprint="type: square, density: 1"),
        f'Invalid footprint "type" in {FOOTPRINT}, support footprints are: circle, polygon',
    ),
    "footprint without density": (
        body(footprint="type: circle, radius: 1"),
        f'Entry "density" does not exist (in {FOOTPRINT})',
    ),
    "negative density": (
        body(footprint="type: circle, radius: 1, density: -1"),
        f'Invalid "density", must be finite and not negative, got -1.0 (in {FOOTPRINT})',
    ),
    "density no number": (
        body(footprint="type: circle, radius: 1, density: heavy"),
        f'Error converting entry "density" to float (in {FOOTPRINT})',
    ),
    "negative friction": (
        body(footprint="type: circle, radius: 1, density: 1, friction: -0.1"),
        f'Invalid "friction", must be finite and not negative, got -0.1 (in {FOOTPRINT})',
    ),
    "negative radius": (
        body(footprint="type: circle, radius: -1, density: 1"),
        f'Invalid "radius", must be finite and not negative, got -1.0 (in {FOOTPRINT})',
    ),
    "circle without radius": (
        body(footprint="type: circle, density: 1"),
        f'Entry "radius" does not exist (in {FOOTPRINT})',
    ),
    "infinite center": (
        body(footprint="type: circle, density: 1, radius: 1, center: [.inf, 0]"),
        f'Invalid "center", must be finite, got [inf, 0.0] (in {FOOTPRINT})',
    ),
    "unknown footprint layer": (
        body(footprint="type: circle, radius: 1, density: 1, layers: [2d, a, b]"),
        f'Invalid footprint "layers" in {FOOTPRINT}, {{a,b}} layer(s) does not exist',
    ),
    "sensor no bool": (
        body(footprint="type: circle, radius: 1, density: 1, sensor: maybe"),
        f'Error converting entry "sensor" to bool (in {FOOTPRINT})',
    ),
    "two points": (
        body(footprint="type: polygon, density: 1, points: [[0, 0], [1, 0]]"),
        f'Entry "points" must have size >= 3 (in {FOOTPRINT})',
    ),
    "nine points": (
        body(footprint=f"type: polygon, density: 1, points: {[[i, i * i] for i in range(9)]}"),
        f'Entry "points" must have size <= 8 (in {FOOTPRINT})',
    ),
    "point of three": (
        body(footprint="type: polygon, density: 1, points: [[0, 0], [1, 0], [1, 1, 1]]"),
        f'Error converting entry index=2 to vector (in {FOOTPRINT} "points")',
    ),
    "polygon without area": (
        body(footprint="type: polygon, density: 1, points: [[0, 0], [1, 0], [2, 0]]"),
        f"Invalid entry in {FOOTPRINT}, a polygon must have a positive area, but its points are "
        "collinear",
    ),
    "polygon of one point": (
        body(footprint="type: polygon, density: 1, points: [[1, 1], [1, 1], [1, 1]]"),
        f"Invalid entry in {FOOTPRINT}, a polygon must have at least 3 points that are "
        "at least 2.5 mm apart, got 1",
    ),
    "polygon with nan": (
        body(footprint="type: polygon, density: 1, points: [[0, 0], [1, .nan], [2, 0]]"),
        'Invalid "points", must be finite, got [(0.0, 0.0), (1.0, nan), (2.0, 0.0)] '
        f"(in {FOOTPRINT})",
    ),
    "unknown footprint key": (
        body(footprint="type: circle, radius: 1, density: 1, points: []"),
        'Entry index=0 contains unrecognized entry(s) {"points"} (in model "robot" body '
        '"base" "footprints")',
    ),
    "joint type": (
        joint(f"type: rope, {ENDS}"),
        'Invalid joint "type" in model "robot" joint "J", supported joints are: revolute, weld',
    ),
    "joint with three ends": (
        joint("type: weld, bodies: [{name: base, anchor: [0, 0]}]"),
        'Invalid "bodies" in model "robot" joint "J", must be a sequence of exactly two items',
    ),
    "joint to unknown body": (
        joint("type: weld, bodies: [{name: base, anchor: [0, 0]}, {name: X, anchor: [0, 0]}]"),
        'Cannot find body with name "X" in model "robot" joint "J" "bodies" index=1',
    ),
    "joint to itself": (
        joint("type: weld, bodies: [{name: base, anchor: [0, 0]}, {name: base, anchor: [0, 0]}]"),
        'Invalid entry in model "robot" joint "J", a joint must connect two different bodies',
    ),
    "joint without anchor": (
        joint("type: weld, bodies: [{name: base}, {name: wheel, anchor: [0, 0]}]"),
        'Entry "anchor" does not exist (in model "robot" joint "j" "bodies" index=0)',
    ),
    "infinite anchor": (
        joint(f"type: weld, {ENDS.replace('[0, 0]', '[.inf, 0]', 1)}"),
        'Invalid "anchor", must be finite, got [inf, 0.0] '
        '(in model "robot" joint "j" "bodies" index=0)',
    ),
    "joint color size": (
        joint(f"type: weld, {ENDS}, color: [1, 1, 1]"),
        'Entry "color" must have size of exactly 4 (in model "robot" joint "j")',
    ),
    "angle nan": (
        joint(f"type: weld, {ENDS}, angle: .nan"),
        'Invalid "angle", must be finite, got nan (in model "robot" joint "j")',
    ),
    "limit nan": (
        joint(f"type: revolute, {ENDS}, limits: [.nan, 1]"),
        'Invalid "limits", must be finite, got [nan, 1.0] (in model "robot" joint "j")',
    ),
    "negative joint damping": (
        joint(f"type: weld, {ENDS}, damping: -1"),
        'Invalid "damping", must be finite and not negative, got -1.0 (in model "robot" joint "j")',
    ),
    "negative restitution": (
        body(footprint="type: circle, radius: 1, density: 1, restitution: -0.1"),
        f'Invalid "restitution", must be finite and not negative, got -0.1 (in {FOOTPRINT})',
    ),
    "body color nan": (
        body(", color: [1, 1, 1, .nan]"),
        'Invalid "color", must be finite, got [1.0, 1.0, 1.0, nan] (in model "robot" body "base")',
    ),
    "joint twice": (
        f"bodies: {TWO_BODIES}\n"
        f"joints: [{{name: J, type: weld, {ENDS}}}, {{name: J, type: weld, {ENDS}}}]",
        'Invalid "joints" in "robot" model, joint with name "J" already exists',
    ),
    "limits upside down": (
        joint(f"type: revolute, {ENDS}, limits: [1, -1]"),
        'Invalid "limits", the lower limit 1.0 must not be above the upper limit -1.0 '
        '(in model "robot" joint "j")',
    ),
    "limits of one": (
        joint(f"type: revolute, {ENDS}, limits: [1]"),
        'Entry "limits" must have size of exactly 2 (in model "robot" joint "j")',
    ),
    "limits on a weld": (
        joint(f"type: weld, {ENDS}, limits: [-1, 1]"),
        'Entry joint "j" contains unrecognized entry(s) {"limits"} (in model "robot")',
    ),
    "angle on a revolute": (
        joint(f"type: revolute, {ENDS}, angle: 1, frequency: 2"),
        'Entry joint "j" contains unrecognized entry(s) {"angle", "frequency"} (in model "robot")',
    ),
    "negative frequency": (
        joint(f"type: weld, {ENDS}, frequency: -1"),
        'Invalid "frequency", must be finite and not negative, got -1.0 '
        '(in model "robot" joint "j")',
    ),
    "anchor of one number": (
        joint("type: weld, bodies: [{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0]}]"),
        'Entry "anchor" must have size of exactly 2 (in model "robot" joint "j" "bodies" index=1)',
    ),
    "anchor of three numbers": (
        joint(f"type: revolute, {ENDS.replace('[0, 0]', '[0, 0, 0]', 1)}"),
        'Entry "anchor" must have size of exactly 2 (in model "robot" joint "j" "bodies" index=0)',
    ),
    "anchor no list": (
        joint(f"type: weld, {ENDS.replace('[0, 0]', '0', 1)}"),
        'Entry "anchor" must be a list (in model "robot" joint "j" "bodies" index=0)',
    ),
    "anchor of text": (
        joint(f"type: weld, {ENDS.replace('[0, 0]', '[0, left]', 1)}"),
        "Error converting entry index=1 to float "
        '(in model "robot" joint "j" "bodies" index=0 "anchor")',
    ),
    "joint to a disabled body": (
        f"bodies: [{BODY}, {{name: wheel, footprints: [], enabled: false}}]\n"
        f"joints: [{{name: J, type: weld, {ENDS}}}]",
        'Cannot find body with name "wheel" in model "robot" joint "J" "bodies" index=1',
    ),
    "plugin twice": (
        f"bodies: [{BODY}]\nplugins: [{{name: P, type: ModelTfPublisher}}, "
        "{name: P, type: ModelTfPublisher}]",
        'Invalid "plugins" in "robot" model, plugin with name "P" already exists',
    ),
    "plugin without name": (
        f"bodies: [{BODY}]\nplugins: [{{type: ModelTfPublisher}}]",
        'Entry "name" does not exist (in model "robot" "plugins" index=0)',
    ),
    "unknown model key": (
        f"bodies: [{BODY}]\nplugin: []",
        'Entry contains unrecognized entry(s) {"plugin"} (in model "robot")',
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_error_message(files, case):
    model, text = ERRORS[case]
    with pytest.raises(YamlError) as caught:
        files.load_model(model)
    # The position follows the text.
    position = f" [{files.folder}/robot.model.yaml:"
    assert str(caught.value).startswith(f"Flatland YAML: {text}{position}")


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
    circle, polygon = base.fixtures
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


def test_a_footprint_without_layers_has_no_category_bits(files):
    world = files.load_model(body(footprint="type: circle, radius: 1, density: 1, layers: []"))
    (fixture,) = world.model("robot").body("base").fixtures
    assert (fixture.category_bits, fixture.mask_bits) == (0, 0)


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


def test_the_ends_of_a_joint_can_have_other_keys(files):
    end = "bodies: [{name: base, anchor: [0, 0], side: left}, {name: wheel, anchor: [0, 0], n: []}]"
    world = files.load_model(joint(f"type: weld, {end}"))
    assert [body.name for body in world.model("robot").joint("J").bodies] == ["base", "wheel"]


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
