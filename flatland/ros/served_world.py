"""A world on ROS: loaded from the parameters of the node, with its topics and services."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from flatland.errors import FlatlandError
from flatland.ros.bridge import Bridge
from flatland.ros.deferred_topics import DeferredTopics
from flatland.ros.frame_monitor import FrameMonitor
from flatland.ros.hook_watchdog import HookWatchdog
from flatland.ros.operations import Operations
from flatland.ros.parameters import ParameterError
from flatland.ros.services import Services
from flatland.ros.transport.master_watch import MasterWatch
from flatland.simulation import Simulation

if TYPE_CHECKING:
    from types import TracebackType

    from flatland.ros.clock import NodeClock
    from flatland.ros.message_recorder import MessageRecorder
    from flatland.ros.parameters import NodeParameters
    from flatland.ros.transport.registrar import Registrar
    from flatland.simulation import RunResult
    from flatland.world import World

_LOG = logging.getLogger("flatland")


class ServedWorld:
    """A world with its simulation, topics and services, until the end of a `with` block.

    Attributes:
        world: The world.
        simulation: Steps it.
    """

    def __init__(
        self,
        parameters: NodeParameters,
        registrar: Registrar,
        clock: NodeClock,
        replaced: Callable[[], None],
    ) -> None:
        """Loads the world; `__enter__` adds the topics and services.

        Args:
            parameters: The parameters of the node.
            registrar: Registers the topics and services.
            clock: The clock of the node; closed with the world.
            replaced: Called when another node has taken the name of this one, in any thread.

        Raises:
            FlatlandError: The world cannot be loaded.
        """
        self._parameters, self._registrar, self._clock = parameters, registrar, clock
        self._master_watch = MasterWatch(registrar, replaced)
        self._bridge = Bridge(registrar, clock)
        self.world = _load(parameters, self._bridge)
        self._message_recorder = _start_recordings(parameters, self.world)
        self._hook_watchdog = HookWatchdog(self.world)
        self.simulation = Simulation(
            self.world,
            parameters.update_rate,
            max_lag=parameters.max_lag,
            lockstep=parameters.lockstep,
            report=lambda report: _LOG.debug("%s", report),
        )
        self._closing = ExitStack()  # in reverse order

    def __enter__(self) -> ServedWorld:
        """Adds the topics and services of the world.

        Raises:
            ParameterError: A parameter does not fit the world.
            FlatlandError: The map cannot be published, or the browser viewer cannot listen.
        """
        closing = self._closing
        closing.callback(self._clock.close)
        if self._message_recorder is not None:
            closing.callback(self._message_recorder.close)
        closing.callback(self.world.close)
        # Plugins are closed before their topics, so that `on_shutdown` can publish; rospy then
        # unregisters all topics at once.
        closing.callback(self._bridge.close)
        try:
            self._add_topics()
        except BaseException:
            closing.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Closes the world, its topics and the clock."""
        self._closing.close()

    def run(self) -> None:
        """Steps the world until a stop is requested, or the benchmark ends."""
        if self._parameters.benchmark_duration is None:
            self.simulation.run()
            return
        result = self.simulation.run(self._parameters.benchmark_duration)
        if not self.simulation.stopped:
            _log_benchmark(result)

    def _add_topics(self) -> None:
        parameters, registrar, simulation = self._parameters, self._registrar, self.simulation
        keeps_odometry = parameters.move_keeps_odometry
        closing = self._closing
        frame_monitor = FrameMonitor(registrar, simulation, self._bridge.subscribed)
        closing.callback(frame_monitor.close)
        deferred_topics = DeferredTopics(
            registrar,
            simulation,
            debug_rate=parameters.viz_pub_rate if parameters.show_viz else None,
            move_keeps_odometry=keeps_odometry,
        )
        closing.callback(deferred_topics.close)
        _publish_map(registrar, self.world, parameters)
        operations = Operations(
            registrar,
            simulation,
            self._clock,
            parameters.if_blocked,
            move_keeps_odometry=keeps_odometry,
        )
        Services(
            registrar,
            simulation,
            self._clock,
            operations,
            parameters.if_blocked,
            move_keeps_odometry=keeps_odometry,
            model_states_rate=parameters.model_states_rate,
        )
        if parameters.web is not None:
            from flatland.ros.browser_viewer import BrowserViewer

            browser_viewer = BrowserViewer(registrar, simulation, operations, parameters.web)
            closing.callback(browser_viewer.close)
        if parameters.initialpose_model:
            from flatland.ros.initial_pose import InitialPose

            InitialPose(registrar, simulation, parameters.initialpose_model, parameters.if_blocked)
        closing.callback(self._hook_watchdog.close)
        closing.callback(self._master_watch.close)


def _start_recordings(parameters: NodeParameters, world: World) -> MessageRecorder | None:
    """Starts the recordings that the parameters name.

    Returns:
        The recorder of messages, None if there is none.

    Raises:
        FlatlandError: A file cannot be created; the world is closed.
    """
    recorder: MessageRecorder | None = None
    try:
        if parameters.record:
            world.record(parameters.record)
            _LOG.info('recording the run to "%s"', parameters.record)
        if parameters.record_mcap:
            from flatland.ros.message_recorder import create_mcap_recorder

            recorder = create_mcap_recorder(parameters.record_mcap, ends_on_error=True)
            recorder.observe(world)
            _LOG.info('recording messages to "%s"', parameters.record_mcap)
    except OSError as error:
        world.close()
        text = f'cannot create "{parameters.record_mcap}": {error.strerror}'
        raise FlatlandError(text) from error
    except FlatlandError:
        world.close()
        raise
    return recorder


def _load(parameters: NodeParameters, bridge: Any) -> World:
    from flatland.ros.parameter_server import yaml_parameter
    from flatland.world import World

    start = time.perf_counter()
    world = World.from_yaml(
        parameters.world_path,
        seed=parameters.seed,
        params=yaml_parameter,
        simplify_map=parameters.simplify_map,
        step_size=parameters.step_size,
        observers=[bridge],
        plugin_timeout=parameters.plugin_timeout,
        plugin_errors="disable",
        on_invalid_body="remove",
        model_path=parameters.model_path,
    )
    _LOG.info(
        'loaded "%s" in %.2f s: %d layers, %d models',
        world.path,
        time.perf_counter() - start,
        len(world.layers),
        len(world.models),
    )
    return world


def _publish_map(registrar: Registrar, world: World, parameters: NodeParameters) -> None:
    """Publishes the layer that the parameters or the world file name as a map, if any.

    Raises:
        ParameterError: The layer of the parameter does not exist.
        FlatlandError: The layer cannot be published.
    """
    layer = parameters.publish_map or ("" if parameters.publish_map is None else world.map_layer)
    if not layer:
        return
    from flatland.ros.map_topics import MapTopics

    names = [name for each in world.layers for name in each.names]
    if layer not in names:
        raise ParameterError(
            'Invalid parameter "~publish_map": it must be the name of a layer '
            f"({', '.join(names) or 'none'}), got {layer!r}"
        )
    MapTopics(registrar, world, layer, parameters.map_frame, parameters.map_resolution)


def _log_benchmark(result: RunResult) -> None:
    _LOG.info(
        "benchmark: %d iterations in %.3f s of wall time, %.1f iterations a second",
        result.steps,
        result.wall_time,
        result.steps_per_second,
    )
