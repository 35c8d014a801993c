"""The server node: a world on ROS 2, from its parameters to its exit code."""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Final

from flatland.node.parameters import Ros2Parameters, read_parameters, read_table
from flatland.node.run import NodeRun

if TYPE_CHECKING:
    from rclpy.node import Node

NODE_NAME: Final = "flatland_server"


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
        self._run = NodeRun(lambda _error_type: False, lambda: None)

    def run(self, command_line: Sequence[str]) -> int:
        """Runs until a stop is requested, and returns the exit code.

        Args:
            command_line: The name of the program and its arguments.
        """
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
            return self._run.fail(_first_line(error))
        with ExitStack() as ending:
            ending.callback(rclpy.try_shutdown)
            ending.callback(node.destroy_node)
            from flatland.ros2.logs import log_to_ros

            log_to_ros(node.get_logger())
            return self._run.exit_code_of(lambda: self._simulate(node))

    def _simulate(self, node: Node) -> None:
        """Loads the world and steps it until a stop is requested.

        Args:
            node: The node.

        Raises:
            ParameterError: A parameter is invalid.
            FlatlandError: The world cannot be loaded.
        """
        from flatland.node.clock import NodeClock, SimulatedClock, WallClock
        from flatland.ros2.executor import ExecutorThread
        from flatland.ros2.parameters import DeclaredParameters
        from flatland.ros2.transport import Ros2Transport

        # The node sets its time itself, instead of subscribing to its own /clock.
        node._time_source.detach_node()
        declared = DeclaredParameters(node)
        parameters = read_parameters(declared.get)
        own = read_table(Ros2Parameters, declared.get)
        self._run.watchdog.timeout = parameters.shutdown_timeout
        declared.describe(parameters, own)
        transport = Ros2Transport(
            node,
            declared,
            reliable_sensors=own.reliable_sensors,
            is_stopping=self._run.stopping.is_set,
        )
        clock: NodeClock
        if parameters.use_sim_time:
            clock = SimulatedClock(transport, parameters.clock_rate)
        else:
            clock = WallClock()
        if own.enable_stamped_cmd_vel:
            from flatland.ros2.adapters import use_stamped_twists

            use_stamped_twists()
        from flatland.ros2.simulation_services import simulation_services

        with closing(ExecutorThread(node)):
            self._run.serve(
                parameters,
                transport,
                clock,
                lambda served: simulation_services(transport, served, node),
                ended=transport.shut_down,
            )


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
