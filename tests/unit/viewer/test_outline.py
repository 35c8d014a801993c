"""Outlines of models that are not spawned yet."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import flatland
from flatland.viewer.outline import reach, read_outline

MODEL = """
bodies:
  - name: base
    pose: [1, 0, '$eval param("turn", 0)']
    color: [0.25, 0.5, 0.75, 0.5]
    footprints:
      - {type: polygon, density: 1, layers: [nowhere], points: [[0, 0], [2, 0], [2, 1]]}
  - {name: empty, footprints: []}
  - name: wheel
    footprints: [{type: circle, density: 1, center: [0, 1], radius: 0.5}]
plugins: [{name: p, type: NoSuchPlugin}]
"""


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "model.yaml"
    path.write_text(MODEL)
    return str(path)


def test_outline_of_each_body(model: str) -> None:
    base, wheel = read_outline(model)
    assert base.color == (0.25, 0.5, 0.75, 0.5)
    sides = {tuple(map(tuple, side)) for side in base.segments.reshape(-1, 2, 2).tolist()}
    assert sides == {((1, 0), (3, 0)), ((3, 0), (3, 1)), ((3, 1), (1, 0))}
    assert np.hypot(*(wheel.segments - (0, 1)).T) == pytest.approx(0.5)
    assert len(wheel.segments) == 64
    assert reach([base, wheel]) == pytest.approx(math.sqrt(10))
    assert reach([]) == 0.0


def test_outline_asks_for_parameters(model: str) -> None:
    base, _ = read_outline(model, {"turn": math.pi / 2}.get)
    assert base.segments.min(axis=0) == pytest.approx((0, 0), abs=1e-6)
    assert base.segments.max(axis=0) == pytest.approx((1, 2), abs=1e-6)


def test_bad_model_is_told(tmp_path: Path) -> None:
    with pytest.raises(flatland.YamlError, match=r"missing\.yaml"):
        read_outline(str(tmp_path / "missing.yaml"))
    path = tmp_path / "bad.yaml"
    path.write_text("bodies: [{name: b, footprints: [{type: square}]}]\n")
    with pytest.raises(flatland.YamlError, match=r'model "crate".*support footprints are'):
        read_outline(str(path), name="crate")
