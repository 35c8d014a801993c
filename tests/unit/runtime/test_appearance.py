"""`World.set_appearance`: colours, layers and visibility of bodies at run time."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np
import pytest

import flatland

WORLD = """
properties: {}
layers:
  - {name: low}
  - {name: [high, top]}
models:
  - {name: robot, model: robot.yaml}
  - {name: box, model: box.yaml, pose: [3, 0, 0]}
"""
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.3, density: 1, layers: [low]}]}]
plugins:
  - type: Laser
    name: eye
    body: base
    layers: [high]
    range: 9
    angle: {min: 0, max: 0, increment: 1}
"""
BOX = """
bodies:
  - name: base
    color: [1, 0, 0, 0.25]
    footprints:
      - {type: polygon, points: [[-1, -1], [1, -1], [1, 1], [-1, 1]], density: 1, layers: [low]}
      - {type: circle, radius: 0.2, density: 1, layers: [low], collision: false}
  - name: lid
    footprints:
      - {type: circle, radius: 0.5, density: 1, layers: [low]}
      - {type: circle, radius: 0.1, density: 1, layers: []}
joints:
  - {type: weld, name: screw, bodies: [{name: base, anchor: [0, 0]}, {name: lid, anchor: [0, 0]}]}
"""


@pytest.fixture
def world(files: Any, log: Any) -> Any:
    files.write("robot.yaml", ROBOT)
    files.write("box.yaml", BOX)
    world = files.load(WORLD, observers=[log])
    log.events.clear()
    return world


def ahead(world: Any) -> float:
    """Returns the range of the beam towards the box, infinity if nothing is hit."""
    scan = world.output("/scan")
    world.step()
    return float(scan.latest.ranges[0])


def appearance(world: Any) -> list[Any]:
    return [
        (body.color, body.visible, [(f.category_bits, f.mask_bits) for f in body.fixtures])
        for body in world.model("box").bodies
    ]


def test_colours_and_visibility_of_one_body_and_of_all(world: Any, log: Any) -> None:
    base, lid = world.model("box").bodies
    world.set_appearance("box", "base", color=[0, 1, 0])
    assert base.color == (0, 1, 0, 0.25)
    assert lid.color == (1, 1, 1, 0.5)
    world.set_appearance("box", color=np.array([0.25, 0.5, 0.75, 1]), visible=False)
    assert base.color == lid.color == (0.25, 0.5, 0.75, 1)
    assert (base.visible, lid.visible) == (False, False)
    world.set_appearance("box", "lid", visible=True)
    assert (base.visible, lid.visible) == (False, True)
    assert lid.color == (0.25, 0.5, 0.75, 1)
    assert log.events == ["model_changed box"] * 3


def test_a_hidden_body_is_hit(world: Any) -> None:
    """tests/unit/scene/test_description.py shows that it is not drawn."""
    world.set_appearance("box", layers="high", visible=False)
    assert ahead(world) == pytest.approx(2, abs=1e-5)


def test_layers_change_what_lasers_detect(world: Any) -> None:
    assert not math.isfinite(ahead(world))
    world.set_appearance("box", "base", layers=["high"])
    assert ahead(world) == pytest.approx(2, abs=1e-5)
    world.set_appearance("box", "base", layers=["low"])
    assert not math.isfinite(ahead(world))
    world.set_appearance("box", "base", layers=["all"])
    assert ahead(world) == pytest.approx(2, abs=1e-5)


def test_layers_change_what_bodies_collide_with(
    world: Any, caplog: pytest.LogCaptureFixture
) -> None:
    world.set_appearance("box", layers=["high", "top"])
    assert appearance(world) == [
        ((1, 0, 0, 0.25), True, [(6, 6), (6, 0)]),
        ((1, 1, 1, 0.5), True, [(6, 6), (0, 0)]),
    ]
    world.move_model("robot", (3, 0, 0))
    world.step(500)
    assert caplog.text == ""
    assert world.model("robot").pose == (3, 0, 0)
    assert world.contacts == []
    # Both are asleep now.
    assert not any(body.awake for model in world.models for body in model.bodies)
    with caplog.at_level(logging.WARNING):
        world.set_appearance("box", layers=["low"])
    assert 'model "box" overlaps model "robot" at (3.000, 0.000, 0.000)' in caplog.text
    world.step(200)
    assert math.dist(world.model("robot").pose[:2], world.model("box").pose[:2]) > 1.2


def test_contacts_end_when_the_layers_differ(world: Any) -> None:
    touches = world.model("robot").watch_contacts()
    world.move_model("robot", (1.75, 0, 0), if_blocked="allow")
    world.step()
    assert touches.touched
    world.set_appearance("robot", layers=["high"])
    world.step()
    assert world.contacts == []
    touches.clear()
    world.step(5)
    assert not touches.touched


LAYERS = r"layers of the world: low, high, top"
INVALID = "color must be [r, g, b] or [r, g, b, a], each from 0 to 1, got "


@pytest.mark.parametrize(
    ("arguments", "text", "hint"),
    [
        ({"model": "bx"}, 'model, model with name "bx" does not exist', 'did you mean "box"?'),
        ({"body": "lit"}, 'body with name "lit" does not exist', 'did you mean "lid"?'),
        ({"body": "7"}, 'body with name "7" does not exist', "bodies of the model: base, lid"),
        ({"layers": ["low", "lower"]}, "{lower} layer(s) does not exist", 'did you mean "low"?'),
        ({"layers": ["low", "3d"]}, "{3d} layer(s) does not exist", LAYERS),
        ({"layers": []}, "layers must contain at least one name", ""),
        ({"color": [0, 0]}, INVALID + "[0, 0]", ""),
        ({"color": [0, 0, math.nan]}, INVALID + "[0.0, 0.0, nan]", ""),
        ({"color": [0, 0, 0, 1.5]}, INVALID + "[0.0, 0.0, 0.0, 1.5]", ""),
        ({"color": [0, -1, 0, 1]}, INVALID + "[0.0, -1.0, 0.0, 1.0]", ""),
        ({"color": "red"}, INVALID + "'red'", ""),
    ],
)
def test_invalid_requests_change_nothing(
    world: Any, log: Any, arguments: dict[str, Any], text: str, hint: str
) -> None:
    before = appearance(world)
    valid = {"model": "box", "color": [0, 0, 0, 1], "layers": ["high"], "visible": False}
    with pytest.raises(flatland.WorldError) as caught:
        world.set_appearance(**(valid | arguments))
    assert text in str(caught.value)
    assert str(caught.value).startswith("Flatland World: failed to change the appearance of model")
    assert caught.value.hint == hint
    assert appearance(world) == before
    assert log.events == []


def test_a_reset_returns_to_the_model_file(world: Any) -> None:
    before, loaded = appearance(world), world.state_hash()
    world.set_appearance("box", color=[0, 0, 0, 1], layers=["high"], visible=False)
    world.reset()
    assert (appearance(world), world.state_hash()) == (before, loaded)


def test_snapshots_and_clones_contain_the_appearance(world: Any, log: Any) -> None:
    snapshot, before = world.snapshot(), appearance(world)
    world.set_appearance("box", color=[0, 0, 0, 1], layers=["high"], visible=False)
    changed, after = world.snapshot(), appearance(world)
    with world.clone() as clone:
        assert appearance(clone) == after
        clone.set_appearance("box", visible=True)
        assert appearance(world) == after
    log.events.clear()
    world.restore(snapshot)
    assert appearance(world) == before
    assert log.events == ["model_changed box"]
    world.restore(changed)
    assert appearance(world) == after
    world.restore(changed)
    assert log.events == ["model_changed box"] * 2
