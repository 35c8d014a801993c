"""A world on ROS: loaded from the parameters of the node, with its topics and services."""

from __future__ import annotations

import logging
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from flatland.errors import FlatlandError
from flatland.node.bridge import Bridge
from flatland.node.deferred_topics import DeferredTopics
from flatland.node.frame_monitor import FrameMonitor
from flatland.node.hook_watchdog import HookWatchdog
from flatland.node.maps import PublishedLayer, receive_layers
from flatland.node.operations import Operations
from flatland.node.parameters import ParameterError
from flatland.node.services import Services
from flatland.node.states import ModelStatesTopic
from flatland.simulation import Simulation
from flatland.world import World

if TYPE_CHECKING:
    from flatland.node.clock import NodeClock
    from flatland.node.parameters import NodeParameters
    from flatland.node.transport import MessageFile, Transport
    from flatland.simulation import RunResult
    from flatland.world import OpenRecording

_LOG = logging.getLogger("flatland")


class ServedWorld:
    """A world with its simulation, topics and services, until `close`.

    Attributes:
        world: The world.
        simulation: Steps it.
        operations: Changes it as the parameters configure; for services of a kind of ROS alone.
        services: Carry out requests between two steps; likewise.
    """

    def __init__(self, parameters: NodeParameters, transport: Transport, clock: NodeClock) -> None:
        """Loads the world and adds its topics and services; a failure closes what was started.

        Args:
            parameters: The parameters of the node.
            transport: Publishes, subscribes and serves.
            clock: The clock of the node; closed with the world.

        Raises:
            ParameterError: A parameter does not fit the world.
            FlatlandError: The world cannot be loaded, a recording cannot be created, or the map
                cannot be published.
        """
        self._parameters, self._transport, self._clock = parameters, transport, clock
        self._recordings: dict[str, OpenRecording | MessageFile] = {}
        with ExitStack() as closing:  # in reverse order
            closing.callback(clock.close)
            self._bridge = Bridge(transport, clock)
            self.world = self._load(closing)
            self.simulation = Simulation(
                self.world,
                parameters.update_rate,
                max_lag=parameters.max_lag,
                lockstep=parameters.lockstep,
                report=lambda report: _LOG.debug("%s", report),
            )
            self._add_topics(closing)
            self._closing = closing.pop_all()

    def close(self) -> None:
        """Closes the world, its topics and the clock."""
        self._closing.close()

    @property
    def incomplete_files(self) -> dict[str, str]:
        """Paths of recordings that are not complete, with the reasons; complete after `close`."""
        return {path: each.error for path, each in self._recordings.items() if each.error}

    def run(self) -> None:
        """Steps the world until a stop is requested, or the benchmark ends."""
        if self._parameters.benchmark_duration is None:
            self.simulation.run()
            return
        result = self.simulation.run(self._parameters.benchmark_duration)
        if not self.simulation.stopped:
            _log_benchmark(result)

    def _load(self, closing: ExitStack) -> World:
        """Loads the world and starts the recordings that the parameters name.

        Args:
            closing: Closes them.

        Raises:
            FlatlandError: The world cannot be loaded, or a file cannot be created.
        """
        parameters = self._parameters
        start = time.perf_counter()
        world = World.from_yaml(
            parameters.world_path,
            seed=parameters.seed,
            params=self._transport.parameter,
            simplify_map=parameters.simplify_map,
            step_size=parameters.step_size,
            observers=[self._bridge],
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
        recordings = closing.enter_context(ExitStack())
        closing.callback(world.close)
        if parameters.record:
            self._recordings[parameters.record] = world.record(parameters.record)
            _LOG.info('recording the run to "%s"', parameters.record)
        if parameters.record_mcap:
            try:
                recorder = self._transport.record(parameters.record_mcap, world)
            except OSError as error:
                text = f'cannot create "{parameters.record_mcap}": {error.strerror}'
                raise FlatlandError(text) from error
            _LOG.info('recording messages to "%s"', parameters.record_mcap)
            self._recordings[parameters.record_mcap] = recorder
            recordings.callback(recorder.close)
        return world

    def _add_topics(self, closing: ExitStack) -> None:
        parameters, transport, simulation = self._parameters, self._transport, self.simulation
        # Plugins are closed before their topics, so that `on_shutdown` can publish; the transport
        # then unregisters all topics at once.
        closing.callback(self._bridge.close)
        frame_monitor = FrameMonitor(transport, simulation, self._bridge.subscribed)
        closing.callback(frame_monitor.close)
        deferred_topics = DeferredTopics(
            transport,
            simulation,
            debug_rate=parameters.viz_pub_rate if parameters.show_viz else None,
            move_keeps_odometry=parameters.move_keeps_odometry,
        )
        closing.callback(deferred_topics.close)
        self._publish_map()
        self.operations = Operations(
            transport,
            simulation,
            self._clock,
            parameters.if_blocked,
            move_keeps_odometry=parameters.move_keeps_odometry,
        )
        receive_layers(transport, simulation)
        ModelStatesTopic(transport, simulation, parameters.model_states_rate)
        self.services = Services(
            transport, simulation, self._clock, self.operations, deferred_topics.opened
        )
        self.services.open()
        if parameters.web:
            from flatland.node.browser_viewer import BrowserViewer

            browser_viewer = BrowserViewer(transport, simulation, self.operations, parameters)
            closing.callback(browser_viewer.close)
        if parameters.initialpose_model:
            from flatland.node.initial_pose import InitialPose

            InitialPose(transport, simulation, parameters.initialpose_model, parameters.if_blocked)
        closing.callback(HookWatchdog(self.world).close)

    def _publish_map(self) -> None:
        """Publishes the layer that the parameters or the world file name as a map, if any.

        Raises:
            ParameterError: The layer of the parameter does not exist.
            FlatlandError: The layer cannot be published.
        """
        parameters, world = self._parameters, self.world
        layer = parameters.publish_map
        if layer == "":
            layer = world.map_layer
        if not layer:
            return
        names = [name for each in world.layers for name in each.names]
        if layer not in names:
            raise ParameterError(
                'Invalid parameter "~publish_map": it must be the name of a layer '
                f"({', '.join(names) or 'none'}), got {layer!r}"
            )
        PublishedLayer(
            self._transport, world, layer, parameters.map_frame, parameters.map_resolution
        )


def _log_benchmark(result: RunResult) -> None:
    _LOG.info(
        "benchmark: %d iterations in %.3f s of wall time, %.1f iterations a second",
        result.steps,
        result.wall_time,
        result.steps_per_second,
    )
