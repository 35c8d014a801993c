"""What all drives have in common: limits that can be changed while they drive."""

from __future__ import annotations

from typing import Any

import pytest
import tricycle

import flatland
from flatland import DynamicsLimits

BASE = "- {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
SIMPLE = {"bodies": BASE, "joints": ""}
WHEELS = {"bodies": tricycle.BODIES, "joints": tricycle.JOINTS}
DRIVES: dict[str, tuple[str, dict[str, str]]] = {
    "DiffDrive": ("type: DiffDrive, name: drive, body: base", SIMPLE),
    "OmniDrive": ("type: OmniDrive, name: drive, body: base", SIMPLE),
    "TricycleDrive": (f"{tricycle.DRIVE}, command: twist", WHEELS),
}


@pytest.mark.parametrize("kind", DRIVES)
def test_limits_can_be_changed(plugin_world: Any, kind: str) -> None:
    text, options = DRIVES[kind]
    world = plugin_world(f"- {{{text}, linear_dynamics: {{velocity_limit: 0.5}}}}", **options)
    (model,) = world.models
    drive = next(plugin for plugin in model.plugins if plugin.type == kind)
    assert drive.linear_dynamics.velocity_limit == 0.5

    def speed() -> float:
        world.command("/cmd_vel").set(flatland.Twist(linear_x=2.0))
        world.step(2)
        return float(model.body("base").velocity[0])

    assert speed() == pytest.approx(0.5)
    drive.linear_dynamics = DynamicsLimits(velocity_limit=0.25)
    assert speed() == pytest.approx(0.25)
    assert drive.linear_dynamics.velocity_limit == 0.25
    drive.linear_dynamics = DynamicsLimits()
    assert speed() == pytest.approx(2.0)
