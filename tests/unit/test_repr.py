"""How worlds, models and scans are displayed in interactive sessions."""

from __future__ import annotations

import doctest
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pages import code_blocks

import flatland


def test_the_sessions_of_the_documentation_have_the_documented_output(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(checkout)
    sessions = code_blocks((checkout / "docs" / "python.md").read_text(), "pycon")
    assert sessions
    for session in sessions:
        test = doctest.DocTestParser().get_doctest(session, {}, "docs/python.md", None, 0)
        report: list[str] = []
        results = doctest.DocTestRunner().run(test, out=report.append)
        assert results.attempted > 0
        assert results.failed == 0, "".join(report)


def test_a_world_names_its_file_and_time(files: Any) -> None:
    world = files.load(
        """
        properties: {}
        layers: [{name: a}, {name: b}]
        models: [{name: robot, model: minimal.model.yaml}]
        """
    )
    world.step(3)
    folder = files.folder.name
    assert repr(world) == f"<World '{folder}/world.yaml' at 0.015 s, layers: 2, models: 1>"
    world.close()
    assert repr(world) == f"<World '{folder}/world.yaml', closed>"
    with flatland.World(seed=1) as without_file:
        assert repr(without_file) == "<World '' at 0.000 s, layers: 0, models: 0>"


def test_a_deleted_model_has_no_pose(files: Any) -> None:
    world = files.load("{properties: {}, layers: []}")
    model = world.spawn_model("minimal.model.yaml", "robot", pose=(1, -2, 0.5))
    assert repr(model) == "<Model 'robot' at (1.000, -2.000, 0.500), bodies: 1, plugins: 0>"
    world.delete_model("robot")
    assert repr(model) == "<Model 'robot', bodies: 1, plugins: 0>"


@pytest.mark.parametrize(
    ("ranges", "shortest"),
    [
        ([2.5, 1.25, 3.0], "min 1.250 m"),
        ([math.nan, 4.0, -math.inf, math.inf], "min 4.000 m"),
        ([math.nan, math.inf], "no hits"),
        ([], "no hits"),
    ],
)
def test_a_scan_has_its_shortest_range(ranges: list[float], shortest: str) -> None:
    scan = flatland.LaserScan(
        stamp=1_234_000_000,
        frame_id="r1_eye",
        angle_min=0.0,
        angle_max=1.0,
        angle_increment=0.5,
        time_increment=0.0,
        scan_time=0.0,
        range_min=0.0,
        range_max=20.0,
        ranges=np.array(ranges, np.float32),
        intensities=np.zeros(0, np.float32),
    )
    text = f"LaserScan({len(ranges)} beams, {shortest}, stamp 1.234 s, frame 'r1_eye')"
    assert repr(scan) == text


class TestNotebook:
    def test_a_world_is_an_image(self, files: Any) -> None:
        files.write_map("room", ["####", "#..#", "####"])
        world = files.load(
            "{properties: {}, layers: [{name: a, map: room.yaml, color: [1, 0, 0, 1]}]}"
        )
        data = world._repr_png_()
        assert data is not None
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert (image == (0, 0, 255)).all(axis=2).any()  # a red wall, in the order of OpenCV
        assert max(image.shape) <= 1000

    def test_a_closed_world_is_no_image(self, files: Any) -> None:
        world = files.load("{properties: {}, layers: []}")
        world.close()
        assert world._repr_png_() is None
