"""The service `set_appearance` of a running node, and what its clients then receive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from visualization_msgs.msg import InteractiveMarkerInit, MarkerArray

from flatland.srv import SetAppearance, SetAppearanceRequest

KEEP, SHOW, HIDE = (getattr(SetAppearanceRequest, name) for name in ("KEEP", "SHOW", "HIDE"))
BLUE = [0.0, 0.0, 1.0, 0.75]
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: Laser, name: laser, body: base, range: 20, layers: [2d],
     angle: {min: 0, max: 0, increment: 1}}
"""
BOX = """
bodies:
  - name: base
    color: [1, 0, 0, 0.5]
    footprints: [{type: circle, radius: 0.5, density: 1}]
  - {name: lid, footprints: [{type: circle, radius: 0.25, density: 1}]}
"""
MODELS = (
    "[{name: r, model: robot.model.yaml, namespace: r, pose: [1, 1, 0]}, "
    "{name: box, model: box.model.yaml, pose: [3, 1, 0]}]"
)


@pytest.fixture(scope="module")
def world(write_world: Callable[..., Path]) -> Path:
    layers = "[{name: 2d, map: map.yaml}, {name: ghosts}]"
    return write_world(MODELS, layers=layers, box=BOX, robot=ROBOT)


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, world: Path) -> Any:
    return module_launcher.server(world, show_viz=True, lockstep=True)


@pytest.fixture(autouse=True)
def restore(ros: Any, server: Any) -> Iterator[None]:
    yield
    ros.reset()
    assert "Traceback" not in server.output


def change(ros: Any, model: str = "box", body: str = "", **fields: Any) -> Any:
    request = SetAppearanceRequest(model=model, body=body, **fields)
    return ros.call(
        "/set_appearance",
        SetAppearance,
        *(getattr(request, name) for name in SetAppearanceRequest.__slots__),
    )


def colors(markers: Any) -> list[list[float]]:
    return [[m.color.r, m.color.g, m.color.b, m.color.a] for m in markers if m.action == m.ADD]


def test_markers_and_handles_follow(ros: Any) -> None:
    markers = ros.topic("/flatland_server/debug/model/box", MarkerArray)
    combined = ros.topic("/flatland_server/debug/all_models", MarkerArray)
    handles = ros.topic("/interactive_model_markers/update_full", InteractiveMarkerInit)
    assert colors(markers.next().markers) == [[1, 0, 0, 0.5], [1, 1, 1, 0.5]]
    answer = change(ros, body="base", color=BLUE)
    assert (answer.success, answer.message) == (True, "")
    assert change(ros, body="lid", visible=HIDE).success
    markers.until(lambda message: colors(message.markers) == [BLUE])
    combined.until(lambda message: BLUE in colors(message.markers))

    def outlines(message: Any) -> list[list[float]]:
        handle = next(marker for marker in message.markers if marker.name == "box")
        return colors(handle.controls[-1].markers)[1:]  # the first one is the name

    handles.until(lambda message: outlines(message) == [BLUE])
    assert change(ros, body="lid", visible=SHOW).success
    markers.until(lambda message: colors(message.markers) == [BLUE, [1, 1, 1, 0.5]])
    handles.until(lambda message: outlines(message) == [BLUE, [1, 1, 1, 0.5]])
    ros.reset()
    markers.until(lambda message: colors(message.markers) == [[1, 0, 0, 0.5], [1, 1, 1, 0.5]])


def test_a_changed_model_can_be_deleted_before_its_handle_is_published(ros: Any) -> None:
    handles = ros.topic("/interactive_model_markers/update_full", InteractiveMarkerInit)
    handles.until(lambda message: "box" in [marker.name for marker in message.markers])
    assert change(ros, color=BLUE).success
    assert ros.delete("box").success
    handles.until(lambda message: "box" not in [marker.name for marker in message.markers])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"body": "lit"}, 'body with name "lit" does not exist (hint: did you mean "lid"?)'),
        ({"visible": 2}, "visible must be 0 (KEEP), 1 (SHOW) or -1 (HIDE), got 2"),
        ({}, ""),
    ],
)
def test_invalid_calls_and_default_fields_change_nothing(
    ros: Any, fields: dict[str, Any], message: str
) -> None:
    valid = {"color": [0.0, 0.0, 0.0, 1.0], "layers": ["ghosts"], "visible": HIDE}
    answer = change(ros, **(valid | fields if fields else {"visible": KEEP}))
    assert (answer.success, answer.message[-len(message) :]) == (not fields, message)
    markers = ros.topic("/flatland_server/debug/model/box", MarkerArray)
    assert colors(markers.next().markers) == [[1, 0, 0, 0.5], [1, 1, 1, 0.5]]
