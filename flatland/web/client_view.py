"""What one client looks at, and what it has received."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class View:
    """What one client looks at in all of its worlds.

    Attributes:
        scans: Whether to send laser scans.
        frames: Whether to send the transforms of frames.
        inspect: Id of the model that is inspected, None for none.
        series: Names of the numbers that are plotted.
    """

    scans: bool = False
    frames: bool = False
    inspect: int | None = None
    series: tuple[str, ...] = ()


@dataclass(slots=True)
class Seen:
    """What one client has received of one world; numbers of versions, initially none.

    Attributes:
        world: Version of the message `world`.
        layers: Version of the edges of each layer.
        models: Revision of the models.
        poses: Number of the capture.
        bodies: Version of the selection of bodies whose poses were received in time.
        scans: Number of the capture.
        status: Version of the status.
        details: Number of the capture.
        frames: Number of the capture.
        values: Number of the capture.
    """

    world: int = -1
    layers: dict[int, int] = field(default_factory=dict)
    models: int = -1
    poses: int = -1
    bodies: int = -1
    scans: int = -1
    status: int = -1
    details: int = -1
    frames: int = -1
    values: int = -1
