"""A model file without a world file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import flatland
from flatland.errors import YamlError
from flatland.loading.model_check import is_model_file, load_model_alone

FOOTPRINT = "{{type: circle, radius: 0.2, density: 1, layers: [{}]}}"


@pytest.mark.parametrize(
    ("text", "is_model"),
    [
        ("{bodies: []}", True),
        ("{properties: {}, layers: []}", False),
        ("{bodies: [], layers: []}", False),
        ("{bodies: [], properties: {}}", False),
    ],
)
def test_a_model_file_has_bodies_and_nothing_of_a_world(
    files: Any, text: str, is_model: bool
) -> None:
    assert is_model_file(Path(files.write("a.yaml", text)), {}) is is_model


def test_warnings_are_left_to_the_one_who_loads_the_file(
    files: Any, caplog: pytest.LogCaptureFixture
) -> None:
    assert is_model_file(Path(files.write("a.yaml", "bodies: []\n---\nbodies: []")), {})
    assert caplog.records == []


def test_the_world_of_an_invalid_file_is_closed(files: Any) -> None:
    created = []

    class Recorded(flatland.World):
        def __init__(self, **options: Any) -> None:
            super().__init__(**options)
            created.append(self)

    with pytest.raises(YamlError):
        load_model_alone(Recorded, Path(files.write("cart.model.yaml", "bodies: []")), {})
    (world,) = created
    assert world.closed


def test_layers_are_those_that_the_model_refers_to(files: Any) -> None:
    footprints = ", ".join(FOOTPRINT.format(layers) for layers in ("2d, 3d", "2d", "all"))
    path = files.write("cart.model.yaml", f"bodies: [{{name: base, footprints: [{footprints}]}}]")
    with load_model_alone(flatland.World, Path(path), {}) as world:
        assert world.model("cart").bodies[0].name == "base"
        assert list(world.collision_filter.names) == ["2d", "3d"]
        assert world.layers == []
        assert world.seed == 0


def test_a_model_refers_to_at_most_as_many_layers_as_a_world_has(files: Any) -> None:
    def load(count: int) -> None:
        names = ", ".join(f"layer{number}" for number in range(count))
        footprint = FOOTPRINT.format(names)
        path = files.write("a.yaml", f"bodies: [{{name: base, footprints: [{footprint}]}}]")
        load_model_alone(flatland.World, Path(path), {}).close()

    load(16)
    with pytest.raises(YamlError, match=r"Model refers to 17 layers \{layer0, layer1, .*layer16\}"):
        load(17)
