"""Outlines of model files, read without spawning the model."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import flatland
from flatland.viewer.outline import max_radius, read_outline

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


def test_one_outline_per_body_with_footprints(model: str) -> None:
    base, wheel = read_outline(model)
    assert base.color == (0.25, 0.5, 0.75, 0.5)
    edges = {tuple(map(tuple, edge)) for edge in base.segments.reshape(-1, 2, 2).tolist()}
    assert edges == {((1, 0), (3, 0)), ((3, 0), (3, 1)), ((3, 1), (1, 0))}
    assert np.hypot(*(wheel.segments - (0, 1)).T) == pytest.approx(0.5)
    assert len(wheel.segments) == 64
    assert max_radius([base, wheel]) == pytest.approx(math.sqrt(10))
    assert max_radius([]) == 0.0


def test_param_is_evaluated(model: str) -> None:
    base, _ = read_outline(model, {"turn": math.pi / 2}.get)
    assert base.segments.min(axis=0) == pytest.approx((0, 0), abs=1e-6)
    assert base.segments.max(axis=0) == pytest.approx((1, 2), abs=1e-6)


def test_invalid_model_file_raises(tmp_path: Path) -> None:
    with pytest.raises(flatland.YamlError, match=r"missing\.yaml"):
        read_outline(str(tmp_path / "missing.yaml"))
    path = tmp_path / "bad.yaml"
    path.write_text("bodies: [{name: b, footprints: [{type: square}]}]\n")
    with pytest.raises(flatland.YamlError, match=r'model "crate".*support footprints are'):
        read_outline(str(path), name="crate")
