"""Comparison of the edges of maps with those computed by the reference."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from flatland.config.inputs import Inputs
from flatland.maps.map_file import load_map


def undirected(edges: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Sorts the ends of each edge and then the edges."""

    def rounded(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(round(value, 4) for value in values)

    ordered = [
        sorted([(x1, y1), (x2, y2)], key=rounded) for x1, y1, x2, y2 in np.asarray(edges).tolist()
    ]
    return np.array(sorted(([*a, *b] for a, b in ordered), key=rounded))


@pytest.mark.parametrize(
    ("layer", "map_file"), [("walls", "walls.yaml"), ("low", "low.yaml"), ("lines", "lines.yaml")]
)
def test_edges_match_the_trace(golden_dir: Path, layer: str, map_file: str) -> None:
    trace = json.loads((golden_dir / "free.trace.json").read_text())
    expected = {entry["name"]: entry["edges"] for entry in trace["layers"]}[layer]
    layer_map = load_map(str(golden_dir / map_file), layer, inputs=Inputs())
    assert layer_map.edges.shape == (len(expected), 4)
    np.testing.assert_allclose(undirected(layer_map.edges), undirected(expected), rtol=0, atol=1e-5)
