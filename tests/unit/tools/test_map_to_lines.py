"""Conversion of image maps to maps of line segments."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from full_disk import REASON, limited_files
from programs import run_program

from flatland.maps.line_segments import read_line_segments
from flatland.tools.map_to_lines import main

ROWS, COLUMNS = 100, 150


@pytest.fixture
def image_map(tmp_path: Path) -> Path:
    """A map of a room, 80 x 60 pixels, 30 pixels from the left and 10 from the bottom edge."""
    folder = tmp_path / "in"
    folder.mkdir()
    image = np.full((ROWS, COLUMNS), 205, np.uint8)
    image[30:90, 30:110] = 0
    image[32:88, 32:108] = 254
    cv2.imwrite(str(folder / "room.png"), image)
    path = folder / "room.yaml"
    path.write_text(
        "image: room.png\nresolution: 0.05\norigin: [-1.5, 2.25, 0.5]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_output_files_and_messages(image_map, out, capsys):
    assert main([str(image_map), str(out)]) == 0
    assert names(out) == {"map_lines.yaml", "map_lines.dat"}
    assert yaml.safe_load((out / "map_lines.yaml").read_text()) == {
        "type": "line_segments",
        "data": "map_lines.dat",
        "scale": 0.05,
        "origin": [-1.5, 2.25, 0.5],
    }
    segments = read_line_segments(str(out / "map_lines.dat"))
    captured = capsys.readouterr()
    assert str(image_map) in captured.out
    assert "room.png, 150 x 100 pixels" in captured.out
    assert f"{out / 'map_lines.dat'}: {len(segments)} line segments" in captured.out
    assert captured.err == ""


def test_an_image_may_have_any_other_type(image_map, out):
    image_map.write_text(image_map.read_text() + "type: indoor\n")
    assert main([str(image_map), str(out)]) == 0


def test_threshold_separates_on_and_off_pixels(image_map, out):
    # At 0.9 the grey pixels around the room are off, too, and only the inner boundary remains.
    image_map.write_text(image_map.read_text().replace("0.65", "0.9"))
    assert main([str(image_map), str(out)]) == 0
    segments = read_line_segments(str(out / "map_lines.dat"))
    inside = np.abs(segments[:, ::2] - 75).max(axis=1) < 60
    # The detector of OpenCV 4.6 finds 31.9, that of OpenCV 4.10 finds 31.4.
    assert segments[inside][:, ::2].min() == pytest.approx(32, abs=0.75)


def test_name_and_overlay_image(image_map, out):
    assert main([str(image_map), str(out), "-f", "walls", "-i"]) == 0
    assert names(out) == {"walls.yaml", "walls.dat", "walls.png"}
    assert yaml.safe_load((out / "walls.yaml").read_text())["data"] == "walls.dat"
    image = cv2.imread(str(out / "walls.png"))
    assert image.shape == (ROWS, COLUMNS, 3)
    red = (image[:, :, 2].astype(int) - image[:, :, 1]) > 60
    # Outer boundary of the left wall.
    assert red[40:80, 29:31].any(axis=1).all()
    assert not red[40:80, 50:100].any()
    # Pixels beside the lines are those of the map.
    assert (image[5, 5] == 205).all()


def test_higher_level_of_detail_yields_more_segments(image_map, out):
    image = cv2.imread(str(image_map.parent / "room.png"), 0)
    rng = np.random.default_rng(1)
    for x, y in rng.integers((35, 35), (100, 80), (25, 2)):
        image[y : y + 3, x : x + 3] = 0
    cv2.imwrite(str(image_map.parent / "room.png"), image)
    counts = {}
    for detail in ("low", "med", "high"):
        assert main([str(image_map), str(out), "-d", detail, "-f", detail]) == 0
        counts[detail] = len(read_line_segments(str(out / f"{detail}.dat")))
    assert counts["low"] < counts["med"] < counts["high"]
    # The default is "med".
    assert main([str(image_map), str(out)]) == 0
    assert (out / "map_lines.dat").read_text() == (out / "med.dat").read_text()


@pytest.mark.parametrize("existing", ["map_lines.yaml", "map_lines.dat", "map_lines.png"])
def test_existing_file_is_not_overwritten_without_force(image_map, out, existing, capsys):
    (out / existing).write_text("existing")
    assert main([str(image_map), str(out), "-i"]) == 1
    assert names(out) == {existing}
    assert (out / existing).read_text() == "existing"
    captured = capsys.readouterr()
    assert str(out / existing) in captured.err
    assert "--force" in captured.err
    assert main([str(image_map), str(out), "-i", "--force"]) == 0
    assert (out / existing).read_bytes() != b"existing"


def test_a_full_disk_leaves_no_file(image_map, out, capsys):
    # Before the image, which is the largest file.
    assert main([str(image_map), str(out), "-i"]) == 0
    capsys.readouterr()
    sizes = sorted((out / name).stat().st_size for name in names(out))
    for size in (sizes[0] - 1, sizes[-1] - 1):
        for name in names(out):
            (out / name).write_text("old")
        with limited_files(size):
            assert main([str(image_map), str(out), "-i", "--force"]) == 1
        captured = capsys.readouterr()
        assert f"{REASON}: '{out}/map_lines." in captured.err
        assert "Wrote" not in captured.out
        assert {(out / name).read_text() for name in names(out)} == {"old"}


def test_existing_image_is_no_conflict_without_image_option(image_map, out):
    (out / "map_lines.png").write_text("existing")
    assert main([str(image_map), str(out)]) == 0
    assert (out / "map_lines.png").read_text() == "existing"


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("resolution", "resolutions", 'Entry "resolution" does not exist'),
        ("room.png", "rooms.png", "rooms.png"),
        ("room.png", "room.yaml", 'Failed to load "'),
        ("0.05", "0", 'Invalid "resolution", must be greater than 0'),
        ("0.05", "wide", 'Error converting entry "resolution" to float'),
        ("[-1.5, 2.25, 0.5]", "[.nan, 0, 0]", 'Invalid "origin", must be finite'),
        ("negate: 0", "type: line_segments", "The map must be an image map, not line segments"),
        ("negate: 0", "negate: [", "Malformatted file"),
    ],
)
def test_invalid_map(image_map, out, old, new, text, capsys):
    image_map.write_text(image_map.read_text().replace(old, new))
    assert main([str(image_map), str(out)]) == 1
    assert text in capsys.readouterr().err
    assert names(out) == set()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["out/no.yaml", "out"], 'File does not exist, path="'),
        (["in/room.yaml", "out/no"], 'Folder does not exist, path="'),
        (["in/room.yaml", "out", "-f", "a/b"], 'must not contain a folder, got "a/b"'),
    ],
)
def test_invalid_paths(image_map, out, arguments, text, capsys, monkeypatch):
    monkeypatch.chdir(out.parent)
    assert main(arguments) == 1
    assert text in capsys.readouterr().err
    assert names(out) == set()


def test_map_without_walls(image_map, out, capsys):
    cv2.imwrite(str(image_map.parent / "room.png"), np.full((50, 50), 255, np.uint8))
    assert main([str(image_map), str(out)]) == 1
    assert 'No line segments found in "' in capsys.readouterr().err
    assert names(out) == set()


def test_unknown_detail(image_map, out, capsys):
    with pytest.raises(SystemExit, match="2"):
        main([str(image_map), str(out), "-d", "huge"])
    assert "huge" in capsys.readouterr().err


def test_script_in_another_folder(image_map, out, checkout):
    script = checkout / "scripts" / "map_to_lines.py"
    assert os.access(script, os.X_OK)
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    assert main([str(image_map), str(out)]) == 0
    again = run_program([sys.executable, script, image_map, "out"], cwd=out.parent, env=environment)
    assert again.returncode == 1
    assert again.stderr.startswith("map_to_lines.py: Flatland File: File exists")


def test_scan_in_the_converted_map(image_map, out, files):
    assert main([str(image_map), str(out)]) == 0
    files.write(
        "robot.model.yaml",
        """
        bodies: [{name: base, footprints: [{type: circle, radius: 0.1, density: 1}]}]
        plugins:
          - {type: Laser, name: l, body: base, range: 20,
             angle: {min: 0, max: 4.712389, increment: 1.570796}}
        """,
    )
    # In the centre of the room, heading along the x axis of the map.
    x, y = 70 * 0.05, 40 * 0.05
    c, s = math.cos(0.5), math.sin(0.5)
    pose = [-1.5 + c * x - s * y, 2.25 + s * x + c * y, 0.5]
    world = files.load(
        f"""
        properties: {{}}
        layers: [{{name: 2d, map: {out / "map_lines.yaml"}}}]
        models: [{{name: robot, model: robot.model.yaml, pose: {pose}}}]
        """
    )
    ranges = world.model("robot").plugin("l").compute_ranges()
    assert ranges == pytest.approx([1.9, 1.4, 1.9, 1.4], abs=0.05)
