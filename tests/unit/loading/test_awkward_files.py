"""Worlds whose files are unusual but accepted by the reference."""

from __future__ import annotations

import logging

import pytest

import flatland

AWKWARD = {
    "world.yaml": b"""\
properties: {}\t# caf\xe9
\t
layers:
\t# the walls
  - name: walls
    map: map.yaml
    map: nowhere.yaml
  - {name: lines, map: lines.yaml}
 \t
models:
  - {name: robot, model: robot.model.yaml, namespace: r1/, pose: [5, 5, 0]}
""",
    "map.yaml": b"""\
# gr\xfcn
type: indoor
image: map.png
resolution: 0.5
origin: [0, 0, 0]
occupied_thresh: 0.65
floor: {level: 3}
\t
""",
    "lines.yaml": b"""\
type: line_segments
data: lines.dat
scale: 1
origin: [0, 0, 0]
\t# \xb5
building: A
""",
    "lines.dat": b"# \xe4\n0 0\t4 0\n",
    "robot.model.yaml": b"""\
bodies:
  - name: base
    footprints:
\t
      - {type: circle, radius: 0.2, density: 1}
  - {name: wheel, footprints: []}
joints:
  - type: weld
    name: axle
    bodies:
      - {name: base, anchor: [0, 0], side: left}
      -\t# \xff
        {name: wheel, anchor: [0, 0], side: left}
plugins:
  - {type: DiffDrive, name: drive, body: base, twist_sub: base//cmd_vel/, body: wheel}
""",
}


@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"], ids=["plain", "byte order mark"])
@pytest.mark.parametrize("line_end", [b"\n", b"\r\n"], ids=["LF", "CRLF"])
def test_awkward_files_load_as_in_the_reference(files, caplog, start, line_end):
    files.write_map("map", ["   ", " # ", "   "])
    for name, content in AWKWARD.items():
        (files.folder / name).write_bytes(start + content.replace(b"\n", line_end))
    with flatland.World.from_yaml(files.folder / "world.yaml", seed=1) as world:
        assert [len(layer.edges) for layer in world.layers] == [4, 1]
        assert [layer.unknown_map_keys for layer in world.layers] == [("floor",), ("building",)]
        robot = world.model("robot")
        assert [body.name for body in robot.joint("axle").bodies] == ["base", "wheel"]
        world.command("/r1/base/cmd_vel").set(flatland.Twist(1.0))
        world.step(200)
        assert robot.body("base").pose == pytest.approx((6, 5, 0), abs=0.1)
    warnings = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
    assert warnings == [
        f'Duplicate key "map" ignored, the value in line 6 is used [{files.folder}/world.yaml:7]',
        f'Duplicate key "body" ignored, the value in line 15 is used '
        f"[{files.folder}/robot.model.yaml:15]",
    ]


def test_a_topic_of_two_types_is_an_error_that_names_both_plugins(files):
    with pytest.raises(flatland.PluginError) as caught:
        files.load_model(
            """
            bodies: [{name: base, footprints: []}]
            plugins:
              - {type: DiffDrive, name: drive, body: base, odom_pub: /state/}
              - {type: Bumper, name: bumper, topic: //state}
            """
        )
    assert str(caught.value) == (
        'Flatland plugin: Model Plugin "bumper" type "Bumper" model "robot": topic "/state" already'
        ' carries Odometry, used by Model Plugin "drive" type "DiffDrive" model "robot", not '
        f"Collisions [{files.folder}/robot.model.yaml:5]"
    )
