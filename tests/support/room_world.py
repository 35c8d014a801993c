"""Files of a small world: a room of 10 m by 10 m, a robot and a ball."""

from __future__ import annotations

from pathlib import Path

MAP = "type: line_segments\ndata: walls.dat\nscale: 1.0\norigin: [0, 0, 0]\n"
WALLS = "-5 -5 5 -5\n5 -5 5 5\n5 5 -5 5\n-5 5 -5 -5\n"  # around (0, 0)
LAYER = "{name: 2d, map: map.yaml}"
BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"
BALL = f"bodies: [{BODY}]\n"
ROBOT = f"""
bodies: [{BODY}]
plugins:
  - {{type: DiffDrive, name: drive, body: base, pub_rate: 50}}
  - {{type: Laser, name: laser, body: base, range: 20, update_rate: 10,
     angle: {{min: -1.5, max: 1.5, increment: 0.5}}}}
"""


def write_room_world(
    folder: Path,
    models: str = "[]",
    plugins: str = "[]",
    layers: str = f"[{LAYER}]",
    properties: str = "{}",
    **files: str,
) -> Path:
    """Writes a world and returns its path.

    Args:
        folder: Where to write.
        models: Entry of the world file.
        plugins: The same.
        layers: The same.
        properties: The same.
        files: Further model files, by name without `.model.yaml`.
    """
    (folder / "map.yaml").write_text(MAP)
    (folder / "walls.dat").write_text(WALLS)
    for name, text in {"ball": BALL, "robot": ROBOT, **files}.items():
        (folder / f"{name}.model.yaml").write_text(text)
    path = folder / "world.yaml"
    path.write_text(
        f"properties: {properties}\nlayers: {layers}\nmodels: {models}\nplugins: {plugins}\n"
    )
    return path
