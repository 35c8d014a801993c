"""A tricycle for tests: bodies, joints and the parameters of its drive."""

from __future__ import annotations

_WHEEL = "footprints: [{type: circle, radius: 0.05, density: 1, layers: []}]"

WHEELBASE = 1.0
"""Distance of the rear axle from the front wheel, which is at the origin [m]."""

BODIES = f"""
- {{name: base, footprints: [{{type: circle, radius: 0.3, density: 100, layers: [2d]}}]}}
- {{name: front, {_WHEEL}}}
- {{name: left, pose: [-1, 0.4, 0], {_WHEEL}}}
- {{name: right, pose: [-1, -0.4, 0], {_WHEEL}}}
"""


def _joint(kind: str, wheel: str, anchor: str) -> str:
    ends = f"{{name: base, anchor: {anchor}}}, {{name: {wheel}, anchor: [0, 0]}}"
    return f"- {{type: {kind}, name: {wheel}_j, bodies: [{ends}]}}\n"


JOINTS = (
    _joint("revolute", "front", "[0, 0]")
    + _joint("weld", "left", "[-1, 0.4]")
    + _joint("weld", "right", "[-1, -0.4]")
)
DRIVE = (
    "type: TricycleDrive, name: drive, body: base, front_wheel_joint: front_j, "
    "rear_left_wheel_joint: left_j, rear_right_wheel_joint: right_j"
)
