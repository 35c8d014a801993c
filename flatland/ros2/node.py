"""The server node: a world on ROS 2, from its parameters to its exit code."""

from __future__ import annotations

import argparse
import gc
import logging
import sys
import threading
from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import FlatlandError
from flatland.node.fault_reports import FaultReports
from flatland.node.parameters import (
    NodeParameters,
    ParameterError,
    Ros2Parameters,
    read_parameters,
    read_table,
)
from flatland.node.shutdown import ShutdownWatchdog

if TYPE_CHECKING:
    from rclpy.node import Node

    from flatland.ros2.transport import Ros2Transport
    from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

NODE_NAME: Final = "flatland_server"
_SWITCH_INTERVAL: Final = 0.0002  # s for which a thread keeps the GIL while others wait for it
_SPIN_PERIOD: Final = 3600.0  # s
_EXECUTOR_TIMEOUT: Final = 0.5  # s, for the callback in progress when the node ends


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the node.

    Args:
        arguments: The command line, with the name of the program; None for that of the process.

    Returns:
        The exit code: 0 after a requested stop or a complete benchmark, 1 after a failure, whose
        cause is logged at fatal level.
    """
    command_line = list(sys.argv if arguments is None else arguments)
    # During the start, the collector would examine the objects of all modules several times.
    gc.disable()
    try:
        return ServerNode().run(command_line)
    finally:
        gc.enable()


class ServerNode:
    """One run of the node."""

    def __init__(self) -> None:
        """Prepares the run."""
        self._stopping = threading.Event()
        self._simulation: Simulation | None = None
        self._transport: Ros2Transport | None = None
        self._fault_reports = FaultReports(lambda _error_type: False)

    def run(self, command_line: Sequence[str]) -> int:
        """Runs until a stop is requested, and returns the exit code.

        Args:
            command_line: The name of the program and its arguments.
        """
        # First of all, so that no signal is lost.
        watchdog = ShutdownWatchdog(self._stop, lambda: None)
        self._fault_reports.install()
        # The executor needs the GIL for each message beside a loop at full speed.
        sys.setswitchinterval(_SWITCH_INTERVAL)
        import rclpy
        from rclpy.signals import SignalHandlerOptions
        from rclpy.utilities import remove_ros_args

        parser = argparse.ArgumentParser(
            prog=NODE_NAME,
            description="The simulator node of flatland for ROS 2. Parameters are set as "
            "`--ros-args -p NAME:=VALUE`.",
            allow_abbrev=False,
        )
        try:
            parser.parse_args(remove_ros_args(command_line)[1:])
            rclpy.init(args=command_line, signal_handler_options=SignalHandlerOptions.NO)
            node = rclpy.create_node(NODE_NAME)
        except Exception as error:  # an invalid argument or name, of several types
            return self._fail(_first_line(error))
        with ExitStack() as ending:
            ending.callback(rclpy.try_shutdown)
            ending.callback(node.destroy_node)
            from flatland.ros2.logs import log_to_ros

            log_to_ros(node.get_logger())
            try:
                self._simulate(node, watchdog)
            except ParameterError as error:
                return self._fail(str(error))
            except FlatlandError as error:
                return self._fail(error.text_with_hint)
            except Exception:
                return self._fail("unexpected internal error", exc_info=True)
        return 0

    def _stop(self) -> None:
        """Ends the simulation after the current step; safe from any thread."""
        self._stopping.set()
        if self._transport is not None:
            self._transport.shut_down()
        if self._simulation is not None:
            self._simulation.stop()

    def _fail(self, text: str, **options: Any) -> int:
        if self._stopping.is_set():
            # An error caused by the stop, for example during loading, is not a failure.
            _LOG.info("stopped: %s", text)
            return 0
        _LOG.critical("%s", text, **options)
        return 1

    def _simulate(self, node: Node, watchdog: ShutdownWatchdog) -> None:
        """Loads the world and steps it until a stop is requested.

        Args:
            node: The node.
            watchdog: Limits the time of the shutdown.

        Raises:
            ParameterError: A parameter is invalid.
            FlatlandError: The world cannot be loaded.
        """
        from flatland.node.clock import NodeClock, SimulatedClock, WallClock
        from flatland.ros2.parameters import DeclaredParameters
        from flatland.ros2.transport import Ros2Transport

        # The node sets its time itself, instead of subscribing to its own /clock.
        node._time_source.detach_node()
        declared = DeclaredParameters(node)
        parameters: NodeParameters = read_parameters(declared.get)
        own: Ros2Parameters = read_table(Ros2Parameters, declared.get)
        watchdog.timeout = parameters.shutdown_timeout
        declared.describe(parameters, own)
        transport = self._transport = Ros2Transport(
            node, declared, reliable_sensors=own.reliable_sensors
        )
        clock: NodeClock
        if parameters.use_sim_time:
            clock = SimulatedClock(transport, parameters.clock_rate)
        else:
            clock = WallClock()
        if own.enable_stamped_cmd_vel:
            from flatland.ros2.adapters import use_stamped_twists

            use_stamped_twists()
        from flatland.node.served_world import ServedWorld
        from flatland.ros2.simulation_services import simulation_services

        with (
            closing(_ExecutorThread(node)),
            closing(ServedWorld(parameters, transport, clock)) as served,
            simulation_services(transport, served, node),
        ):
            self._fault_reports.world = served.world
            self._simulation = served.simulation
            if self._stopping.is_set():
                served.simulation.stop()
            gc.enable()
            served.run()
            transport.shut_down()


class _ExecutorThread:
    """Runs the callbacks of the node in a thread, until `close`."""

    def __init__(self, node: Node) -> None:
        """Starts the thread."""
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.task import Future

        # Much faster than the other executors, which examine all entities after each callback.
        self._executor: Any = EventsExecutor()
        self._executor.add_node(node)
        self._end = Future(executor=self._executor)
        self._thread = threading.Thread(target=self._run, name="flatland-executor", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread."""
        self._end.set_result(None)
        self._executor.wake()
        self._thread.join(_EXECUTOR_TIMEOUT)

    def _run(self) -> None:
        from rclpy.exceptions import InvalidHandle

        while not self._end.done():
            try:
                # `spin` waits actively in some versions, because its time limit is infinite.
                self._executor.spin_until_future_complete(self._end, _SPIN_PERIOD)
            except InvalidHandle:
                pass  # An event of a connection that has just been closed.
            except Exception:
                _LOG.exception("unexpected internal error in a callback")


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
