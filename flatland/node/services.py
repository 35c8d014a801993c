"""The services of the node: one table of names, types and functions."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, TypeVar

from flatland.config.inputs import FileStore
from flatland.errors import BatchError, FlatlandError
from flatland.foreign_texts import text_of
from flatland.geometry import Pose
from flatland.loading.model_source import ModelSpec
from flatland.loading.world_source import WorldSource
from flatland.node.clock import NodeClock
from flatland.node.names import sendable_text
from flatland.node.operations import Operations
from flatland.node.states import stamped_states
from flatland.node.transport import REGISTRATION_TIMEOUT, REPLACED, CallError, Transport
from flatland.runtime.file_reads import read_in_time
from flatland.simulation import Simulation
from flatland.timekeeper import NANOSECONDS
from flatland.values import OccupancyGrid

_LOG = logging.getLogger("flatland")

MAX_STEP_DURATION: Final = 3600.0
"""Longest simulated time of a call of `step_world` [s]; a larger one probably has another unit."""
_STEP_TOLERANCE: Final = 1e-3  # of a step, by which a duration may differ from a multiple of steps
_MAX_TIME: Final = 2**61 / NANOSECONDS  # s; the core counts up to there, stamps of ROS further
_KEEP_SEED: Final = -1  # in ResetWorld
_READY_POLL_PERIOD: Final = 0.01  # s between two checks of the connections
_VISIBLE: Final = {0: None, 1: True, -1: False}  # KEEP, SHOW and HIDE in SetAppearance

Response = dict[str, Any]
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Service:
    """A row of the table.

    Attributes:
        name: Name in the namespace of the node.
        type: Type of the service, `PACKAGE/NAME`.
        call: Carries out a request in the thread of the service and returns the fields of the
            response except `success`, and except `message` if that is empty. Raises `CallError`.
        failed: Returns the fields of the response after a failure, except `success` and `message`.
    """

    name: str
    type: str
    call: Callable[[Services, Any], Response]
    failed: Callable[[Services, CallError], Response] = lambda _services, _error: {}


class Services:
    """The services of one simulation in the namespace of the node.

    Each call is carried out between two steps in the thread that steps the world, in order of
    arrival, also while paused. The response is sent after the call has taken effect.
    """

    def __init__(
        self,
        transport: Transport,
        simulation: Simulation,
        clock: NodeClock,
        operations: Operations,
        topics_opened: threading.Event,
    ) -> None:
        """Stores the arguments; `open` offers the services.

        Args:
            transport: Serves.
            simulation: Simulation that the services control.
            clock: Publishes the time.
            operations: Changes the world.
            topics_opened: Set as soon as the node has opened all its own topics.
        """
        self._transport = transport
        self._simulation = simulation
        self._world = simulation.world
        self._clock = clock
        self._operations = operations
        self._topics_opened = topics_opened
        self._count_dropped = transport.dropped()
        self._dropped_lock = threading.Lock()  # of the counter

    def open(self) -> None:
        """Offers all services of the table asynchronously.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        for service in SERVICES:
            self._transport.serve(service.name, service.type, partial(self.call, service))

    def call(self, service: Service, request: Any) -> Response:
        """Carries out a request; called in the thread of a service.

        Args:
            service: The service.
            request: The request, with the fields of its type.

        Returns:
            The fields of the response.

        Raises:
            CallError: The call failed, and the response has no field for an error.
        """
        if service.type == "std_srvs/Empty":
            return service.call(self, request)
        try:
            return {"success": True, **service.call(self, request)}
        except CallError as error:
            return {"success": False, "message": str(error), **service.failed(self, error)}

    def with_files(
        self, read: Callable[[WorldSource], FileStore], action: Callable[[], R]
    ) -> Callable[[], R]:
        """Reads and parses files while the simulation goes on.

        Args:
            read: Reads the files that the action needs.
            action: Action for `carry_out`.

        Returns:
            The action with these files.

        Raises:
            CallError: The files cannot be read in time.
        """
        source = self._world.source
        try:
            store = read_in_time(lambda: read(source))
        except FlatlandError as error:
            raise CallError(error.text_with_hint) from error
        return source.inputs.using(store)(action)

    def carry_out(self, action: Callable[[], R]) -> R:
        """Runs an action between two steps and returns what it returned.

        Raises:
            CallError: The action raised, or the simulation does not carry it out.
        """
        return self.result(self._simulation.post(action))

    def result(self, done: Future[R]) -> R:
        """Waits for a request.

        A client may use the topics of a model as soon as it receives the response: they are
        registered when this function returns.

        Args:
            done: Result of the request.

        Raises:
            CallError: The request failed, or the simulation does not carry it out.
        """
        try:
            return self._transport.wait_for(done, self._world.requests)
        except CallError:
            raise
        except FlatlandError as error:
            index = error.index if isinstance(error, BatchError) else -1
            raise CallError(error.text_with_hint, index) from error
        except Exception as error:
            _LOG.exception("unexpected internal error in a service call")
            raise CallError(f"{type(error).__name__}: {text_of(error)}") from error
        finally:
            self._transport.flush(REGISTRATION_TIMEOUT)

    # -- the node --------------------------------------------------------------------------

    def _wait_until_ready(self, request: Any) -> Response:
        if not 0 <= request.timeout < math.inf:
            raise CallError(f"timeout must be finite and not negative [s], got {request.timeout}")
        end = time.monotonic() + request.timeout
        while missing := self._missing(request.topics):
            if self._transport.shutting_down:
                raise CallError("the simulator is shutting down")
            if time.monotonic() >= end:
                raise CallError(f"not ready after {request.timeout:g} s: {missing}")
            time.sleep(_READY_POLL_PERIOD)
        return {}

    def _missing(self, topics: Sequence[str]) -> str:
        """Returns what the node waits for, empty if it is ready.

        Args:
            topics: Topics that must be connected.
        """
        if not self._topics_opened.is_set():
            return "the topics that are opened after the first step are not open"
        if not self._transport.flush(_READY_POLL_PERIOD):
            return "the registration with the ROS master is not complete"
        unconnected = [topic for topic in topics if not self._transport.is_connected(topic)]
        return f"no connection to {', '.join(unconnected)}" if unconnected else ""

    # -- time ------------------------------------------------------------------------------

    def _pause(self, _request: Any) -> Response:
        return self._silent(self._operations.pause)

    def _resume(self, _request: Any) -> Response:
        return self._silent(self._operations.resume)

    def _toggle_pause(self, _request: Any) -> Response:
        return self._silent(self._operations.toggle_pause)

    def _set_rate(self, request: Any) -> Response:
        rate = request.update_rate
        if math.isnan(rate) or rate < 0:
            raise CallError(f"update_rate must not be negative, got {rate}")
        return self._silent(lambda: self._operations.set_rate(rate))

    def _reset_world(self, request: Any) -> Response:
        if request.seed < _KEEP_SEED:
            raise CallError(
                f"seed must be at least 0, or -1 for the current one, got {request.seed}"
            )
        seed = None if request.seed == _KEEP_SEED else request.seed
        return self._silent(lambda: self._operations.reset(seed, keep_time=request.keep_time))

    def _step_world(self, request: Any) -> Response:
        count = self._number_of_steps(request.duration)
        time_ns = self.result(self._simulation.request_steps(count))
        # With a limited rate, the time after the last step may not be published yet.
        self._clock.flush()
        self._transport.disable_delay()
        return {"message": self._describe_dropped(), "stamp": time_ns}

    def _number_of_steps(self, duration: float) -> int:
        """Returns a duration [s] as a number of steps.

        Raises:
            CallError: The duration is out of range, or not a multiple of the step size.
        """
        timekeeper = self._world.timekeeper
        step_size = timekeeper.step_size
        if duration == 0:
            duration = step_size
        if not 0 < duration < math.inf:
            raise CallError(f"duration must be finite and not negative [s], got {duration}")
        if duration > MAX_STEP_DURATION:
            raise CallError(f"duration must be at most {MAX_STEP_DURATION:g} s, got {duration}")
        if timekeeper.sim_time + duration >= _MAX_TIME:
            raise CallError(f"the simulated time must remain below {_MAX_TIME:.0f} s (73 years)")
        steps = duration / step_size
        count = round(steps)
        if count == 0 or abs(steps - count) > _STEP_TOLERANCE:
            raise CallError(
                f"duration must be a multiple of the step size, {step_size:g} s, got {duration}"
            )
        return count

    def _describe_dropped(self) -> str:
        """Returns which messages were dropped since the previous call; empty for none."""
        with self._dropped_lock:
            dropped = self._count_dropped()
        return ", ".join(
            f"{count} messages of {topic} to {subscriber} were dropped"
            for (topic, subscriber), count in sorted(dropped.items())
            if topic not in REPLACED
        )

    # -- models ----------------------------------------------------------------------------

    def _spawn_model(self, request: Any) -> Response:
        path, name, namespace = request.yaml_path, request.name, request.ns
        pose = _pose_of(request.pose)
        return self._described(
            self.with_files(
                lambda source: source.read_models_ahead([path]),
                lambda: self._operations.spawn(path, name, namespace, pose),
            )
        )

    def _move_model(self, request: Any) -> Response:
        pose = _pose_of(request.pose)
        return self._described(lambda: self._operations.move(request.name, pose))

    def _delete_model(self, request: Any) -> Response:
        return self._silent(lambda: self._operations.delete(request.name))

    def _spawn_models(self, request: Any) -> Response:
        specs = [
            ModelSpec(model.yaml_path, model.name, model.ns, _pose_of(model.pose))
            for model in request.models
        ]
        paths = [spec.yaml_path for spec in specs]
        return self._placed(
            self.with_files(
                lambda source: source.read_models_ahead(paths),
                lambda: self._operations.spawn_all(specs),
            )
        )

    def _move_models(self, request: Any) -> Response:
        poses = [(model.name, _pose_of(model.pose)) for model in request.models]
        return self._placed(lambda: self._operations.move_all(poses))

    def _delete_models(self, request: Any) -> Response:
        return self._silent(lambda: self._world.delete_models(request.names)) | {"index": -1}

    def _set_appearance(self, request: Any) -> Response:
        if request.visible not in _VISIBLE:
            raise CallError(
                f"visible must be 0 (KEEP), 1 (SHOW) or -1 (HIDE), got {request.visible}"
            )
        return self._silent(
            lambda: self._world.set_appearance(
                request.model,
                request.body,
                color=[float(number) for number in request.color] or None,
                layers=request.layers or None,
                visible=_VISIBLE[request.visible],
            )
        )

    def _get_model_states(self, request: Any) -> Response:
        return {"states": self.carry_out(lambda: stamped_states(self._world, request.names))}

    # -- layers ----------------------------------------------------------------------------

    def _set_layer_map(self, request: Any) -> Response:
        has_grid = len(request.grid.data) > 0
        if has_grid == bool(request.map_path):
            raise CallError("exactly one of map_path and grid must be given")
        layer, path, source = request.layer, request.map_path, self._world.source
        if not has_grid:
            return self._silent(
                self.with_files(
                    lambda source: source.read_map_ahead(path),
                    lambda: self._world.set_layer_map(layer, path),
                )
            )
        try:
            grid = self._transport.receivable(OccupancyGrid)[1](request.grid)
            store = source.convert_grid_ahead(grid)
        except FlatlandError as error:
            raise CallError(error.text_with_hint) from error
        set_map = source.inputs.using(store)(self._world.set_layer_map)
        return self._silent(lambda: set_map(layer, grid))

    # -- results ---------------------------------------------------------------------------

    def _index(self, error: CallError) -> Response:
        return {"index": error.index}

    def _time(self, _error: CallError) -> Response:
        return {"stamp": self._world.timekeeper.sim_time_ns}

    def _silent(self, action: Callable[[], object]) -> Response:
        """Runs an action whose result is not part of the response."""
        self.carry_out(action)
        return {}

    def _described(self, action: Callable[[], str]) -> Response:
        """Runs an action whose result is the message of the response."""
        return {"message": sendable_text(self.carry_out(action))}

    def _placed(self, action: Callable[[], tuple[str, list[Pose]]]) -> Response:
        """Runs an action that returns the message and the poses of the response."""
        text, poses = self.carry_out(action)
        return {"message": sendable_text(text), "index": -1, "poses": poses}


def _pose_of(message: Any) -> Pose:
    """Converts a `geometry_msgs/Pose2D`."""
    return (message.x, message.y, message.theta)


SERVICES: Final = (
    Service("spawn_model", "flatland/SpawnModel", Services._spawn_model),
    Service("delete_model", "flatland/DeleteModel", Services._delete_model),
    Service("move_model", "flatland/MoveModel", Services._move_model),
    Service("spawn_models", "flatland/SpawnModels", Services._spawn_models, Services._index),
    Service("move_models", "flatland/MoveModels", Services._move_models, Services._index),
    Service("delete_models", "flatland/DeleteModels", Services._delete_models, Services._index),
    Service("get_model_states", "flatland/GetModelStates", Services._get_model_states),
    Service("set_appearance", "flatland/SetAppearance", Services._set_appearance),
    Service("set_layer_map", "flatland/SetLayerMap", Services._set_layer_map),
    Service("set_rate", "flatland/SetRate", Services._set_rate),
    Service("step_world", "flatland/StepWorld", Services._step_world, Services._time),
    Service("reset_world", "flatland/ResetWorld", Services._reset_world),
    Service("wait_until_ready", "flatland/WaitUntilReady", Services._wait_until_ready),
    Service("pause", "std_srvs/Empty", Services._pause),
    Service("resume", "std_srvs/Empty", Services._resume),
    Service("toggle_pause", "std_srvs/Empty", Services._toggle_pause),
)
"""All services of the node; `static_map`, of a node that publishes a map, is in `maps`."""
