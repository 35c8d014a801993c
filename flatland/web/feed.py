"""What clients see of one world: captured at most 30 times a second while a client looks."""

from __future__ import annotations

import asyncio
import json
import logging
import math
from collections import deque
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

import numpy as np

from flatland.entities.model import Model
from flatland.errors import PLUGIN_FAULTS, WorldError
from flatland.geometry import FloatArray, bounds_of, transform_points
from flatland.values import Transform
from flatland.web import encoding
from flatland.web.capture import Capture, Captured, Demand, NewScan
from flatland.web.controller import WorldController
from flatland.web.inspection import Details, details_message
from flatland.web.model_files import plugin_parameters
from flatland.web.numbers import number_at
from flatland.web.scene import Description, LayerContents
from flatland.world import World

_LOG = logging.getLogger("flatland")

PERIOD: Final = 1 / 30  # s of wall time between two captures
STATUS_PERIOD: Final = 0.2  # s of wall time between two messages `status`
RATE_WINDOW: Final = 1.0  # s of wall time over which the real-time factor is measured
DETAILS_PERIOD: Final = 0.2  # s of wall time between two messages `details`
FRAMES_PERIOD: Final = 0.1  # s of wall time between two messages `frames`
STALE_AFTER: Final = 0.5  # s without an answer of the simulator that clients are told of
_POLL_PERIOD: Final = 0.01  # s between two looks at a world that no simulation runs
_SERVED_POLL_PERIOD: Final = 0.25  # s, in case the simulation that runs the world ends
_MAX_REMOVED: Final = 1000  # removed models that are remembered

R = TypeVar("R")


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
    scans: int = -1
    status: int = -1
    details: int = -1
    frames: int = -1
    values: int = -1


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    contents: LayerContents
    edges: FloatArray  # in the world frame
    version: int


async def between_steps(world: World, action: Callable[[], R]) -> R:
    """Returns the result of an action that runs between two steps, without blocking the loop.

    The action runs in the thread that steps the world, or here if no thread does at the moment.

    Raises:
        Exception: Raised by the action.
    """
    return await _wait_for(world, world.post(action))


async def _wait_for(world: World, future: Future[R]) -> R:
    waiter = asyncio.wrap_future(future)
    requests = world.requests
    try:
        while not waiter.done():
            # Without a simulation that runs, whoever waits carries out the requests.
            served = requests.served or await asyncio.to_thread(requests.process_if_idle)
            await asyncio.wait({waiter}, timeout=_SERVED_POLL_PERIOD if served else _POLL_PERIOD)
    except asyncio.CancelledError:
        waiter.cancel()
        raise
    return waiter.result()


class WorldFeed:
    """The latest state of one world in the thread of the server.

    Attributes:
        index: Index of the world in messages.
        name: Name of the world for users.
        world: The world.
        controller: Carries out what clients request.
        holds: Models that clients hold; used between two steps only.
        model_files: Label and path of the model files that can be spawned.
    """

    def __init__(
        self,
        index: int,
        name: str,
        world: World,
        controller: WorldController,
        ids: Iterator[int],
    ) -> None:
        """Creates a feed that nobody looks at.

        Args:
            index: Index of the world in messages.
            name: Name of the world for users.
            world: The world.
            controller: Carries out what clients request.
            ids: Returns ids that have not been used.
        """
        self.index, self.name, self.world, self.controller = index, name, world, controller
        self.holds = controller.holds
        self.model_files: list[dict[str, str]] = []
        self._capture = Capture(world, controller, ids)
        self._lookers: dict[Callable[[], None], View] = {}
        self._looked_at = asyncio.Event()
        self._layers: list[_Layer] = []
        self._lines: dict[str, LayerContents] = {}
        self._layers_changed = True
        self._world_version = 0
        self._revision = 0
        self._models: dict[int, tuple[int, Description]] = {}
        self._removed: deque[tuple[int, int]] = deque(maxlen=_MAX_REMOVED)
        self._forgotten = 0  # models that were removed before this revision are not remembered
        self._body_ids = np.empty(0, np.uint32)
        self._poses = np.empty((0, 3), np.float32)
        self._changed = np.empty(0, np.int64)  # the capture in which each pose changed
        self._tick = 0
        self._scans: dict[int, tuple[int, encoding.ScanParts, int]] = {}
        self._newest_scans: list[tuple[int, bytes]] = []  # of the last capture, with their number
        self._last: Captured | None = None
        self._answered = -math.inf
        self._times: deque[tuple[float, float]] = deque()
        self._status = ""
        self._status_version = 0
        self._status_due = -math.inf
        self._jobs: set[asyncio.Task[None]] = set()
        self._stale_timer: asyncio.TimerHandle
        self._shared: dict[str, tuple[int, bytes]] = {}
        self._details_due = self._frames_due = -math.inf
        self._details: dict[int, tuple[int, str]] = {}
        self._frames: tuple[int, str] = (-1, "")
        self._values: dict[str, float] = {}
        self._values_tick = -1
        self._values_time = -math.inf
        self._parameters: dict[int, tuple[str, Description]] = {}

    # -- who looks -------------------------------------------------------------------------

    def look(self, wake: Callable[[], None], view: View) -> None:
        """Adds a client, or changes what it looks at.

        Args:
            wake: Called when there is something new; identifies the client.
            view: What it looks at.
        """
        self._lookers[wake] = view
        self._looked_at.set()

    def look_away(self, wake: Callable[[], None]) -> None:
        """Removes a client."""
        self._lookers.pop(wake, None)
        if not self._lookers:
            self._looked_at.clear()

    def find_model(self, number: int) -> Model:
        """Returns the model of an id; to be called between two steps.

        Raises:
            WorldError: It was deleted.
        """
        known = self._capture.scene.models.get(number)
        if known is None or known.model not in self.world.models:
            raise WorldError("the model does not exist any more")
        return known.model

    def layers_changed(self) -> None:
        """Copies the layers again at the next capture."""
        self._layers_changed = True

    # -- requests --------------------------------------------------------------------------

    async def wait_for(self, future: Future[Any]) -> None:
        """Waits for a future that is completed between two steps, without blocking the loop.

        Raises:
            Exception: The exception of the future.
        """
        await _wait_for(self.world, future)

    def spawn(self, work: Coroutine[Any, Any, None]) -> None:
        """Starts something that ends by itself, or with the world."""
        task = asyncio.create_task(work)
        self._jobs.add(task)
        task.add_done_callback(self._job_done)

    def _job_done(self, task: asyncio.Task[None]) -> None:
        self._jobs.discard(task)
        if not task.cancelled() and task.exception() is not None and not self.world.closed:
            _LOG.warning("web viewer: %s", task.exception())

    def draw(self, lines: LayerContents) -> None:
        """Shows lines in addition to the layers, instead of earlier lines of the same name."""
        self._lines[lines.name] = lines
        self._layers_changed = True

    # -- captures --------------------------------------------------------------------------

    async def run(self) -> None:
        """Captures the state while a client looks, until the world is closed."""
        loop = asyncio.get_running_loop()
        try:
            while not self.world.closed:
                if not self._looked_at.is_set():
                    self._rest()
                    await self._looked_at.wait()
                began = loop.time()
                await self._update(began)
                self._wake_all()
                await asyncio.sleep(max(began + PERIOD - loop.time(), 0.001))
        finally:
            if not self.world.closed:
                self.world.post(self._capture.end)

    def _rest(self) -> None:
        """Ends everything that costs something; nobody looks."""
        if not self.world.closed:
            self.world.post(self._capture.end)
        self._times.clear()
        self._scans.clear()
        self._newest_scans = []
        self._details.clear()
        self._parameters.clear()
        self._values.clear()

    def _demand(self, now: float) -> Demand:
        """Returns what the clients look at, and what of it is due."""
        views = self._lookers.values()
        inspected = frozenset(view.inspect for view in views if view.inspect is not None)
        demand = Demand(
            scans=any(view.scans for view in views),
            layers=self._layers_changed,
            frames=now >= self._frames_due and any(view.frames for view in views),
            inspected=inspected,
            details=now >= self._details_due and bool(inspected),
            series=frozenset(name for view in views for name in view.series),
        )
        if demand.frames:
            self._frames_due = now + FRAMES_PERIOD
        if demand.details:
            self._details_due = now + DETAILS_PERIOD
        return demand

    async def _update(self, now: float) -> None:
        demand = self._demand(now)
        self._layers_changed = False
        loop = asyncio.get_running_loop()
        self._stale_timer = loop.call_later(STALE_AFTER, self._tell_stale)
        try:
            captured = await between_steps(self.world, lambda: self._capture.take(demand))
            await self._read_parameters(captured.details)
            self._apply(captured, now)
        except PLUGIN_FAULTS as error:
            self._layers_changed = self._layers_changed or demand.layers
            if not self.world.closed:
                _LOG.warning("web viewer: the world cannot be captured: %s", error)
                await asyncio.sleep(1.0)
        finally:
            self._stale_timer.cancel()

    def _tell_stale(self) -> None:
        """Tells the clients, again and again, that the simulator does not answer."""
        loop = asyncio.get_running_loop()
        self._set_status(loop.time())
        self._wake_all()
        self._stale_timer = loop.call_later(STALE_AFTER, self._tell_stale)

    def _wake_all(self) -> None:
        for wake in self._lookers:
            wake()

    def _apply(self, captured: Captured, now: float) -> None:
        """Takes over a captured state."""
        self._tick += 1
        previous, self._last = self._last, captured
        self._answered = asyncio.get_running_loop().time()
        if captured.layers is not None:
            self._apply_layers([*captured.layers, *self._lines.values()])
        self._apply_models(captured)
        self._apply_poses(captured)
        self._apply_scans(captured.scans)
        self._apply_extras(captured)
        self._times.append((now, captured.time))
        if captured.time < self._times[0][1]:  # The world was reset.
            self._times.clear()
        while self._times and now - self._times[0][0] > RATE_WINDOW + PERIOD:
            self._times.popleft()
        changed = previous is None or (previous.paused, previous.rate) != (
            captured.paused,
            captured.rate,
        )
        if changed or now >= self._status_due:
            self._set_status(now)

    def _apply_layers(self, layers: list[LayerContents]) -> None:
        former = {layer.contents.name: layer for layer in self._layers}
        self._world_version += 1
        self._revision += 1
        self._layers = []
        for contents in layers:
            points = contents.edges.astype(np.float64).reshape(-1, 2)
            edges = transform_points(contents.pose, points).reshape(-1, 4).astype(np.float32)
            known = former.get(contents.name)
            version = self._world_version
            if known is not None and np.array_equal(known.edges, edges):
                version = known.version
            self._layers.append(_Layer(contents, edges, version))

    def _apply_models(self, captured: Captured) -> None:
        change = captured.change
        if not change.layout:
            return
        self._revision += 1
        for number in change.removed:
            self._models.pop(number, None)
            if len(self._removed) == _MAX_REMOVED:
                self._forgotten = self._removed[0][0]
            self._removed.append((self._revision, number))
        for number, description in change.described.items():
            self._models[number] = (self._revision, description)
        self._body_ids = np.array(change.body_ids, np.uint32)
        self._poses = np.full((len(change.body_ids), 3), np.nan, np.float32)
        self._changed = np.full(len(change.body_ids), self._tick, np.int64)
        self._newest_scans = []
        lasers = {laser["id"] for _, model in self._models.values() for laser in model["lasers"]}
        self._scans = {number: scan for number, scan in self._scans.items() if number in lasers}

    def _apply_poses(self, captured: Captured) -> None:
        poses = captured.motions[:, :3].astype(np.float32)
        moved = (poses != self._poses).any(axis=1)
        if moved.any():
            self._changed[moved] = self._tick
            self._poses = poses

    def _apply_scans(self, scans: list[NewScan]) -> None:
        by_count: dict[int, list[NewScan]] = {}
        for scan in scans:
            by_count.setdefault(len(scan.ranges), []).append(scan)
        self._newest_scans = []
        for count, same in by_count.items():
            fractions = encoding.quantized(
                np.concatenate([scan.ranges for scan in same]).reshape(-1, count),
                np.array([scan.range_max for scan in same], np.float32),
            )
            parts = encoding.ScanParts(
                [scan.laser for scan in same], [scan.pose for scan in same], fractions
            )
            self._newest_scans.append((len(same), parts.all))
            for row, scan in enumerate(same):
                self._scans[scan.laser] = (self._tick, parts, row)

    async def _read_parameters(self, details: list[Details]) -> None:
        """Reads the parameters of the plugins of models that were not inspected before."""
        for each in details:
            known = self._parameters.get(each.model)
            if known is None or known[0] != each.path:
                parameters = await asyncio.to_thread(plugin_parameters, self.world, each.path)
                self._parameters[each.model] = (each.path, parameters)

    def _apply_extras(self, captured: Captured) -> None:
        for details in captured.details:
            parameters = self._parameters[details.model][1]
            text = _json(details_message(self.index, details, parameters))
            self._details[details.model] = (self._tick, text)
        if captured.frames is not None:
            self._frames = (self._tick, _json(self._frames_message(captured.frames)))
        values = {}
        for name, (value, path) in captured.series.items():
            number = number_at(value, path)
            if number is not None:
                values[name] = number
        if values != self._values or captured.time != self._values_time:
            self._values_tick = self._tick
        self._values, self._values_time = values, captured.time

    # -- messages --------------------------------------------------------------------------

    def next_message(self, seen: Seen, view: View) -> str | bytes | None:
        """Returns the next message for a client, None if it has received everything.

        Args:
            seen: What the client has received; updated.
            view: What it looks at.
        """
        last = self._last
        if last is None:
            return None
        if seen.world < self._world_version:
            seen.world = self._world_version
            return self._world_message(last)
        for number, layer in enumerate(self._layers):
            if seen.layers.get(number) != layer.version:
                seen.layers[number] = layer.version
                return encoding.edges_message(
                    self.index, self._revision, last.time, number, layer.edges
                )
        if seen.models < self._revision:
            before, seen.models = seen.models, self._revision
            return self._models_message(before)
        if seen.status < self._status_version:
            seen.status = self._status_version
            return self._status
        if seen.poses < self._tick:
            before, seen.poses = seen.poses, self._tick
            message = self._poses_message(before, last.time)
            if message is not None:
                return message
        if view.scans and seen.scans < self._tick:
            before, seen.scans = seen.scans, self._tick
            message = self._scans_message(before, last.time)
            if message is not None:
                return message
        return self._next_extra(seen, view, last.time)

    def _next_extra(self, seen: Seen, view: View, time: float) -> str | None:
        """Returns the next message that only some clients want."""
        if view.inspect is not None and view.inspect in self._details:
            tick, text = self._details[view.inspect]
            if seen.details != tick:
                seen.details = tick
                return text
        if view.frames and seen.frames < self._frames[0]:
            seen.frames, text = self._frames
            return text
        if view.series and seen.values < self._values_tick:
            seen.values = self._values_tick
            series = {name: self._values[name] for name in view.series if name in self._values}
            if series:
                message = {"type": "values", "world": self.index, "time": time, "series": series}
                return _json(message)
        return None

    def _frames_message(self, frames: list[Transform]) -> dict[str, Any]:
        return {
            "type": "frames",
            "world": self.index,
            "frames": [
                {"parent": f.parent, "child": f.child, "pose": [f.x, f.y, f.yaw]} for f in frames
            ],
        }

    def _world_message(self, last: Captured) -> str:
        points = [layer.edges.reshape(-1, 2) for layer in self._layers]
        points.append(self._poses[:, :2])
        bounds = bounds_of(np.concatenate(points).astype(np.float64))
        return _json(
            {
                "type": "world",
                "world": self.index,
                "name": self.name,
                "revision": self._revision,
                "bounds": None if bounds is None else list(bounds),
                "step_size": last.step_size,
                "lockstep": last.lockstep,
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
        return _json(
            {
                "type": "models",
                "world": self.index,
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

    def _set_status(self, now: float) -> None:
        self._status_due = now + STATUS_PERIOD
        self._status_version += 1
        last = self._last
        if last is None:
            return
        silence = now - self._answered
        rate = last.rate
        self._status = _json(
            {
                "type": "status",
                "world": self.index,
                "time": last.time,
                "paused": last.paused,
                "rate": None if rate is None else 0 if math.isinf(rate) else rate,
                "real_time_factor": None if last.lockstep else self._real_time_factor(),
                "lockstep": last.lockstep,
                "stale": round(silence, 1) if silence > STALE_AFTER else 0,
            }
        )

    def _real_time_factor(self) -> float:
        if len(self._times) < 2:
            return 0.0
        (wall_0, time_0), (wall_1, time_1) = self._times[0], self._times[-1]
        return round((time_1 - time_0) / (wall_1 - wall_0), 4) if wall_1 > wall_0 else 0.0

    def _poses_message(self, since: int, time: float) -> bytes | None:
        """Returns the poses that changed after a capture; the same object for most clients."""
        shared = self._shared.get("poses")
        if since == self._tick - 1 and shared is not None and shared[0] == self._tick:
            return shared[1] or None
        moved = np.flatnonzero(self._changed > since)
        message = b""
        if len(moved):
            message = encoding.poses_message(
                self.index,
                self._revision,
                time,
                self._body_ids[moved],
                self._poses[moved],
            )
        if since == self._tick - 1:
            self._shared["poses"] = (self._tick, message)
        return message or None

    def _scans_message(self, since: int, time: float) -> bytes | None:
        """Returns the scans after a capture."""
        if since == self._tick - 1:
            count = sum(number for number, _ in self._newest_scans)
            parts = [data for _, data in self._newest_scans]
        else:
            parts = [scans[row] for tick, scans, row in self._scans.values() if tick > since]
            count = len(parts)
        if not count:
            return None
        return encoding.scans_message(self.index, self._revision, time, count, parts)


def _json(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"))
