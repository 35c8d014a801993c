"""The latest layers, models and poses of one world, and the messages made from them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from flatland.geometry import DoubleArray, FloatArray, bounds_of, transform_points
from flatland.web import encoding
from flatland.web.capture import Captured
from flatland.web.client_view import Seen
from flatland.web.encoding import text_message
from flatland.web.scene import Description, LayerContents, SceneChange

_MAX_REMOVED: Final = 1000  # removed models that are remembered


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    contents: LayerContents
    edges: FloatArray  # in the world frame
    version: int  # that no other edges have


class WorldState:
    """The latest layers, models and poses of one world.

    Attributes:
        name: Name of the world for users.
        model_files: Label and path of the model files that can be spawned.
        revision: Number of changes of layers and models.
        tick: Number of the last capture, 0 before the first one.
        time: Simulated time of the last capture [s].
    """

    def __init__(self, index: int, name: str) -> None:
        """Creates a state of a world that has not been captured.

        Args:
            index: Index of the world in messages.
            name: Name of the world for users.
        """
        self.name = name
        self.model_files: list[dict[str, str]] = []
        self.revision = self.tick = 0
        self.time = 0.0
        self._index = index
        self._step_size, self._lockstep = 0.0, False
        self._layers: list[_Layer] = []
        self._lines: dict[str, LayerContents] = {}
        self._world_version = 0
        self._edges_version = 0
        self._models: dict[int, tuple[int, Description]] = {}
        self._removed: deque[tuple[int, int]] = deque(maxlen=_MAX_REMOVED)
        self._forgotten = 0  # models that were removed before this revision are not remembered
        self._body_ids = np.empty(0, np.uint32)
        self._poses = np.empty((0, 3), np.float32)
        self._changed = np.empty(0, np.int64)  # the capture in which each pose changed
        self._moved = np.empty(0, np.intp)  # the poses that changed in the last such capture
        self._moved_tick = 0  # of this capture
        self._moved_version = 0  # number of changes of this selection
        # Its poses as messages with and without the ids of the bodies, once they are encoded.
        self._shared: dict[bool, bytes] = {}

    # -- captures --------------------------------------------------------------------------

    def draw(self, lines: LayerContents) -> None:
        """Shows lines after the next capture of layers, instead of others of the same name."""
        self._lines[lines.name] = lines

    def apply(self, captured: Captured) -> None:
        """Takes over a captured state."""
        self.tick += 1
        self.time = captured.time
        self._step_size, self._lockstep = captured.step_size, captured.lockstep
        if captured.layers is not None:
            self._apply_layers([*captured.layers, *self._lines.values()])
        if captured.change.layout:
            self._apply_models(captured.change)
        self._apply_poses(captured.motions)

    def laser_ids(self) -> set[int]:
        """Returns the ids of the lasers of all models."""
        return {laser["id"] for _, model in self._models.values() for laser in model["lasers"]}

    def _apply_layers(self, layers: list[LayerContents]) -> None:
        former = {layer.contents.name: layer for layer in self._layers}
        self._world_version += 1
        self.revision += 1
        self._layers = []
        for contents in layers:
            points = contents.edges.astype(np.float64).reshape(-1, 2)
            edges = transform_points(contents.pose, points).reshape(-1, 4).astype(np.float32)
            known = former.get(contents.name)
            if known is not None and np.array_equal(known.edges, edges):
                version = known.version
            else:
                self._edges_version += 1
                version = self._edges_version
            self._layers.append(_Layer(contents, edges, version))

    def _apply_models(self, change: SceneChange) -> None:
        self.revision += 1
        for number in change.removed:
            self._models.pop(number, None)
            if len(self._removed) == _MAX_REMOVED:
                self._forgotten = self._removed[0][0]
            self._removed.append((self.revision, number))
        for number, description in change.described.items():
            self._models[number] = (self.revision, description)
        self._body_ids = np.array(change.body_ids, np.uint32)
        self._poses = np.full((len(change.body_ids), 3), np.nan, np.float32)
        self._changed = np.full(len(change.body_ids), self.tick, np.int64)
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

    def next_contents(self, seen: Seen) -> str | bytes | None:
        """Returns the next message about layers and models, None if a client has received all.

        Args:
            seen: What the client has received; updated.
        """
        if seen.world < self._world_version:
            seen.world = self._world_version
            return self._world_message()
        for number, layer in enumerate(self._layers):
            if seen.layers.get(number) != layer.version:
                seen.layers[number] = layer.version
                return encoding.edges_message(
                    self._index, self.revision, self.time, number, layer.edges
                )
        if seen.models < self.revision:
            since, seen.models = seen.models, self.revision
            return self._models_message(since)
        return None

    def next_poses(self, seen: Seen) -> bytes | None:
        """Returns the poses that a client has not received, None without any.

        Args:
            seen: What the client has received; updated.
        """
        if seen.poses >= self.tick:
            return None
        since, seen.poses = seen.poses, self.tick
        if since < self.tick - 1:
            return self._all_poses_since(since)
        if self._moved_tick < self.tick:
            return None
        # Most clients have received the previous poses and get the same object.
        with_ids = seen.bodies != self._moved_version
        seen.bodies = self._moved_version
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
                "revision": self.revision,
                "bounds": None if bounds is None else list(bounds),
                "step_size": self._step_size,
                "lockstep": self._lockstep,
                "layers": [
                    {
                        "name": layer.contents.name,
                        "color": list(layer.contents.color),
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
                "revision": self.revision,
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

    def _all_poses_since(self, since: int) -> bytes | None:
        moved = np.flatnonzero(self._changed > since)
        return self._poses_message(moved, with_ids=True) if len(moved) else None

    def _poses_message(self, rows: npt.NDArray[np.intp], with_ids: bool) -> bytes:
        head, poses = (self._index, self.revision, self.time), self._poses[rows]
        if with_ids:
            return encoding.poses_message(*head, self._body_ids[rows], poses)
        return encoding.same_bodies_message(*head, poses)
