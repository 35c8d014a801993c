"""The services that only ROS 2 has: those of `simulation_interfaces`, which control any simulator.

Entities are models. Their category follows from their contents, and their only tag is their class
of objects.
"""

from __future__ import annotations

import logging
import math
import re
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import unquote, urlsplit

import numpy as np
from geometry_msgs.msg import Vector3

from flatland.errors import UnreadableFileError, YamlError
from flatland.geometry import (
    IDENTITY,
    Bounds,
    Pose,
    bounds_of,
    invert,
    quaternion_from_yaw,
    transform_points,
)
from flatland.graph_names import check_namespace
from flatland.node.adapters.receivers import planar_pose
from flatland.node.clock import stamp
from flatland.node.names import UniqueNames, sendable_text
from flatland.node.services import MAX_STEP_DURATION, SERVICES
from flatland.node.transport import CallError
from flatland.node.values import WORLD_FRAME
from flatland.plugin_api.plugin import describe
from flatland.plugins.pedestrians import Pedestrians
from flatland.ros2.endpoints import destroy_later
from flatland.suggestions import did_you_mean
from flatland.timekeeper import NANOSECONDS

if TYPE_CHECKING:
    from rclpy.node import Node

    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.node.served_world import ServedWorld
    from flatland.node.services import Services
    from flatland.node.transport import Connection, Transport

try:
    import simulation_interfaces.action as actions
    import simulation_interfaces.msg as messages
    import simulation_interfaces.srv as types
    from rclpy.action import ActionServer, CancelResponse
except ImportError:
    messages = None

_LOG = logging.getLogger("flatland")

_WORLD_FRAMES: Final = ("", WORLD_FRAME, "world")
_MODEL_FILES: Final = ("*.model.yaml", "*/*.model.yaml")
_FORMATS: Final = (".yaml", ".yml")
_MAX_FILTER: Final = 200  # characters of a regular expression


class SimulationServices:
    """The services and the action for one world, in the namespace of the node, until `close`."""

    def __init__(self, transport: Transport, served: ServedWorld, node: Node) -> None:
        """Offers them.

        Args:
            transport: Serves.
            served: The world.
            node: The node, for the action.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._node = node
        self._served = served
        self._world = served.world
        self._services = served.services
        self._stopped = False  # whether the world was reset and paused by STATE_STOPPED
        self._initial = {model.name for model in self._world.models}
        calls = {
            "get_simulator_features": self._get_simulator_features,
            "get_spawnables": self._get_spawnables,
            "spawn_entity": self._spawn_entity,
            "delete_entity": self._delete_entity,
            "get_entities": self._get_entities,
            "get_entities_states": self._get_entities_states,
            "get_entity_state": self._get_entity_state,
            "set_entity_state": self._set_entity_state,
            "get_entity_info": self._get_entity_info,
            "get_entity_bounds": self._get_entity_bounds,
            "get_simulation_state": self._get_simulation_state,
            "set_simulation_state": self._set_simulation_state,
            "reset_simulation": self._reset_simulation,
            "step_simulation": self._step_simulation,
        }
        self._closed = False
        self._connections = []
        for name, call in calls.items():
            service_type = getattr(types, "".join(map(str.capitalize, name.split("_"))))
            handler = partial(self._respond, service_type, call)
            self._connections.append(transport.serve(name, service_type, handler))
        self._action = ActionServer(
            node,
            actions.SimulateSteps,
            "simulate_steps",
            self._simulate_steps,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
        )
        # Goals would otherwise be carried out by the executor, which would wait for the steps.
        self._action.notify_execute = self._start_goal

    def close(self) -> None:
        """Ends the services and the action."""
        self._closed = True
        for connection in self._connections:
            connection.close()
        destroy_later(self._node, lambda action: action.destroy(), self._action)

    def _respond(
        self, service_type: type[Any], call: Callable[[Any, Any], str | None], request: Any
    ) -> Any:
        """Carries out a request; called in the thread of a service.

        Args:
            service_type: Class of the service.
            call: Fills the response, and may return a text that explains the success.
            request: The request.
        """
        response = service_type.Response()
        try:
            text, code = call(request, response), messages.Result.RESULT_OK
        except CallError as error:
            response = service_type.Response()
            text, code = str(error), _code(error)
        if hasattr(response, "result"):
            response.result.result = code
            response.result.error_message = text or ""
        return response

    def _find(self, name: str) -> Model:
        """Returns a model; must be called between two steps."""
        for model in self._world.models:
            if model.name == name:
                return model
        hint = did_you_mean(name, (model.name for model in self._world.models), "entities")
        text = f'there is no entity "{name}" (hint: {hint})'
        raise RefusedError(messages.Result.RESULT_NOT_FOUND, text)

    # -- the simulator ---------------------------------------------------------------------

    def _get_simulator_features(self, _request: Any, response: Any) -> None:
        features = messages.SimulatorFeatures
        response.features.features = [
            features.SPAWNING,
            features.DELETING,
            features.ENTITY_TAGS,
            features.ENTITY_BOUNDS,
            features.ENTITY_BOUNDS_BOX,
            features.ENTITY_CATEGORIES,
            features.SPAWNING_RESOURCE_STRING,
            features.ENTITY_STATE_GETTING,
            features.ENTITY_STATE_SETTING,
            features.ENTITY_INFO_GETTING,
            features.SPAWNABLES,
            features.SIMULATION_RESET,
            features.SIMULATION_RESET_TIME,
            features.SIMULATION_RESET_STATE,
            features.SIMULATION_RESET_SPAWNED,
            features.SIMULATION_STATE_GETTING,
            features.SIMULATION_STATE_SETTING,
            features.SIMULATION_STATE_PAUSE,
            features.STEP_SIMULATION_SINGLE,
            features.STEP_SIMULATION_MULTIPLE,
            features.STEP_SIMULATION_ACTION,
        ]
        response.features.spawn_formats = [suffix.removeprefix(".") for suffix in _FORMATS]
        response.features.custom_info = "flatland: a 2-D simulator, see docs/ros2.md"

    @property
    def _held(self) -> bool:
        """Whether time passes only on request."""
        return self._world.paused or self._served.simulation.lockstep

    def _state(self) -> int:
        state = messages.SimulationState
        if not self._held:
            return int(state.STATE_PLAYING)
        stopped = self._stopped and self._world.timekeeper.sim_time_ns == 0
        return int(state.STATE_STOPPED if stopped else state.STATE_PAUSED)

    def _get_simulation_state(self, _request: Any, response: Any) -> None:
        response.state.state = self._services.carry_out(self._state)

    def _set_simulation_state(self, request: Any, response: Any) -> None:
        target, state = request.state.state, messages.SimulationState
        if target == state.STATE_QUITTING:
            self._served.simulation.stop()
            return
        if target not in (state.STATE_STOPPED, state.STATE_PLAYING, state.STATE_PAUSED):
            raise RefusedError(response.INCORRECT_TRANSITION, f"state {target} cannot be requested")

        def change() -> None:
            if self._state() == target:
                raise RefusedError(
                    response.ALREADY_IN_TARGET_STATE, "the simulation is in this state"
                )
            operations = self._served.operations
            if target == state.STATE_PLAYING:
                if self._served.simulation.lockstep:
                    text = "in lockstep, time passes only on request"
                    raise RefusedError(response.STATE_TRANSITION_ERROR, text)
                operations.resume()
            else:
                operations.pause()
            if target == state.STATE_STOPPED:
                operations.reset()
            self._stopped = target == state.STATE_STOPPED

        self._services.carry_out(change)

    def _reset_simulation(self, request: Any, _response: Any) -> None:
        everything = request.SCOPE_TIME | request.SCOPE_STATE | request.SCOPE_SPAWNED
        scope = request.scope
        if scope in (request.SCOPE_DEFAULT, request.SCOPE_ALL):
            scope = everything
        operations, world = self._served.operations, self._world
        if scope & ~everything:
            raise RefusedError(
                messages.Result.RESULT_FEATURE_UNSUPPORTED, f"scope {scope} is not known"
            )
        if scope == everything:
            self._services.carry_out(operations.reset)
        elif scope == request.SCOPE_STATE | request.SCOPE_SPAWNED:
            self._services.carry_out(lambda: operations.reset(keep_time=True))
        elif scope == request.SCOPE_SPAWNED:
            self._services.carry_out(
                lambda: world.delete_models(
                    [model.name for model in world.models if model.name not in self._initial]
                )
            )
        else:
            raise RefusedError(
                messages.Result.RESULT_FEATURE_UNSUPPORTED,
                "the time is reset only with everything, and states only with SCOPE_SPAWNED",
            )

    def _check_held(self) -> None:
        if not self._held:
            raise RefusedError(
                messages.Result.RESULT_OPERATION_FAILED, "the simulation is not paused"
            )

    def _check_steps(self, steps: int) -> None:
        limit = round(MAX_STEP_DURATION / self._world.timekeeper.step_size)
        if steps > limit:
            text = f"steps must be at most {limit}, got {steps}"
            raise RefusedError(messages.Result.RESULT_OPERATION_FAILED, text)

    def _step_simulation(self, request: Any, _response: Any) -> None:
        self._check_steps(request.steps)
        self._services.carry_out(self._check_held)
        if request.steps:
            self._services.result(self._served.operations.step(request.steps))

    def _start_goal(self, goal: Any, execute: Callable[[Any], Any] | None) -> None:
        """Carries out a goal of the action in another thread, while the executor goes on."""
        threading.Thread(
            target=self._carry_out_goal,
            args=(goal, execute or self._simulate_steps),
            name="flatland-action",
            daemon=True,
        ).start()

    def _carry_out_goal(self, goal: Any, execute: Callable[[Any], Any]) -> None:
        try:
            with suppress(StopIteration):  # the end of a coroutine that never waits
                self._action._execute_goal(execute, goal).send(None)
        except Exception:
            if not self._closed:
                raise
            # The action has ended, and there is no client of the result.

    def _simulate_steps(self, goal: Any) -> Any:
        """Carries out the goal of the action and returns its result."""
        result, feedback = actions.SimulateSteps.Result(), actions.SimulateSteps.Feedback()
        steps = goal.request.steps
        try:
            self._check_steps(steps)
            self._services.carry_out(self._check_held)
            for completed in range(1, steps + 1):
                if goal.is_cancel_requested:
                    goal.canceled()
                    text = f"cancelled after {completed - 1} of {steps} steps"
                    result.result.result = messages.Result.RESULT_OPERATION_FAILED
                    result.result.error_message = text
                    return result
                self._services.result(self._served.operations.step(1))
                feedback.completed_steps = completed
                feedback.remaining_steps = steps - completed
                goal.publish_feedback(feedback)
        except CallError as error:
            result.result.result = _code(error)
            result.result.error_message = str(error)
            goal.abort()
        else:
            result.result.result = messages.Result.RESULT_OK
            goal.succeed()
        return result

    # -- entities --------------------------------------------------------------------------

    def _get_spawnables(self, request: Any, response: Any) -> str:
        allowed = self._world.model_path
        folders = [Path(self._world.path).parent, *map(Path, allowed or ())]
        unknown = []
        for source in request.sources:
            folder = Path(source).resolve()
            inside = allowed is None or any(folder.is_relative_to(each) for each in allowed)
            if inside and folder.is_dir():
                folders.append(folder)
            else:
                unknown.append(source)
        files = {file for folder in folders for each in _MODEL_FILES for file in folder.glob(each)}
        response.spawnables = [
            messages.Spawnable(uri=sendable_text(str(file))) for file in sorted(files)
        ]
        return f"not a folder of models: {', '.join(unknown)}" if unknown else ""

    def _spawn_entity(self, request: Any, response: Any) -> str:
        # Version 2 of the interfaces has a message for the resource.
        resource = getattr(request, "entity_resource", request)
        path = _path_of(resource.uri, resource.resource_string, response)
        if not request.name and not request.allow_renaming:
            raise RefusedError(response.NAME_INVALID, "name is empty, and allow_renaming is false")
        try:
            check_namespace(request.entity_namespace)
        except ValueError as error:
            raise RefusedError(response.NAMESPACE_INVALID, str(error)) from None
        pose = _planar(request.initial_pose.header, request.initial_pose.pose, response)

        def spawn() -> str:
            names = UniqueNames()
            for model in self._world.models:
                names.claim(model.name)
            wanted = request.name or _entity_name(resource.uri)
            response.entity_name = names.claim(wanted)
            if response.entity_name != wanted and not request.allow_renaming:
                raise RefusedError(
                    response.NAME_NOT_UNIQUE, f'there is an entity "{wanted}" already'
                )
            return self._served.operations.spawn(
                path, response.entity_name, request.entity_namespace, pose
            )

        try:
            return self._services.carry_out(
                self._services.with_files(lambda source: source.read_models_ahead([path]), spawn)
            )
        except RefusedError:
            raise
        except CallError as error:
            if isinstance(error.__cause__, UnreadableFileError):
                raise RefusedError(messages.Result.RESULT_NOT_FOUND, str(error)) from error
            if isinstance(error.__cause__, YamlError):
                raise RefusedError(response.RESOURCE_PARSE_ERROR, str(error)) from error
            raise

    def _delete_entity(self, request: Any, _response: Any) -> None:
        name = request.entity
        self._services.carry_out(lambda: self._served.operations.delete(self._find(name).name))

    def _get_entities(self, request: Any, response: Any) -> None:
        models = self._services.carry_out(lambda: self._matching(request.filters))
        response.entities = [model.name for model in models]

    def _get_entities_states(self, request: Any, response: Any) -> None:
        def read() -> list[tuple[str, Any]]:
            names = [model.name for model in self._matching(request.filters)]
            return list(zip(names, self._states(names), strict=True))

        for name, state in self._services.carry_out(read):
            response.entities.append(name)
            response.states.append(state)

    def _get_entity_state(self, request: Any, response: Any) -> None:
        def read() -> list[Any]:
            return self._states([self._find(request.entity).name])

        [response.state] = self._services.carry_out(read)

    def _set_entity_state(self, request: Any, response: Any) -> str:
        state = request.state
        # Version 2 of the interfaces has flags.
        sets_pose = getattr(request, "set_pose", True)
        if getattr(request, "set_twist", True) and not _is_zero(state.twist):
            raise RefusedError(
                messages.Result.RESULT_FEATURE_UNSUPPORTED,
                "entities are at rest after a move: the twist must be zero",
            )
        pose = _planar(state.header, state.pose, response) if sets_pose else IDENTITY

        def move() -> str:
            name = self._find(request.entity).name
            return self._served.operations.move(name, pose) if sets_pose else ""

        return self._services.carry_out(move)

    def _get_entity_info(self, request: Any, response: Any) -> None:
        def read() -> tuple[int, str, str]:
            model = self._find(request.entity)
            return self._category(model, self._people()), model.path, model.class_name

        info = response.info
        info.category.category, info.description, tag = self._services.carry_out(read)
        info.tags = [tag]

    def _get_entity_bounds(self, request: Any, response: Any) -> None:
        def read() -> Bounds | None:
            model = self._find(request.entity)
            return _bounds(model, invert(model.pose))

        bounds = self._services.carry_out(read)
        if bounds is not None:
            x_min, y_min, x_max, y_max = bounds
            response.bounds.type = messages.Bounds.TYPE_BOX
            response.bounds.points = [Vector3(x=x_max, y=y_max), Vector3(x=x_min, y=y_min)]

    def _states(self, names: Iterable[str]) -> list[Any]:
        """Returns the states of models; must be called between two steps."""
        states = self._world.state()
        rows = {name: row for row, name in enumerate(states.names)}
        seconds, nanoseconds = divmod(stamp(self._world.timekeeper.sim_time_ns), NANOSECONDS)
        found = []
        for name in names:
            message = messages.EntityState()
            message.header.frame_id = WORLD_FRAME
            message.header.stamp.sec, message.header.stamp.nanosec = seconds, nanoseconds
            x, y, theta = states.poses[rows[name]].tolist()
            message.pose.position.x, message.pose.position.y = x, y
            _, _, message.pose.orientation.z, message.pose.orientation.w = quaternion_from_yaw(
                theta
            )
            vx, vy, omega = states.velocities[rows[name]].tolist()
            message.twist.linear.x, message.twist.linear.y = vx, vy
            message.twist.angular.z = omega
            found.append(message)
        return found

    # -- filters ---------------------------------------------------------------------------

    def _matching(self, filters: Any) -> list[Model]:
        """Returns the models that match all filters; must be called between two steps."""
        if len(filters.filter) > _MAX_FILTER:
            text = f"the filter must have at most {_MAX_FILTER} characters"
            raise RefusedError(messages.Result.RESULT_OPERATION_FAILED, text)
        try:
            pattern = re.compile(filters.filter)
        except re.error as error:
            text = f'invalid regular expression "{filters.filter}": {error}'
            raise RefusedError(messages.Result.RESULT_OPERATION_FAILED, text) from error
        categories = {each.category for each in filters.categories}
        people = self._people()
        return [
            model
            for model in self._world.models
            if pattern.search(model.name)
            and (not categories or self._category(model, people) in categories)
            and _has_tags(model, filters.tags)
            and _overlaps(model, filters.bounds)
        ]

    def _people(self) -> set[str]:
        plugins = [each for each in self._world.plugins if isinstance(each, Pedestrians)]
        return {name for plugin in plugins for name in plugin.people.names}

    def _category(self, model: Model, people: set[str]) -> int:
        category = messages.EntityCategory
        if model.name in people:
            return int(category.CATEGORY_HUMAN)
        ports = self._world.ports
        if any(ports.commands_of(describe(plugin)) for plugin in model.plugins):
            return int(category.CATEGORY_ROBOT)
        if all(body.type == "static" for body in model.bodies):
            return int(category.CATEGORY_STATIC_OBJECT)
        return int(category.CATEGORY_DYNAMIC_OBJECT)


class RefusedError(CallError):
    """A request was refused for a reason that has a code."""

    def __init__(self, code: int, text: str) -> None:
        """Initializes the error."""
        super().__init__(text)
        self.code = code


@contextmanager
def simulation_services(transport: Transport, served: ServedWorld, node: Node) -> Iterator[None]:
    """Offers the services that only ROS 2 has, until the end of the block.

    Args:
        transport: Serves.
        served: The world.
        node: The node, for the action.

    Raises:
        FlatlandError: A plugin has a service of the same name.
    """
    with closing(_serve_change_rate(transport, served.services)):
        if messages is None:
            _LOG.info("simulation_interfaces is not installed: its services are not offered")
            yield
            return
        with closing(SimulationServices(transport, served, node)):
            yield


def _serve_change_rate(transport: Transport, services: Services) -> Connection:
    """Offers `change_rate`, the name of `set_rate` in ports of the reference to ROS 2."""
    [set_rate] = [service for service in SERVICES if service.name == "set_rate"]

    def change_rate(request: Any) -> dict[str, Any]:
        return services.call(set_rate, SimpleNamespace(update_rate=request.rate))

    return transport.serve("change_rate", "flatland/ChangeRate", change_rate)


def _code(error: Exception) -> int:
    """Returns the result code of a failed request."""
    if isinstance(error, RefusedError):
        return error.code
    return int(messages.Result.RESULT_OPERATION_FAILED)


def _planar(header: Any, pose: Any, response: Any) -> Pose:
    """Returns a pose in the world frame.

    Raises:
        RefusedError: The frame is another one, or the pose is not finite or has no rotation.
    """
    if header.frame_id.lstrip("/") not in _WORLD_FRAMES:
        text = f'poses are in the frame "{WORLD_FRAME}" of the world, got "{header.frame_id}"'
        raise RefusedError(response.INVALID_POSE, text)
    planar = planar_pose(pose)
    if planar is None:
        raise RefusedError(response.INVALID_POSE, "the pose is not finite or has no rotation")
    return planar


def _is_zero(twist: Any) -> bool:
    linear, angular = twist.linear, twist.angular
    return not any((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z))


def _path_of(uri: str, text: str, response: Any) -> str:
    """Returns the path of a model file, or YAML text that `World.spawn_model` accepts.

    Raises:
        RefusedError: There is neither, or of another format.
    """
    if not uri:
        if not text.strip():
            raise RefusedError(response.NO_RESOURCE, "neither a URI nor a text is given")
        if text.lstrip().startswith("<"):
            raise RefusedError(response.UNSUPPORTED_FORMAT, "the text is XML, expected YAML")
        return f"\n{text}"
    parts = urlsplit(uri)
    path = unquote(parts.path) if parts.scheme == "file" else uri
    if parts.scheme not in ("", "file") or Path(path).suffix not in _FORMATS:
        text = f'"{uri}" is not the path or the file: URI of a model file (.yaml)'
        raise RefusedError(response.UNSUPPORTED_FORMAT, text)
    return path


def _entity_name(uri: str) -> str:
    """Returns a name for an entity that has none."""
    return Path(urlsplit(uri).path).name.partition(".")[0] or "entity"


def _has_tags(model: Model, wanted: Any) -> bool:
    matches = [tag == model.class_name for tag in wanted.tags]
    if not matches:
        return True
    return all(matches) if wanted.filter_mode == wanted.FILTER_MODE_ALL else any(matches)


def _bounds(model: Model, frame: Pose = IDENTITY) -> Bounds | None:
    """Returns the bounds of all footprints of a model [m], None without footprints.

    Args:
        model: The model.
        frame: Pose of the world in the frame of the result [m, rad].
    """
    boxes = [box for body in model.bodies for box in _boxes(body, frame)]
    return bounds_of(np.array(boxes).reshape(-1, 2))


def _boxes(body: Body, frame: Pose) -> list[tuple[float, float]]:
    corners = []
    for fixture in body.fixtures:
        points = np.array([fixture.center]) if fixture.shape == "circle" else fixture.vertices
        radius = fixture.radius if fixture.shape == "circle" else 0.0
        for x, y in transform_points(frame, transform_points(body.pose, points)).tolist():
            corners += [(x - radius, y - radius), (x + radius, y + radius)]
    return corners


def _overlaps(model: Model, bounds: Any) -> bool:
    """Returns whether the bounds of a model overlap those of a filter.

    Raises:
        RefusedError: The type of the bounds is not supported, or they have too few points.
    """
    kind = bounds.type
    if kind == bounds.TYPE_EMPTY:
        return True
    if kind not in (bounds.TYPE_BOX, bounds.TYPE_SPHERE):
        text = "bounds of a filter must be a box or a sphere"
        raise RefusedError(messages.Result.RESULT_FEATURE_UNSUPPORTED, text)
    if len(bounds.points) != 2:
        text = f"a box or a sphere has 2 points, got {len(bounds.points)}"
        raise RefusedError(messages.Result.RESULT_OPERATION_FAILED, text)
    own = _bounds(model)
    if own is None:
        return False
    x_min, y_min, x_max, y_max = own
    first, second = bounds.points
    if kind == bounds.TYPE_SPHERE:
        nearest = (min(max(first.x, x_min), x_max), min(max(first.y, y_min), y_max))
        return bool(math.dist(nearest, (first.x, first.y)) <= second.x)
    return bool(
        min(first.x, second.x) <= x_max
        and x_min <= max(first.x, second.x)
        and min(first.y, second.y) <= y_max
        and y_min <= max(first.y, second.y)
    )
