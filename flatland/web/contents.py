"""The latest layers, models and poses of one world, and the messages made from them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray, FloatArray, bounds_of
from flatland.scene.description import LayerDescription
from flatland.web import encoding
from flatland.web.capture import CapturedWorld
from flatland.web.encoding import Head, text_message
from flatland.web.model_tracker import Json, ModelChanges
from flatland.web.views import Received

_MAX_REMOVED: Final = 1000  # removed models whose ids are kept


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    description: LayerDescription
    edges: FloatArray  # in the world frame
    version: int  # number of these edges, unique in the world


class WorldContents:
    """The latest layers, models and poses of one world.

    Attributes:
        name: Name of the world for users.
        model_files: Label and path of the model files that can be spawned.
        tick: Number of the last capture, 0 before the first one.
    """

    def __init__(self, index: int, name: str) -> None:
        """Creates the contents of a world that has not been captured.

        Args:
            index: Index of the world in messages.
            name: Name of the world for users.
        """
        self.name = name
        self.model_files: list[dict[str, str]] = []
        self.tick = 0
        self._revision = 0  # number of changes of layers and models
        self._index = index
        self._time = 0.0  # s, simulated
        self._step_size, self._lockstep = 0.0, False
        self._layers: list[_Layer] = []
        self._lines: dict[str, LayerDescription] = {}
        self._world_version = 0
        self._edges_version = 0
        self._models: dict[int, tuple[int, Json]] = {}  # revision and description
        self._removed: deque[tuple[int, int]] = deque(maxlen=_MAX_REMOVED)  # revision and id
        self._forgotten = 0  # the last revision whose removals are not in `_removed`
        self._body_ids = np.empty(0, np.uint32)
        self._poses = np.empty((0, 3), np.float32)
        self._changed = np.empty(0, np.int64)  # number of the capture in which each pose changed
        # Rows of the poses that changed in the capture `_moved_tick`, and the version of this
        # selection.
        self._moved = np.empty(0, np.intp)
        self._moved_tick = 0
        self._moved_version = 0
        # The encoded poses of the selection, with and without the ids of the bodies.
        self._shared: dict[bool, bytes] = {}

    # -- captures --------------------------------------------------------------------------

    def set_lines(self, lines: LayerDescription) -> None:
        """Adds lines to the layers of the next capture; replaces lines of the same name."""
        self._lines[lines.name] = lines

    def apply(self, captured: CapturedWorld) -> None:
        """Replaces the contents by those of a capture."""
        self.tick += 1
        self._time = captured.time
        self._step_size, self._lockstep = captured.step_size, captured.lockstep
        if captured.layers is not None:
            self._apply_layers([*captured.layers, *self._lines.values()])
        if captured.changes.layout:
            self._apply_models(captured.changes)
        self._apply_poses(captured.motions)

    def laser_ids(self) -> set[int]:
        """Returns the ids of the lasers of all models."""
        return {laser["id"] for _, model in self._models.values() for laser in model["lasers"]}

    def _apply_layers(self, layers: list[LayerDescription]) -> None:
        former = {layer.description.name: layer for layer in self._layers}
        self._world_version += 1
        self._revision += 1
        self._layers = []
        for description in layers:
            edges = description.world_edges().astype(np.float32)
            known = former.get(description.name)
            if known is not None and np.array_equal(known.edges, edges):
                version = known.version
            else:
                self._edges_version += 1
                version = self._edges_version
            self._layers.append(_Layer(description, edges, version))

    def _apply_models(self, changes: ModelChanges) -> None:
        self._revision += 1
        for number in changes.removed:
            self._models.pop(number, None)
            if len(self._removed) == _MAX_REMOVED:
                self._forgotten = self._removed[0][0]
            self._removed.append((self._revision, number))
        for number, description in changes.described.items():
            self._models[number] = (self._revision, description)
        self._body_ids = np.array(changes.body_ids, np.uint32)
        self._poses = np.full((len(changes.body_ids), 3), np.nan, np.float32)
        self._changed = np.full(len(changes.body_ids), self.tick, np.int64)
        self._moved = np.empty(0, np.intp)

    def _apply_poses(self, motions: DoubleArray) -> None:
        poses = motions[:, :3].astype(np.float32)
        moved = np.flatnonzero((poses != self._poses).any(axis=1))
        if not len(moved):
            return
        self._changed[moved] = self._moved_tick = self.tick
        self._poses = poses
        self._shared.clear()
        if len(moved) != len(self._moved) or (moved != self._moved).any():
            self._moved = moved
            self._moved_version += 1

    # -- messages --------------------------------------------------------------------------

    @property
    def head(self) -> Head:
        """Header of binary messages about the last capture."""
        return Head(self._index, self._revision, self._time)

    def next_contents(self, received: Received) -> str | bytes | None:
        """Returns the next message about layers and models, None if a client has received all.

        Args:
            received: What the client has received; updated.
        """
        if received.world < self._world_version:
            received.world = self._world_version
            return self._world_message()
        for number, layer in enumerate(self._layers):
            if received.layers.get(number) != layer.version:
                received.layers[number] = layer.version
                return encoding.edges_message(self.head, number, layer.edges)
        if received.models < self._revision:
            since, received.models = received.models, self._revision
            return self._models_message(since)
        return None

    def next_poses(self, received: Received) -> bytes | None:
        """Returns the poses that a client has not received, None if there are none.

        Args:
            received: What the client has received; updated.
        """
        if received.poses >= self.tick:
            return None
        since, received.poses = received.poses, self.tick
        if since < self.tick - 1:
            moved = np.flatnonzero(self._changed > since)
            return self._poses_message(moved, with_ids=True) if len(moved) else None
        if self._moved_tick < self.tick:
            return None
        # Most clients have received the previous poses; the encoded message is shared by them.
        with_ids = received.bodies != self._moved_version
        received.bodies = self._moved_version
        message = self._shared.get(with_ids)
        if message is None:
            message = self._shared[with_ids] = self._poses_message(self._moved, with_ids)
        return message

    def _world_message(self) -> str:
        points = [layer.edges.reshape(-1, 2) for layer in self._layers]
        points.append(self._poses[:, :2])
        bounds = bounds_of(np.concatenate(points).astype(np.float64))
        return text_message(
            {
                "type": "world",
                "world": self._index,
                "name": self.name,
                "revision": self._revision,
                "bounds": None if bounds is None else list(bounds),
                "step_size": self._step_size,
                "lockstep": self._lockstep,
                "layers": [
                    {
                        "name": layer.description.name,
                        "color": list(layer.description.color),
                        "edges": len(layer.edges),
                    }
                    for layer in self._layers
                ],
                "model_files": self.model_files,
            }
        )

    def _models_message(self, since: int) -> str:
        complete = since < self._forgotten or since < 0
        return text_message(
            {
                "type": "models",
                "world": self._index,
                "revision": self._revision,
                "complete": complete,
                "models": [
                    description
                    for revision, description in self._models.values()
                    if complete or revision > since
                ],
                "removed": []
                if complete
                else [number for revision, number in self._removed if revision > since],
            }
        )

    def _poses_message(self, rows: npt.NDArray[np.intp], with_ids: bool) -> bytes:
        ids = self._body_ids[rows] if with_ids else None
        return encoding.poses_message(self.head, self._poses[rows], ids)
